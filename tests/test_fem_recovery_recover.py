"""Fields at the nodes."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import quadratic
from finger3d.fem.recovery.recover import extrapolated, nodal_pressure, nodal_strain, strain_and_stress
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


@pytest.mark.parametrize("plane_strain", [True, False])
def test_across_a_section_are_no_strain_or_no_stress(plane_strain: bool) -> None:
    material, mesh = Isotropic(2.0, 0.3), quadratic(grid((1, 1)))
    slope = np.array([[0.01, 0.002], [0.002, -0.003]])
    law = material.elasticity(not plane_strain)
    across = partial(material.across, plane_strain=plane_strain)
    e, s = (field[0] for field in strain_and_stress(mesh, (mesh.points @ slope).ravel(), [law], 1.0, [across]))
    np.testing.assert_allclose(e[:2, :2], slope, atol=1e-15)
    assert (e if plane_strain else s)[2, 2] == pytest.approx(0.0, abs=1e-15)
    # Hooke's law along z: E e_z = s_z - nu (s_x + s_y)
    assert 2.0 * e[2, 2] == pytest.approx(s[2, 2] - 0.3 * (s[0, 0] + s[1, 1]), abs=1e-15)


def test_the_pressure_of_the_mixed_form_is_added_to_the_normal_stresses() -> None:
    mesh, law = quadratic(grid((1, 1, 1))), Isotropic(1.0, 0.49).elasticity()
    pressures = np.arange(len(mesh.vertices))
    unknowns = np.concatenate([np.zeros(mesh.points.size), pressures])
    _, sigma = strain_and_stress(mesh, unknowns, [law], 0.25)
    np.testing.assert_array_equal(sigma[mesh.vertices], 0.25 * pressures[:, None, None] * np.eye(3))
