"""Kelvin's solution of a point force, and its integral over a patch."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from finger3d.fem.solids.kelvin import FoilPatches, InfiniteBody

E, NU = 2.0, 0.3
X, Y = np.eye(3)[:2]


def test_a_point_force_moves_a_body_as_kelvin_says() -> None:
    """Love 1944, sec. 130: u_x = F / (16 pi G (1 - nu) r) ((3 - 4 nu) + x^2 / r^2)."""
    at = np.array([0.6, -0.8, 1.5])
    r, shear = np.linalg.norm(at), E / (2.0 * (1.0 + NU))
    expected = ((3.0 - 4.0 * NU) + at[0] ** 2 / r**2) / (16.0 * np.pi * shear * (1.0 - NU) * r)
    body = InfiniteBody(E, NU)
    assert body.displacement(at, X, X, np.array(0.0)) == pytest.approx(expected, rel=1e-12)
    forth, back = (body.displacement(at, s, t, np.array(0.0)) for s, t in ((X, Y), (Y, X)))
    assert forth == pytest.approx(back, rel=1e-12)


def test_plane_strain_is_the_integral_of_point_forces_along_the_width() -> None:
    """The difference of two places: the displacement of a line of forces itself is infinite."""
    solid, plane = InfiniteBody(E, NU), InfiniteBody(E, NU, thickness=1.0)
    near, far = np.array([0.5, 0.2, 0.0]), np.array([2.0, -1.0, 0.0])
    none = np.array(0.0)

    def difference(z: float) -> float:
        along = np.array([0.0, 0.0, z])
        return float(solid.displacement(near + along, X, X, none) - solid.displacement(far + along, X, X, none))

    expected = 2.0 * quad(difference, 0.0, np.inf, limit=200)[0]
    found = plane.displacement(near, X, X, none) - plane.displacement(far, X, X, none)
    assert found == pytest.approx(expected, rel=1e-7)


def test_a_patch_is_the_integral_of_its_point_forces() -> None:
    body = InfiniteBody(E, NU)
    begin, end, low, high, s, z = -0.4, 0.6, -0.2, 0.3, 1.5, 0.8
    none = np.array(0.0)

    def point(across: float, along: float) -> float:
        return float(body.displacement(np.array([s - along, 0.0, z - across]), X, X, none))

    expected = dblquad(point, begin, end, low, high)[0] / ((end - begin) * (high - low))
    found = body.self_displacement(*(np.array(v) for v in (begin, end, low, high, s, z)))
    assert found == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("thickness", [None, 2.0])
def test_bars_unload_themselves_and_the_matrix_is_symmetric(thickness: float | None) -> None:
    body = InfiniteBody(E, NU, thickness=thickness)
    foil = FoilPatches.of(np.zeros(3), X, 4.0, 1.0, 8, 1 if thickness else 3)
    own = foil.strain_due_to(foil, body)
    assert own.shape == (len(foil.area), len(foil.area))
    pull = own * foil.area if thickness is None else own
    assert (np.diag(own) > 0.0).all()  # a bar that pulls at its ends stretches the body between them
    assert np.isfinite(pull).all()
