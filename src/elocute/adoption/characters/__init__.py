"""Characters in files of their own, moved by the names of their morph targets and joints.

open_character       a glTF file in, a head that stands for its character and a report out
mapping              which of its shapes and joints take which curves
shape_names          what a morph target does, by its name
vrm                  what a VRM says itself
morphs               the meshes that have morph targets, and which of them are one head
report               the mapping in words
"""
