"""Speech blendshapes: a linear basis learned from registered speech (in the wild 2019, 3.3).

blendshape_learning    a corpus to a head whose shapes are the basis
principal_components   principal directions in one pass over more meshes than fit into memory
settings               how many shapes, and how sparse
localised_components   shapes that each move a part of the face
basis_motion           a basis as a Motion that shows each shape in turn
basis_comparison       how well a basis represents faces it was not learned from
"""
