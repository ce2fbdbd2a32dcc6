"""A scene solved in plane stress, plane strain and 3D, and how far the plane models are from the solid."""
