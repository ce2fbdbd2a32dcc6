"""Meshes of simplices: elements, quadrature, facets, mirror images, quality, location, and bodies of several parts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from finger3d._types import Float
from finger3d.fem.assembly import Pattern, stiffness
from finger3d.fem.hyperelastic import Hyperelastic, TotalLagrangian, nodal_fields
from finger3d.fem.laws import MooneyRivlin, NeoHooke
from finger3d.fem.laws.material import Elasticity, ElasticityByPart, Isotropic, elasticity_of
from finger3d.fem.mesh import (
    EDGES,
    LINE2,
    LINE3,
    TET4,
    TET10,
    TRI3,
    TRI6,
    Element,
    Mesh,
    boundary,
    cell_angles_deg,
    cells_at,
    curved_volume,
    inverse_map,
    locate,
    most_distorted,
    quadratic,
    quadrature,
    signed_volumes,
    unfold,
)
from finger3d.fem.recovery import strain_and_stress
from tests.meshes import full, grid, points_in
from validation._common import product_rule

ELEMENTS = [LINE2, LINE3, TRI3, TRI6, TET4, TET10]


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: e.name)
def test_shape_functions_are_one_at_their_own_node_and_sum_to_one(element: Element) -> None:
    np.testing.assert_allclose(element.shape(element.nodes), np.eye(element.node_count), atol=1e-15)
    np.testing.assert_allclose(element.shape(points_in(element)).sum(axis=1), 1.0)


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: e.name)
def test_gradient_is_the_difference_quotient_of_the_shape_functions(element: Element) -> None:
    bary, h = points_in(element), 1e-6
    for axis in range(element.dim):
        step = np.zeros(element.dim + 1)
        step[[0, axis + 1]] = -h, h
        slope = (element.shape(bary + step) - element.shape(bary - step)) / (2.0 * h)
        np.testing.assert_allclose(element.gradient(bary)[:, :, axis], slope, atol=1e-8)


@pytest.mark.parametrize(
    ("rule", "dim", "degree"),
    [
        *((quadrature, *case) for case in [(1, 2), (1, 6), (2, 2), (2, 5), (3, 2), (3, 3)]),
        *((product_rule, *case) for case in [(1, 6), (2, 6), (3, 6)]),
    ],
)
def test_quadrature_is_exact_to_its_degree(rule: Callable, dim: int, degree: int) -> None:
    bary, w = rule(dim, degree)
    # integral of a power of a barycentric coordinate over the unit simplex
    for power in range(degree + 1):
        wanted = math.factorial(power) / math.factorial(power + dim)
        assert w @ bary[:, 1] ** power == pytest.approx(wanted, rel=1e-13)


TRIANGLE = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), np.array([[0, 1, 2]]), {})
TET = Mesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]), {})


def _labelled(mesh: Mesh) -> Mesh:
    """Facets on x = 0 and z = 0 as symmetry planes, the others as walls."""
    facets = boundary(mesh.cells, mesh.dim)
    at = mesh.points[facets]
    on_x = (at[..., 0] == 0.0).all(axis=1)
    on_z = (at[..., -1] == 0.0).all(axis=1) & ~on_x if mesh.dim == 3 else np.zeros_like(on_x)
    named = {"symmetry_x": facets[on_x], "symmetry_z": facets[on_z], "walls": facets[~on_x & ~on_z]}
    return Mesh(mesh.points, mesh.cells, named)


@pytest.mark.parametrize("mesh", [TRIANGLE, TET], ids=["triangle", "tet"])
def test_boundary_facets_look_outward(mesh: Mesh) -> None:
    facets = mesh.points[boundary(mesh.cells, mesh.dim)]
    assert len(facets) == mesh.dim + 1
    centre = mesh.points.mean(axis=0)
    for f in facets:
        edges = f[1:] - f[:1]
        normal = np.array([edges[0, 1], -edges[0, 0]]) if mesh.dim == 2 else np.cross(*edges)
        assert normal @ (f.mean(axis=0) - centre) > 0.0


@pytest.mark.parametrize("mesh", [TRIANGLE, TET], ids=["triangle", "tet"])
def test_quadratic_puts_nodes_in_the_middle_of_edges_and_facets_share_them(mesh: Mesh) -> None:
    fine = quadratic(_labelled(mesh))
    d = mesh.dim
    middle = fine.points[fine.cells[0, EDGES[d]]].mean(axis=1)
    np.testing.assert_allclose(fine.points[fine.cells[0, d + 1 :]], middle, atol=1e-15)
    for facets in fine.facets.values():
        np.testing.assert_allclose(fine.points[facets[:, d:]], fine.points[facets[:, EDGES[d - 1]]].mean(axis=2))
    assert curved_volume(fine) == pytest.approx(signed_volumes(mesh).sum(), rel=1e-14)
    np.testing.assert_array_equal(fine.vertices, np.arange(d + 1))


@pytest.mark.parametrize(("mesh", "axes"), [(TRIANGLE, (0,)), (TET, (0,)), (TET, (2,)), (TET, (0, 2))])
def test_unfolded_cells_are_positive_and_facets_are_the_whole_boundary(mesh: Mesh, axes: tuple[int, ...]) -> None:
    part = quadratic(_labelled(mesh))
    whole, parent, sign = unfold(part, axes)
    d = mesh.dim
    assert (signed_volumes(whole) > 0.0).all()
    assert signed_volumes(whole).sum() == pytest.approx(2 ** len(axes) * signed_volumes(mesh).sum(), rel=1e-14)
    np.testing.assert_array_equal(whole.points, part.points[parent] * sign)
    outer = {tuple(f) for f in np.sort(boundary(whole.cells[:, : d + 1], d), axis=1).tolist()}
    listed = [tuple(f) for facets in whole.facets.values() for f in np.sort(facets[:, :d], axis=1).tolist()]
    assert len(listed) == len(set(listed))
    assert set(listed) == outer


def test_cell_angles_of_known_cells() -> None:
    corner = np.vstack([np.zeros(3), np.eye(3)])
    assert cell_angles_deg(corner, np.array([[0, 1, 2, 3]]))[0] == pytest.approx(math.degrees(math.acos(3**-0.5)))
    assert cell_angles_deg(corner, np.array([[1, 0, 2, 3]]))[0] == 0.0
    assert cell_angles_deg(corner[:3, :2], np.array([[0, 1, 2]]))[0] == pytest.approx(45.0)


def test_the_most_distorted_cell_is_that_which_loses_most_volume() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [3.0, 3.0]])
    mesh = quadratic(Mesh(points, np.array([[0, 1, 2], [1, 3, 2]]), {}))
    squeezed = np.where(mesh.points[:, :1] + mesh.points[:, 1:] <= 1.0, [[-0.75, 0.0]], 0.0) * mesh.points
    cell, ratio = most_distorted(mesh, squeezed)
    assert cell == 0
    assert ratio == pytest.approx(0.25)
    assert most_distorted(mesh, 0.0 * squeezed)[1] == pytest.approx(1.0)


@pytest.mark.parametrize("element", [TRI3, TRI6, TET4, TET10], ids=lambda e: e.name)
def test_inverse_map_recovers_points_of_a_curved_cell(element: Element) -> None:
    nodes = element.nodes[:, 1:].copy()
    if element.is_quadratic:
        nodes[element.dim + 1 :] += np.random.default_rng(2).uniform(-0.05, 0.05, nodes[element.dim + 1 :].shape)
    bary = points_in(element)
    at = element.shape(bary) @ nodes
    found = inverse_map(element, np.broadcast_to(nodes, (len(at), *nodes.shape)), at)
    np.testing.assert_allclose(found, bary, atol=1e-12)


def test_a_shared_edge_lies_in_two_cells_and_an_outer_point_in_none() -> None:
    square = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([[0, 1, 2], [0, 2, 3]]), {})
    mesh = quadratic(square)
    assert [cell for cell, _ in cells_at(mesh, np.array([0.5, 0.5]))] == [0, 1]
    assert cells_at(mesh, np.array([1.5, 0.5])) == []
    cell, bary = locate(mesh, np.array([[0.75, 0.25], [0.25, 0.75], [1.5, 0.5]]))
    assert cell.tolist() == [0, 1, -1]
    np.testing.assert_allclose(bary[0], [0.25, 0.5, 0.25])


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
