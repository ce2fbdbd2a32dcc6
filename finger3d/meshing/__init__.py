"""Meshes of a design: fTetWild with snapping to the CAD surface, structured swept meshes, sizes and the mesh cache."""
