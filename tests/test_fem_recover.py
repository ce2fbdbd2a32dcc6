"""Fields at the nodes."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.elements import quadrature
from finger3d.fem.material import Isotropic
from finger3d.fem.recover import across, extrapolated, nodal_pressure, nodal_strain, stress
from finger3d.fem.simplex import quadratic
from tests.meshes import grid


@pytest.mark.parametrize("dim", [2, 3])
def test_strain_of_a_quadratic_field_is_exact_inside_a_cell_and_a_mean_at_the_nodes(dim: int) -> None:
    mesh, rng = quadratic(grid((2,) * dim, 0.2)), np.random.default_rng(0)
    slope = rng.normal(size=(dim, dim))
    strain = nodal_strain(mesh, mesh.points @ slope.T)
    assert np.allclose(strain, 0.5 * (slope + slope.T), atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_linear_field_is_recovered_from_vertices_and_from_quadrature_points(dim: int) -> None:
    mesh = quadratic(grid((2,) * dim, 0.2))
    linear = mesh.points @ np.arange(1.0, dim + 1.0) + 0.5
    assert np.allclose(nodal_pressure(mesh, linear[mesh.vertices]), linear)
    bary, _ = quadrature(dim, 2)
    at = np.einsum("qk,ek->eq", bary, linear[mesh.cells[:, : dim + 1]])
    assert np.allclose(extrapolated(mesh, at.reshape(-1)), linear)


def test_across_a_section_are_no_strain_or_no_stress() -> None:
    material, strain = Isotropic(2.0, 0.3), np.array([[[0.01, 0.002], [0.002, -0.003]]])
    for plane_strain in (True, False):
        elastic = material.elasticity(not plane_strain)
        e, s = across(strain, stress(strain, elastic), material, plane_strain)
        assert np.array_equal(e[:, :2, :2], strain)
        assert (e if plane_strain else s)[0, 2, 2] == pytest.approx(0.0, abs=1e-15)
        # Hooke's law along z: E e_z = s_z - nu (s_x + s_y)
        assert 2.0 * e[0, 2, 2] == pytest.approx(s[0, 2, 2] - 0.3 * (s[0, 0, 0] + s[0, 1, 1]), abs=1e-15)


def test_the_pressure_of_the_mixed_form_is_added_to_the_normal_stresses() -> None:
    elastic, strain = Isotropic(1.0, 0.3).elasticity(False), np.zeros((2, 3, 3))
    assert np.array_equal(
        stress(strain, elastic, np.array([0.5, -1.0])), np.array([0.5, -1.0])[:, None, None] * np.eye(3)
    )
