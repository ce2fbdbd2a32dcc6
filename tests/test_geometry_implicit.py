"""Implicit surfaces."""

from __future__ import annotations

import numpy as np

from finger3d.geometry.implicit import Freeform, ImplicitCylinder, surface_of
from finger3d.meshing.structured.snap import project
from tests.cad_cases import faces_of


def test_free_form_surfaces_are_reached_by_projection() -> None:
    from build123d import Face, Vector

    # A patch of a cylinder through points, so that CAD knows it as a free form only.
    angles = np.linspace(-0.6, 0.6, 9)
    rows = [[(5 * np.sin(a), 5 * np.cos(a), z) for z in (-2.0, 0.0, 2.0, 4.0)] for a in angles]
    face = Face.make_surface_from_array_of_points([[Vector(*map(float, p)) for p in row] for row in rows], tol=1e-6)
    surface = surface_of(face)
    assert isinstance(surface, Freeform)
    points = np.array([[0.5, 5.3, 0.2], [-1.0, 4.6, 1.0]])
    distance, normal = surface.distance(points)
    exact, out = ImplicitCylinder(np.zeros(3), np.array([0.0, 0.0, 1.0]), 5.0).distance(points)
    np.testing.assert_allclose(np.abs(distance), np.abs(exact), atol=1e-4)
    np.testing.assert_allclose(np.abs(np.einsum("ij,ij->i", normal, out)), 1.0, atol=1e-4)
    moved, _ = project(points, np.ones((2, 1), dtype=bool), faces_of(surface))
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), 5.0, atol=1e-4)
