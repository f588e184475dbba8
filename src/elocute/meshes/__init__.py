"""Mesh files: glTF, OBJ, PLY, STL, FBX, Draco and meshopt, read within limits."""
