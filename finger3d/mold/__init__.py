"""Printable parts of a scene: the finger as STEP and STL, and a mold of it."""
