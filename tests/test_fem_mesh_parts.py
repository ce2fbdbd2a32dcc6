"""Bodies of several parts: patch tests across an interface, equal parts, laws by part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from finger3d._types import Float
from finger3d.fem.assembly import Pattern, stiffness
from finger3d.fem.laws import MooneyRivlin, NeoHooke
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh.parts import ElasticityByPart, elasticity_of
from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.fem.recovery.recover import strain_and_stress
from finger3d.fem.solids.deformed import nodal_fields
from finger3d.fem.solids.hyperelastic import Hyperelastic, TotalLagrangian
from tests.meshes import full, grid

SOFT, STIFF = Isotropic(1.0, 0.3), Isotropic(7.0, 0.1)


def layered(dim: int, counts: int = 4) -> Mesh:
    """A unit square or cube whose upper half is another part; its interface is flat, its other nodes are moved."""
    mesh = grid((counts,) * dim, 0.15)
    points = mesh.points.copy()
    rest = grid((counts,) * dim).points
    points[rest[:, 1] == 0.5, 1] = 0.5
    above = (rest[mesh.cells, 1].mean(axis=1) > 0.5).astype(np.int64)
    return quadratic(replace(mesh, points=points, part=above, part_labels=("upper",)))


def compressed(mesh: Mesh, materials: tuple[Isotropic, Isotropic], squeeze: float) -> tuple[Float, Float]:
    """Unknowns and pressure scale of a body between frictionless walls, its top moved down."""
    law = elasticity_of(materials, mesh, False)
    matrix = stiffness(mesh, law)
    n, d = mesh.points.shape
    whole = full(matrix.upper)
    held, values = [], []
    for axis in range(d):
        for side in (0.0, 1.0):
            nodes = np.flatnonzero(mesh.points[:, axis] == side)
            held.append(nodes * d + axis)
            values.append(np.full(len(nodes), -squeeze if (axis, side) == (1, 1.0) else 0.0))
    fixed, moved = np.concatenate(held), np.concatenate(values)
    free = np.setdiff1d(np.arange(whole.shape[0]), fixed)
    x = np.zeros(whole.shape[0])
    x[fixed] = moved
    x[free] = spsolve(sp.csc_matrix(whole[free][:, free]), -(whole[free][:, fixed] @ moved))
    return x, matrix.pressure_scale


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("nus", [(0.3, 0.1), (0.49, 0.2), (0.499, 0.0)], ids=["displacement", "mixed", "mixed, nu = 0"])
def test_uniaxial_strain_of_two_layers_is_exact(dim: int, nus: tuple[float, float]) -> None:
    # The bimaterial patch test: layers in series, sigma = M1 e1 = M2 e2 with M = lambda + 2 G, (e1 + e2) / 2 = squeeze.
    mesh, materials = layered(dim), (Isotropic(1.0, nus[0]), Isotropic(7.0, nus[1]))
    moduli = np.array([m.E_MPa * (1.0 - m.nu) / (1.0 + m.nu) / (1.0 - 2.0 * m.nu) for m in materials])
    stress = -2.0 * 0.01 / (1.0 / moduli).sum()
    x, scale = compressed(mesh, materials, 0.01)
    u = x[: mesh.points.size].reshape(mesh.points.shape)
    y = mesh.points[:, 1]
    exact = stress * np.where(y <= 0.5, y / moduli[0], 0.5 / moduli[0] + (y - 0.5) / moduli[1])
    tolerance = 1e-9 if nus[1] else 1e-7  # LARGEST_COMPRESSIBILITY stands for nu = 0
    np.testing.assert_allclose(u[:, 1], exact, atol=tolerance * 0.01)
    laws = [m.elasticity(mixed=max(nus) >= 0.48) for m in materials]
    _, sigma = strain_and_stress(mesh, x, laws, scale)
    np.testing.assert_allclose(sigma[:, 1, 1], stress, rtol=1e-6)


@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_equal_parts_are_one_body(nu: float) -> None:
    mesh = layered(2)
    plain = replace(mesh, part=None, part_labels=())
    two, one = (stiffness(m, elasticity_of((Isotropic(2.0, nu),) * 2, m, False)) for m in (mesh, plain))
    # The pressures of the two parts are unknowns of their own at the interface; their sum acts as those of one body.
    vertices, _ = mesh.part_corners
    n = mesh.points.size
    columns = n + np.searchsorted(plain.vertices, vertices) if nu >= 0.48 else np.zeros(0, dtype=int)
    join = sp.csr_matrix((np.ones(n + len(columns)), (np.arange(n + len(columns)), np.r_[:n, columns])))
    difference = join.T @ full(two.upper) @ join - full(one.upper)
    assert abs(difference).max() < 1e-14 * abs(one.upper).max()


def test_a_law_of_some_cells_is_that_of_their_part() -> None:
    laws = (SOFT.elasticity(), STIFF.elasticity())
    law = ElasticityByPart(laws, np.array([0, 1, 1, 0]))
    assert law.of_cells(slice(1, 3)) is laws[1]
    strain = np.random.default_rng(0).normal(size=(8, 3, 3))  # two in each cell
    stress = law.stress(strain)
    np.testing.assert_array_equal(stress[:2], laws[0].stress(strain[:2]))
    np.testing.assert_array_equal(stress[2:6], laws[1].stress(strain[2:6]))


@pytest.mark.parametrize(
    ("dim", "nu", "plane_stress"), [(2, 0.3, False), (2, 0.49, False), (2, 0.5, True), (3, 0.49, False)]
)
def test_tangent_of_hyperelastic_parts_is_the_derivative_of_their_forces(
    dim: int, nu: float, plane_stress: bool
) -> None:
    mesh = layered(dim, 2)
    materials = (Isotropic(1.0, nu), STIFF)
    part = np.repeat(mesh.part, dim + 1)
    material = Hyperelastic.of_parts(MooneyRivlin(1.0, 0.3), materials, part, plane_stress)
    solid = TotalLagrangian(mesh, material, 2.0, Pattern.of(mesh, material.mixed))
    rng = np.random.default_rng(1)
    size = mesh.points.size + len(solid.pattern.vertices)
    x, direction = 0.01 * rng.normal(size=size), rng.normal(size=size)
    ahead, behind = (solid.internal_forces(x + h * direction) for h in (1e-6, -1e-6))
    want = (ahead - behind) / 2e-6
    assert np.abs(full(solid.tangent(x).upper) @ direction - want).max() < 1e-6 * np.abs(want).max()


def test_small_strain_limit_of_hyperelastic_parts_is_the_linear_law_of_each() -> None:
    mesh = layered(2, 2)
    material = Hyperelastic.of_parts(NeoHooke(1.0), (SOFT, STIFF), np.repeat(mesh.part, 3))
    solid = TotalLagrangian(mesh, material, 1.0, Pattern.of(mesh, False))
    laws = tuple(Elasticity.of(m.E_MPa, m.nu) for m in (SOFT, STIFF))
    linear = stiffness(mesh, ElasticityByPart(laws, mesh.part))
    tangent = solid.tangent(np.zeros(mesh.points.size)).upper
    assert abs(tangent - linear.upper).max() < 1e-12 * abs(linear.upper).max()
    x = 1e-7 * (mesh.points * [1.0, -2.0]).ravel()
    _, _, cauchy = nodal_fields(solid, x)
    _, sigma = strain_and_stress(mesh, x, laws, 1.0)
    np.testing.assert_allclose(cauchy[:, :2, :2], sigma, atol=1e-5 * np.abs(sigma).max())
