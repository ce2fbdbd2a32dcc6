"""Neo-Hookean law: closed forms (validation/REFERENCES.md, 5.7), tangent = finite difference, small-strain limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from finger3d.fem.assembly import Pattern, stiffness
from finger3d.fem.material import Elasticity
from finger3d.fem.neo_hooke import InvertedError, NeoHooke, assemble, cell_response, first_piola_and_tangent
from finger3d.fem.simplex import quadratic
from tests.meshes import edge_load, grid, mapped


def full(upper: sp.csr_matrix) -> sp.csr_matrix:
    return (upper + sp.triu(upper, 1).T).tocsr()


@pytest.mark.parametrize("mixed", [False, True])
def test_tangent_is_the_derivative_of_the_stress(mixed: bool) -> None:
    rng = np.random.default_rng(0)
    law = NeoHooke(1.3, 7.0, mixed)
    f = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    p = np.array(0.4) if mixed else None
    tangent = first_piola_and_tangent(law, f, p)[1]
    for k in range(3):
        for m in range(3):
            step = np.zeros((3, 3))
            step[k, m] = 1e-6
            slope = (first_piola_and_tangent(law, f + step, p)[0] - first_piola_and_tangent(law, f - step, p)[0]) / 2e-6
            assert np.abs(slope - tangent[:, :, k, m]).max() < 1e-7


@pytest.mark.parametrize(
    ("dim", "nu", "stress"), [(2, 0.3, False), (2, 0.45, True), (2, 0.5, False), (3, 0.3, False), (3, 0.5, False)]
)
def test_assembled_tangent_is_the_derivative_of_the_internal_forces(dim: int, nu: float, stress: bool) -> None:
    mesh = mapped(grid((2,) * dim, 0.15), lambda x: x + 0.03 * np.sin(3 * x[:, ::-1]))
    law = NeoHooke.of(1.0, nu, stress)
    pattern = Pattern.of(mesh, law.mixed)
    rng = np.random.default_rng(1)
    size = assemble(mesh, law, np.zeros(mesh.points.size + (len(mesh.vertices) if law.mixed else 0)), pattern)[1].size
    x = 0.03 * rng.normal(size=size)
    tangent, _ = assemble(mesh, law, x, pattern, 2.0)
    direction = rng.normal(size=size)
    ahead, behind = (assemble(mesh, law, x + h * direction, pattern, 2.0)[1] for h in (1e-6, -1e-6))
    want = (ahead - behind) / 2e-6
    assert np.abs(full(tangent.upper) @ direction - want).max() < 1e-6 * np.abs(want).max()


@pytest.mark.parametrize(("dim", "nu", "stress"), [(2, 0.3, False), (2, 0.3, True), (3, 0.45, False)])
def test_tangent_at_rest_is_the_linear_stiffness(dim: int, nu: float, stress: bool) -> None:
    mesh = quadratic(grid((2,) * dim, 0.2))
    tangent, force = assemble(mesh, NeoHooke.of(1.0, nu, stress), np.zeros(mesh.points.size), Pattern.of(mesh, False))
    linear = stiffness(mesh, Elasticity.of(1.0, nu, stress))
    assert np.abs((tangent.upper - linear.upper).data).max() < 1e-12
    assert not force.any()


@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.5])
def test_incompressible_closed_forms(stretch: float) -> None:
    g, law = 0.7, NeoHooke(0.7, 1e9, True)
    # uniaxial: nominal stress G (l - l^-2), the pressure set so that the sides are free
    f = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    free = first_piola_and_tangent(law, f, np.array(0.0))[0]
    p = -free[1, 1] * f[1, 1]
    assert first_piola_and_tangent(law, f, np.array(p))[0][0, 0] == pytest.approx(
        g * (stretch - stretch**-2), rel=1e-12
    )
    # equibiaxial: G (l - l^-5)
    f = np.diag([stretch, stretch, stretch**-2])
    p = -first_piola_and_tangent(law, f, np.array(0.0))[0][2, 2] * f[2, 2]
    assert first_piola_and_tangent(law, f, np.array(p))[0][0, 0] == pytest.approx(
        g * (stretch - stretch**-5), rel=1e-12
    )
    # simple shear: s12 = G g, s11 - s22 = G g^2
    f = np.eye(3)
    f[0, 1] = stretch
    cauchy = first_piola_and_tangent(law, f, np.array(0.0))[0] @ f.T
    assert cauchy[0, 1] == pytest.approx(g * stretch, rel=1e-12)
    assert cauchy[0, 0] - cauchy[1, 1] == pytest.approx(g * stretch**2, rel=1e-12)


def test_plane_stress_has_no_stress_across_the_section() -> None:
    law = NeoHooke.of(1.0, 0.5, plane_stress=True)
    slope = np.array([[[0.8, 0.0], [0.0, 1.8**-0.5 - 1.0]]])  # uniaxial, incompressible
    stress, _, _, j = cell_response(law, slope, None)
    assert j[0] == pytest.approx(1.0, abs=1e-6)
    assert stress[0, 0, 0] == pytest.approx(law.shear * (1.8 - 1.8**-2), rel=1e-6)
    assert abs(stress[0, 1, 1]) < 1e-6


def test_plane_stress_of_an_incompressible_body_keeps_its_digits() -> None:
    # at strains e of 1e-6 the neo-Hookean stress is the linear one, 4 G e for uniaxial strain, to a few e; with
    # K (J - 1) at K = 1e7 G, round-off alone would be 1e-16 K / (4 G e) = 2e-4 of it
    law, strain = NeoHooke.of(1.0, 0.5, plane_stress=True), 1e-6
    slopes = np.zeros((50, 1, 2, 2))
    slopes[:, 0, 0, 0] = strain * np.linspace(0.5, 1.5, 50)
    stress = cell_response(law, slopes, None)[0][:, 0, 0, 0]
    assert np.abs(stress / (4.0 * law.shear * slopes[:, 0, 0, 0]) - 1.0).max() < 1e-5


def test_inverted_cells_are_an_error() -> None:
    mesh = quadratic(grid((1, 1, 1)))
    with pytest.raises(InvertedError):
        assemble(mesh, NeoHooke.of(1.0, 0.3), -2.0 * mesh.points.ravel(), Pattern.of(mesh, False))


def test_thick_sphere_under_pressure() -> None:
    # p = G [F(l_b) - F(l_a)], F = (4 l^3 + 1) / (2 l^4), l_b^3 = 1 + (A/B)^3 (l_a^3 - 1), with A = 1, B = 2, G = 1
    inner, outer, stretch = 1.0, 2.0, 1.5

    def shell(q: np.ndarray) -> np.ndarray:  # a sixth of the sphere: what is seen through one face of a cube
        a, b = np.tan(np.pi / 4 * (2.0 * q[:, 1:] - 1.0)).T
        direction = np.stack([np.ones_like(a), a, b], axis=1)
        r = inner + (outer - inner) * q[:, 0]
        return r[:, None] * direction / np.linalg.norm(direction, axis=1)[:, None]

    def f(x: float) -> float:
        return (4 * x**3 + 1) / (2 * x**4)

    want = f(stretch) - f((1 + (inner / outer) ** 3 * (stretch**3 - 1)) ** (1 / 3))
    mesh = mapped(grid((6, 4, 4)), shell)
    law, pattern, n = NeoHooke(1.0, 1e7, True), Pattern.of(mesh, True), mesh.points.size
    radius = np.linalg.norm(mesh.points, axis=1)
    moved_to = (radius**3 + inner**3 * (stretch**3 - 1)) ** (1 / 3)
    exact = mesh.points * (moved_to / radius - 1.0)[:, None]
    held = np.zeros(n + len(mesh.vertices), dtype=bool)
    for label, facets in mesh.facets.items():
        if label != "x-":  # all but the cavity move as the closed form says
            held[:n].reshape(-1, 3)[np.unique(facets)] = True
    x = np.concatenate([exact.ravel(), np.zeros(len(mesh.vertices))])
    free = np.flatnonzero(~held)
    # the cavity carries pressure -p n over its deformed area, a dead load at the exact motion: cof(F) N dA
    cavity = replace(mesh, points=mesh.points + exact)
    area = edge_load(cavity, "x-", lambda p: p / np.linalg.norm(p, axis=1)[:, None])
    load = np.concatenate([want * area.ravel(), np.zeros(len(mesh.vertices))])
    for _ in range(12):
        tangent, force = assemble(mesh, law, x, pattern)
        step = splu(full(tangent.upper)[free][:, free].tocsc()).solve((load - force)[free])
        x[free] += step
    assert np.abs(step).max() < 1e-9
    sides = np.unique(np.concatenate([mesh.facets[k].ravel() for k in ("y-", "y+", "z-", "z+")]))
    inside = np.setdiff1d(np.unique(mesh.facets["x-"]), sides)
    got = np.linalg.norm(mesh.points[inside] + x[:n].reshape(-1, 3)[inside], axis=1) / inner
    assert np.abs(got / stretch - 1.0).max() < 5e-3
