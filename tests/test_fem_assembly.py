"""Elements and assembly: exactness, rates and published values (validation/REFERENCES.md, 5)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse.linalg import splu

from finger3d.fem.assembly import _CELLS_IN_CACHE, stiffness
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh.elements import quadrature
from finger3d.fem.mesh.simplex import Mesh, quadratic
from tests.meshes import body_load, edge_load, error_norms, full, grid, mapped

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


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("degree", [1, 2, 3, 5, 6])
def test_quadrature_integrates_monomials(dim: int, degree: int) -> None:
    # int x^p over the unit simplex = p! / (p + dim)!
    from math import factorial

    bary, w = quadrature(dim, degree)
    for power in range(degree + 1):
        want = factorial(power) / factorial(power + dim)
        assert np.sum(w * bary[:, 1] ** power) == pytest.approx(want, rel=1e-13)


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


def cook(n: int, elastic: Elasticity, force: float) -> float:
    def shape(p: np.ndarray) -> np.ndarray:
        x, t = 48 * p[:, 0], p[:, 1]
        return np.stack([x, 44 * p[:, 0] + t * (44 - 28 * p[:, 0])], axis=1)

    mesh = mapped(grid((n, n)), shape)
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
    mesh_error = []
    for nu, want in ((0.3, 8.778), (0.4999, 7.403)):
        p = grid((24, 24))
        x, t = 48 * p.points[:, 0], p.points[:, 1]
        mesh = Mesh(np.stack([x, 44 * p.points[:, 0] + t * (44 - 28 * p.points[:, 0])], axis=1), p.cells, p.facets)
        load = edge_load(mesh, "x+", lambda q: np.tile([0.0, 100.0 / 16.0], (len(q), 1)))
        u = solve(
            mesh, Elasticity.of(250.0, nu, mixed=False), load, on_boundary(mesh, "x-"), np.zeros_like(mesh.points)
        )
        at = np.argmin(np.linalg.norm(mesh.points - [48.0, 52.0], axis=1))
        mesh_error.append(abs(u[at, 1] / want - 1))
    assert mesh_error[0] < 0.1 < 0.25 < mesh_error[1]


def test_compressibility_floor_moves_results_by_less_than_1e_6() -> None:
    values = [cook(8, Elasticity(250.0 / 3, lame, True), 100.0) for lame in (250 / 3 * 1e7, 250 / 3 * 1e10)]
    assert values[0] == pytest.approx(values[1], rel=1e-6)
