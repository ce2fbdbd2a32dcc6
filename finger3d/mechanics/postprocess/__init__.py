"""What is computed from the increments of a press: penetration, and displacements of a grid of markers."""
