"""Tensors, stiffness and recovered fields: exactness, rates and published values (validation/REFERENCES.md, 5)."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import quadratic, quadrature
from finger3d.fem.recovery import extrapolated, mean_traction_weights, nodal_pressure, nodal_strain, strain_and_stress
from finger3d.fem.tensors import cofactor, determinant
from tests.meshes import full, grid
from validation import cook, manufactured, patch_test
from validation._common import cube, mapped, side_load


def test_they_are_those_of_linear_algebra_singular_tensors_included() -> None:
    f = np.random.default_rng(0).normal(size=(5, 4, 3, 3))
    assert np.allclose(determinant(f), np.linalg.det(f), rtol=1e-12)
    j = np.linalg.det(f)[..., None, None]
    assert np.allclose(cofactor(f), j * np.swapaxes(np.linalg.inv(f), -1, -2), rtol=1e-9)
    # a projection on a plane has no inverse; its cofactor projects on the normal
    assert np.array_equal(cofactor(np.diag([1.0, 1.0, 0.0])), np.diag([0.0, 0.0, 1.0]))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("mixed", [False, True])
def test_rigid_motions_cost_nothing_and_nothing_else_does(dim: int, mixed: bool) -> None:
    mesh = mapped(grid((2,) * dim, 0.2), lambda x: x + 0.05 * np.sin(2 * x[:, ::-1]))
    system = full(stiffness(mesh, Elasticity.of(1.0, 0.3, mixed=mixed)).upper).toarray()
    n = mesh.points.size
    if mixed:  # eliminate the pressures
        system = system[:n, :n] - system[:n, n:] @ np.linalg.solve(system[n:, n:], system[n:, :n])
    values = np.linalg.eigvalsh(system)
    rigid = dim * (dim + 1) // 2
    assert np.abs(values[:rigid]).max() < 1e-12 * values[-1]
    assert values[rigid] > 1e-6 * values[-1]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("nu", "mixed"), [(0.3, False), (0.3, True), (0.4999, True)])
def test_patch_of_irregular_cells_holds_a_linear_field(dim: int, nu: float, mixed: bool) -> None:
    error = patch_test.linear(patch_test.patch(dim, 3), Elasticity.of(1.0, nu, mixed=mixed))
    assert error < 1e-12 * (1e3 if nu > 0.49 else 1.0)  # conditioning grows as 1 / (1 - 2 nu)


def test_quadratic_field_is_exact_on_straight_tet10() -> None:
    assert patch_test.quadratic_field(patch_test.patch(3, 2), Elasticity.of(1.0, 0.3)) < 1e-12


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_manufactured_solution_converges_at_the_rates_of_quadratic_elements(nu: float) -> None:
    coarse, fine = (np.array(manufactured.errors(3, count, nu)[:2]) for count in (3, 6))
    rate_l2, rate_h1 = np.log2(coarse / fine)
    assert rate_l2 > 2.7
    assert rate_h1 > 1.8


@pytest.mark.parametrize("panel", cook.PANELS, ids=lambda panel: panel.name)
def test_cook_membrane(panel: cook.Panel) -> None:
    # validation/REFERENCES.md, 5.4.  The clamped corner governs: error ~ h^1.1 to h^1.3; extrapolated as seen
    a, b, c = (cook.deflection(cube(2, n), panel) for n in (12, 24, 48))
    ratio = (c - b) / (b - a)
    assert 0.35 < ratio < 0.5
    assert c + (c - b) * ratio / (1 - ratio) == pytest.approx(panel.wanted, rel=1.5e-3)


def test_linear_triangles_fail_cook_at_near_incompressibility() -> None:
    good, locked = (
        abs(cook.deflection(cube(2, 24), panel, Elasticity.of(250.0, panel.nu, mixed=False)) / panel.wanted - 1.0)
        for panel in (cook.PANELS[1], cook.PANELS[3])
    )
    assert good < 0.1 < 0.25 < locked


def test_compressibility_floor_moves_results_by_less_than_1e_6(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_SOLVER", "superlu")  # PARDISO's round-off grows with the ratio
    laws = [Elasticity(250.0 / 3, ratio * 250.0 / 3, True) for ratio in (1e7, 1e10)]
    values = [cook.deflection(quadratic(cube(2, 8)), cook.PANELS[4], law) for law in laws]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


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
    np.testing.assert_allclose(s, material.elasticity().stress(e[None])[0], rtol=1e-12, atol=1e-15)


def test_the_pressure_of_the_mixed_form_is_added_to_the_normal_stresses() -> None:
    mesh, law = quadratic(grid((1, 1, 1))), Isotropic(1.0, 0.49).elasticity()
    pressures = np.arange(len(mesh.vertices))
    unknowns = np.concatenate([np.zeros(mesh.points.size), pressures])
    _, sigma = strain_and_stress(mesh, unknowns, [law], 0.25)
    np.testing.assert_array_equal(sigma[mesh.vertices], 0.25 * pressures[:, None, None] * np.eye(3))


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_of_a_quadratic_traction_read_it(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))

    def traction(at: np.ndarray) -> np.ndarray:
        return (1.0 + at[:, :1] ** 2 - 0.5 * at[:, -1:] * (dim == 3)) * np.eye(dim)[1]

    forces = side_load(mesh, "y-", traction)[:, 1]
    boxes = np.array([[[0.1, 0.15], [0.4, 0.3]], [[0.5, 0.55], [0.9, 0.8]]])[:, :, : dim - 1]
    weights = mean_traction_weights(mesh, "y-", boxes)
    total, extent = 0.0, 0.0
    for (low, *_), (high, *_), below, above in zip(*boxes.transpose(1, 0, 2), (0.15, 0.55), (0.3, 0.8), strict=True):
        of_x, z = high - low + (high**3 - low**3) / 3.0, above - below
        of_z = 0.5 * (above**2 - below**2)
        total += of_x if dim == 2 else of_x * z - 0.5 * of_z * (high - low)
        extent += high - low if dim == 2 else (high - low) * z
    # shape functions of the face hold it exactly
    assert weights @ forces == pytest.approx(total / extent, rel=1e-10)


def test_boxes_that_tile_a_face_share_every_force() -> None:
    mesh = quadratic(grid((3, 3, 3), 0.2))
    cuts = np.array([0.0, 0.23, 0.61, 1.0])
    total = np.zeros(len(mesh.points))
    for x0, x1 in itertools.pairwise(cuts):
        for z0, z1 in itertools.pairwise(cuts):
            box = np.array([[[x0, z0], [x1, z1]]])
            total += (x1 - x0) * (z1 - z0) * mean_traction_weights(mesh, "y-", box)
    assert total[np.unique(mesh.facets["y-"])] == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_traction_that_jumps_between_parts_is_not_smeared(dim: int) -> None:
    """Quadratic on the stiffer part and constant on the softer one: both sides are read exactly."""
    mesh = quadratic(grid((4,) * dim, 0.2))
    stiff = mesh.points[mesh.cells[:, : dim + 1]].mean(axis=1)[:, 0] > 0.5
    mesh = replace(mesh, part=stiff.astype(np.int64), part_labels=("stiff",))
    split = replace(mesh, facets=dict(mesh.facets))
    facets = mesh.facets["y-"]
    right = mesh.points[facets[:, :dim]].mean(axis=1)[:, 0] > 0.5
    split.facets.update(left=facets[~right], right=facets[right])
    forces = side_load(split, "left", lambda at: np.full((len(at), 1), 0.3) * np.eye(dim)[1])[:, 1]
    forces += side_load(split, "right", lambda at: (2.0 + at[:, :1] ** 2) * np.eye(dim)[1])[:, 1]
    left, beside = (
        np.array([[[low] + [0.1] * (dim - 2), [high] + [0.8] * (dim - 2)]]) for low, high in ((0.2, 0.5), (0.5, 0.9))
    )
    exact = 2.0 + (0.9**3 - 0.5**3) / 3.0 / 0.4
    for box, mean in ((left, 0.3), (beside, exact)):
        jumping = mean_traction_weights(mesh, "y-", box, moduli=(1.0, 50.0)) @ forces
        assert jumping == pytest.approx(mean, rel=1e-9)
        assert abs(mean_traction_weights(mesh, "y-", box) @ forces / mean - 1.0) > 1e-3
