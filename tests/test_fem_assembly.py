"""Tensors, stiffness and recovered fields: exactness, rates and published values (validation/REFERENCES.md, 5)."""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from finger3d.errors import Finger3dError
from finger3d.fem.assembly import _CELLS_IN_CACHE, stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.fem.recovery.reactions import mean_traction_weights
from finger3d.fem.recovery.recover import extrapolated, nodal_pressure, nodal_strain, strain_and_stress
from finger3d.fem.tensors import bases_of, cofactor, determinant, rotated_delassus
from finger3d.objects import vertical_frame
from tests.contact_cases import random_compliance
from tests.meshes import body_load, edge_load, error_norms, full, grid, mapped


def test_they_are_those_of_linear_algebra_singular_tensors_included() -> None:
    f = np.random.default_rng(0).normal(size=(5, 4, 3, 3))
    assert np.allclose(determinant(f), np.linalg.det(f), rtol=1e-12)
    j = np.linalg.det(f)[..., None, None]
    assert np.allclose(cofactor(f), j * np.swapaxes(np.linalg.inv(f), -1, -2), rtol=1e-9)
    # a projection on a plane has no inverse; its cofactor projects on the normal
    assert np.array_equal(cofactor(np.diag([1.0, 1.0, 0.0])), np.diag([0.0, 0.0, 1.0]))


def unit_vectors(dim: int) -> np.ndarray:
    vectors = np.random.default_rng(1).normal(size=(50, dim))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("dim", [2, 3])
def test_bases_are_orthonormal_and_begin_with_the_normal(dim: int) -> None:
    normal = np.vstack([unit_vectors(dim), np.eye(dim)[1], -np.eye(dim)[1]])
    bases = bases_of(normal)
    assert np.array_equal(bases[:, 0], normal)
    assert np.allclose(bases @ np.swapaxes(bases, 1, 2), np.eye(dim), atol=1e-12)
    assert np.allclose(bases[-1], vertical_frame(dim))
    # a rotation of the upright frame, not a reflection
    assert np.allclose(np.linalg.det(bases), np.linalg.det(vertical_frame(dim)))


