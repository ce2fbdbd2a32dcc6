"""From a scene to printable parts: the finger as STEP and STL, and a mold of it."""