def test_a_basis_is_turned_about_the_axis_across_both_normals() -> None:
    normal = unit_vectors(3)
    rotation = np.swapaxes(vertical_frame(3).T @ bases_of(normal), 1, 2)
    axis = np.cross([0.0, -1.0, 0.0], normal)
    assert np.allclose(np.einsum("cij,cj->ci", rotation, axis), axis, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_turned_compliance_is_that_of_turned_vectors(dim: int) -> None:
    rng = np.random.default_rng(0)
    compliance = random_compliance(rng, 5, dim)
    turn = np.linalg.qr(rng.normal(size=(5, dim, dim)))[0]
    force = rng.normal(size=(5, dim))
    plain = np.einsum("idjk,jk->id", compliance, np.einsum("cki,ck->ci", turn, force))
    assert np.einsum("idjk,jk->id", rotated_delassus(compliance, turn), force) == pytest.approx(
        np.einsum("cik,ck->ci", turn, plain), rel=1e-10
    )
    assert rotated_delassus(compliance, np.tile(np.eye(dim), (5, 1, 1))) is compliance
    some = np.array([3, 0])
    of_some = rotated_delassus(compliance, turn[some], some)
    assert of_some == pytest.approx(rotated_delassus(compliance, turn)[np.ix_(some, range(dim), some, range(dim))])


PI = np.pi


def solve(mesh: Mesh, elastic: Elasticity, load: np.ndarray, held: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Displacements (n, d) with nodal values `value` (n, d) prescribed where `held` (n, d)."""
    system = full(stiffness(mesh, elastic).upper)
    known = np.zeros(system.shape[0], dtype=bool)
    known[: held.size] = held.ravel()
    x = np.zeros(system.shape[0])
    x[: held.size] = np.where(held, value, 0.0).ravel()
    right = np.zeros(system.shape[0])
    right[: load.size] = load.ravel()
    right -= system @ x
    free = np.flatnonzero(~known)
    x[free] = splu(system[free][:, free].tocsc()).solve(right[free])
    return x[: held.size].reshape(mesh.points.shape)


def on_boundary(mesh: Mesh, labels: str | None = None) -> np.ndarray:
    nodes = np.unique(np.concatenate([f.ravel() for k, f in mesh.facets.items() if labels is None or k in labels]))
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[nodes] = True
    return held


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
@pytest.mark.parametrize("mixed", [False, True])
def test_other_numbers_of_the_nodes_give_the_same_matrix_in_another_order(dim: int, mixed: bool) -> None:
    mesh = mapped(grid((20, 8) if dim == 2 else (5, 3, 4), 0.2), lambda x: x + 0.05 * np.sin(2 * x[:, ::-1]))
    assert len(mesh.cells) > _CELLS_IN_CACHE
    n, elastic = len(mesh.points), Elasticity.of(1.0, 0.3, mixed=mixed)
    to = np.random.default_rng(0).permutation(n)
    turned = Mesh(mesh.points[np.argsort(to)], to[mesh.cells], {})
    one, other = stiffness(mesh, elastic), stiffness(turned, elastic)
    upper = one.upper
    assert upper.has_canonical_format
    assert (upper.indices[upper.indptr[:-1]] == np.arange(upper.shape[0])).all()  # upper triangle, diagonal stored
    order = (to[:, None] * dim + np.arange(dim)).ravel()
    if mixed:
        number = np.searchsorted(other.pressure_vertices, to[one.pressure_vertices])
        order = np.concatenate([order, n * dim + number])
    difference = full(other.upper)[order][:, order] - full(upper)
    assert upper.nnz == other.upper.nnz
    assert abs(difference).max() < 1e-14 * abs(upper).max()  # sums in another order


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("nu", "mixed"), [(0.3, False), (0.3, True), (0.4999, True)])
def test_patch_of_irregular_cells_holds_a_linear_field(dim: int, nu: float, mixed: bool) -> None:
    mesh = quadratic(grid((3,) * dim, 0.25, seed=1))
    slope = np.random.default_rng(0).normal(size=(dim, dim))
    exact = mesh.points @ slope.T
    u = solve(mesh, Elasticity.of(1.0, nu, mixed=mixed), np.zeros_like(exact), on_boundary(mesh), exact)
    assert np.abs(u - exact).max() < 1e-12 * (1e3 if nu > 0.49 else 1.0)  # conditioning grows as 1 / (1 - 2 nu)


def test_quadratic_field_is_exact_on_straight_tet10() -> None:
    mesh = quadratic(grid((2, 2, 2), 0.2))
    elastic = Elasticity.of(1.0, 0.3)
    x, y, z = mesh.points.T
    exact = np.stack([x**2 + y * z, y**2 - x * z, z**2 + x * y], axis=1)
    b = -(4 * elastic.shear + 2 * elastic.lame)
    load = body_load(mesh, lambda p: np.full_like(p, b))
    assert np.abs(solve(mesh, elastic, load, on_boundary(mesh), exact) - exact).max() < 1e-12


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_manufactured_solution_converges_at_the_rates_of_quadratic_elements(nu: float) -> None:
    # u = (sin py sin pz, sin pz sin px, sin px sin py) is solenoidal, so b = 2 p^2 G u for every nu
    def exact(p: np.ndarray) -> np.ndarray:
        s = np.sin(PI * p)
        return np.stack([s[:, 1] * s[:, 2], s[:, 2] * s[:, 0], s[:, 0] * s[:, 1]], axis=1)

    def slope(p: np.ndarray) -> np.ndarray:
        s, c = np.sin(PI * p), PI * np.cos(PI * p)
        out = np.zeros((len(p), 3, 3))
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            out[:, i, j], out[:, i, k] = c[:, j] * s[:, k], s[:, j] * c[:, k]
        return out

    elastic = Elasticity.of(1.0, nu)
    errors = []
    for n in (3, 6):
        mesh = quadratic(grid((n, n, n)))
        load = body_load(mesh, lambda p: 2 * PI**2 * elastic.shear * exact(p))
        errors.append(
            error_norms(mesh, solve(mesh, elastic, load, on_boundary(mesh), exact(mesh.points)), exact, slope)
        )
    rate_l2, rate_h1 = np.log2(np.array(errors[0]) / np.array(errors[1]))
    assert rate_l2 > 2.7
    assert rate_h1 > 1.8


def cook(n: int, elastic: Elasticity, force: float, order: int = 2) -> float:
    def shape(p: np.ndarray) -> np.ndarray:
        x, t = 48 * p[:, 0], p[:, 1]
        return np.stack([x, 44 * p[:, 0] + t * (44 - 28 * p[:, 0])], axis=1)

    linear = grid((n, n))
    mesh = mapped(linear, shape) if order == 2 else replace(linear, points=shape(linear.points))
    load = edge_load(mesh, "x+", lambda p: np.tile([0.0, force / 16.0], (len(p), 1)))
    held = on_boundary(mesh, "x-")
    u = solve(mesh, elastic, load, held, np.zeros_like(mesh.points))
    at = np.argmin(np.linalg.norm(mesh.points - [48.0, 52.0], axis=1))
    return float(u[at, 1])


@pytest.mark.parametrize(
    ("elastic", "force", "want"),
    [
        (Elasticity.of(1.0, 1 / 3, plane_stress=True), 1.0, 23.967),
        (Elasticity.of(250.0, 0.3), 100.0, 8.778),
        (Elasticity.of(250.0, 0.49), 100.0, 7.493),
        (Elasticity.of(250.0, 0.4999), 100.0, 7.403),
        (Elasticity.of(250.0, 0.5), 100.0, 7.4025),
    ],
    ids=["stress", "0.3", "0.49", "0.4999", "0.5"],
)
def test_cook_membrane(elastic: Elasticity, force: float, want: float) -> None:
    # validation/REFERENCES.md, 5.4.  The clamped corner governs: error ~ h^1.1 to h^1.3; extrapolated as seen
    a, b, c = (cook(n, elastic, force) for n in (12, 24, 48))
    ratio = (c - b) / (b - a)
    assert 0.35 < ratio < 0.5
    assert c + (c - b) * ratio / (1 - ratio) == pytest.approx(want, rel=1.5e-3)


def test_linear_triangles_fail_cook_at_near_incompressibility() -> None:
    good, locked = (
        abs(cook(24, Elasticity.of(250.0, nu, mixed=False), 100.0, order=1) / want - 1)
        for nu, want in ((0.3, 8.778), (0.4999, 7.403))
    )
    assert good < 0.1 < 0.25 < locked


def test_compressibility_floor_moves_results_by_less_than_1e_6() -> None:
    values = [cook(8, Elasticity(250.0 / 3, lame, True), 100.0) for lame in (250 / 3 * 1e7, 250 / 3 * 1e10)]
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

    forces = edge_load(mesh, "y-", traction)[:, 1]
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
    forces = edge_load(split, "left", lambda at: np.full((len(at), 1), 0.3) * np.eye(dim)[1])[:, 1]
    forces += edge_load(split, "right", lambda at: (2.0 + at[:, :1] ** 2) * np.eye(dim)[1])[:, 1]
    left, beside = (
        np.array([[[low] + [0.1] * (dim - 2), [high] + [0.8] * (dim - 2)]]) for low, high in ((0.2, 0.5), (0.5, 0.9))
    )
    exact = 2.0 + (0.9**3 - 0.5**3) / 3.0 / 0.4
    for box, mean in ((left, 0.3), (beside, exact)):
        jumping = mean_traction_weights(mesh, "y-", box, moduli=(1.0, 50.0)) @ forces
        assert jumping == pytest.approx(mean, rel=1e-9)
        assert abs(mean_traction_weights(mesh, "y-", box) @ forces / mean - 1.0) > 1e-3


def test_a_box_beside_the_face_is_refused() -> None:
    with pytest.raises(Finger3dError, match="40 % of it is not on the face y-"):
        mean_traction_weights(quadratic(grid((2, 2))), "y-", np.array([[[0.7], [1.2]]]))
