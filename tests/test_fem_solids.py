"""Solids at finite strain, stiff parts, bars and foils."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.integrate import dblquad, quad
from scipy.sparse.linalg import splu

from finger3d._types import Float
from finger3d.fem.assembly import Pattern, stiffness
from finger3d.fem.embedded import BarRelaxation, Bars, InfiniteBody
from finger3d.fem.hyperelastic import Hyperelastic, Relaxing, TotalLagrangian, stretch
from finger3d.fem.laws import IsochoricLaw, MooneyRivlin, NeoHooke, Ogden
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.fem.tensors import determinant
from tests.energies import energy_of_body
from tests.meshes import full, grid
from validation._common import mapped, side_load

LAW = MooneyRivlin(0.4, 0.3)
CASES = [(2, 0.3, False), (2, 0.45, True), (2, 0.5, True), (2, 0.5, False), (3, 0.3, False), (3, 0.5, False)]


def body(mesh: Mesh, nu: float, plane_stress: bool = False, law: IsochoricLaw = LAW) -> TotalLagrangian:
    material = Hyperelastic.of(law, nu, plane_stress)
    return TotalLagrangian(mesh, material, 2.0, Pattern.of(mesh, material.mixed))


def unknowns(solid: TotalLagrangian) -> int:
    return solid.mesh.points.size + len(solid.pattern.vertices)


def relaxing(solid: TotalLagrangian, rng: np.random.Generator) -> Relaxing:
    past = 0.02 * rng.normal(size=(len(solid.slopes(np.zeros(unknowns(solid)))), 3, 3))
    return Relaxing(0.7, 0.8, past + np.swapaxes(past, 1, 2))


@pytest.mark.parametrize(("dim", "nu", "plane_stress"), CASES)
def test_tangent_is_the_derivative_of_the_internal_forces(dim: int, nu: float, plane_stress: bool) -> None:
    mesh = mapped(grid((2,) * dim, 0.15), lambda x: x + 0.03 * np.sin(3 * x[:, ::-1]))
    rng, solid = np.random.default_rng(1), body(mesh, nu, plane_stress)
    past = relaxing(solid, rng)
    x = 0.015 * rng.normal(size=unknowns(solid))
    direction = rng.normal(size=len(x))
    ahead, behind = (solid.internal_forces(x + h * direction, past) for h in (1e-6, -1e-6))
    want = (ahead - behind) / 2e-6
    assert np.abs(full(solid.tangent(x, past).upper) @ direction - want).max() < 1e-6 * np.abs(want).max()


@pytest.mark.parametrize(("dim", "nu", "plane_stress"), CASES)
def test_tangent_at_rest_is_the_linear_stiffness(dim: int, nu: float, plane_stress: bool) -> None:
    mesh = quadratic(grid((2,) * dim, 0.2))
    solid = body(mesh, nu, plane_stress, NeoHooke(0.5 / (1.0 + nu)))
    rest = np.zeros(unknowns(solid))
    linear = stiffness(mesh, Elasticity.of(1.0, nu, plane_stress), 2.0)
    if not solid.material.mixed:  # the pressure is that of the bulk modulus here, of Lame's first constant there
        assert np.abs((solid.tangent(rest).upper - linear.upper).data).max() < 1e-6 * np.abs(linear.upper.data).max()
    assert np.abs(solid.internal_forces(rest)).max() < 1e-15


def test_plane_stress_has_no_stress_across_the_section() -> None:
    material = Hyperelastic.of(NeoHooke(0.7), 0.5, plane_stress=True)
    f = material.deformation(np.array([[0.8, 0.0], [0.0, 1.8**-0.5 - 1.0]]))  # uniaxial, incompressible
    stress = material.stress(f, None)
    assert np.linalg.det(f) == pytest.approx(1.0, abs=1e-6)
    assert stress[0, 0] == pytest.approx(0.7 * (1.8 - 1.8**-2), rel=1e-6)
    assert abs(stress[1, 1]) < 1e-6
    assert abs(stress[2, 2]) < 1e-15


def test_plane_stress_of_an_incompressible_body_keeps_its_digits() -> None:
    # at strains e of 1e-6 the neo-Hookean stress is the linear one, 4 G e for uniaxial strain, to a few e; with
    # K (J - 1) at K = 1e7 G, round-off alone would be 1e-16 K / (4 G e) = 2e-4 of it
    material, strain = Hyperelastic.of(NeoHooke(0.7), 0.5, plane_stress=True), 1e-6
    slopes = np.zeros((50, 2, 2))
    slopes[:, 0, 0] = strain * np.linspace(0.5, 1.5, 50)
    stress = material.stress(material.deformation(slopes), None)[:, 0, 0]
    assert np.abs(stress / (4.0 * 0.7 * slopes[:, 0, 0]) - 1.0).max() < 1e-5


def test_a_relaxing_stress_is_that_of_its_parts() -> None:
    # without a past, factors of 1 are elasticity; the second Piola-Kirchhoff stress of the past is subtracted
    solid, rng = body(mapped(grid((2, 2, 2), 0.1), lambda x: x), 0.5), np.random.default_rng(3)
    x = 0.02 * rng.normal(size=unknowns(solid))
    points = len(solid.slopes(x))
    elastic = solid.internal_forces(x)
    none = Relaxing(1.0, 1.0, np.zeros((points, 3, 3)))
    assert np.abs(solid.internal_forces(x, none) - elastic).max() < 1e-15
    # at once all of the elastic stress has relaxed: nothing is left of the forces on the nodes
    gone = Relaxing(1.0, 1.0, solid.elastic_stress(x, None, volumetric=True))
    size = solid.mesh.points.size
    assert np.abs(solid.internal_forces(x, gone)[:size]).max() < 1e-15
    assert np.abs(elastic[:size]).max() > 1e-3


@pytest.mark.parametrize(("dim", "nu"), [(2, 0.3), (2, 0.5), (3, 0.3), (3, 0.49)])
def test_patch_at_finite_strain(dim: int, nu: float) -> None:
    # on a distorted mesh of straight edges, a homogeneous deformation given at the boundary is found inside; from
    # nu = 0.49 on one that keeps the volume
    rng = np.random.default_rng(5)
    mesh = quadratic(grid((3,) * dim, 0.2))
    solid = body(mesh, nu)
    f = np.eye(dim) + 0.15 * rng.normal(size=(dim, dim))
    f *= (1.0 if nu >= 0.49 else 1.2) / abs(np.linalg.det(f)) ** (1.0 / dim)
    exact = mesh.points @ (f - np.eye(dim)).T
    boundary = np.unique(np.concatenate([facets.ravel() for facets in mesh.facets.values()]))
    held = np.zeros(unknowns(solid), dtype=bool)
    held[: mesh.points.size].reshape(-1, dim)[boundary] = True
    free = np.flatnonzero(~held)
    x = np.concatenate([exact.ravel(), np.zeros(unknowns(solid) - mesh.points.size)])
    x[free[free < mesh.points.size]] += 0.005 * rng.normal(size=np.count_nonzero(free < mesh.points.size))
    for _ in range(20):
        step = splu(full(solid.tangent(x).upper)[free][:, free].tocsc()).solve(-solid.internal_forces(x)[free])
        x[free] += step
    assert np.abs(x[: mesh.points.size] - exact.ravel()).max() < 1e-10


@pytest.mark.parametrize("dim", [2, 3])
def test_internal_forces_turn_with_a_superposed_rotation(dim: int) -> None:
    mesh = mapped(grid((2,) * dim, 0.1), lambda x: x)
    rng, solid = np.random.default_rng(6), body(mesh, 0.49)
    turn = np.linalg.qr(rng.normal(size=(dim, dim)))[0]
    turn[0] *= np.linalg.det(turn)
    x = 0.02 * rng.normal(size=unknowns(solid))
    size = mesh.points.size
    u = x[:size].reshape(-1, dim)
    turned = x.copy()
    turned[:size] = ((mesh.points + u) @ turn.T - mesh.points).ravel()
    here, there = solid.internal_forces(x), solid.internal_forces(turned)
    assert np.abs(there[:size].reshape(-1, dim) - here[:size].reshape(-1, dim) @ turn.T).max() < 1e-14
    assert np.abs(there[size:] - here[size:]).max() < 1e-14
    assert energy_of_body(solid, turned) == pytest.approx(energy_of_body(solid, x), rel=1e-12)


@pytest.mark.parametrize("terms", [((0.5, 2.0), (0.5, -2.0)), ((1.0, 8.0),), ((1.0, 1.3),)])
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_plane_stress_has_a_thickness_at_any_stretch(nu: float, terms: tuple[tuple[float, float], ...]) -> None:
    """Out of the plane the Kirchhoff stress is that of the law and K (J - 1) J: their sum vanishes."""
    law = Ogden(0.4, terms)
    material = Hyperelastic.of(law, nu, plane_stress=True)
    one, two = (a.ravel() for a in np.meshgrid(*2 * (np.geomspace(0.05, 10.0, 9),)))
    f = material.deformation(np.stack([one - 1.0, 0 * one, 0 * one, two - 1.0], axis=1).reshape(-1, 2, 2))
    j = determinant(f)
    kirchhoff = law.stress(f) @ np.swapaxes(f, 1, 2)
    out_of_plane = kirchhoff[:, 2, 2] + material.bulk * (j - 1.0) * j
    assert np.abs(out_of_plane / (np.abs(kirchhoff).max(axis=(1, 2)) + material.bulk * j)).max() < 1e-10


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
    n, pattern = mesh.points.size, Pattern.of(mesh, True)
    solid = TotalLagrangian(mesh, Hyperelastic(NeoHooke(1.0), 1e7, mixed=True), 1.0, pattern)
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
    area = side_load(cavity, "x-", lambda p: p / np.linalg.norm(p, axis=1)[:, None])
    load = np.concatenate([want * area.ravel(), np.zeros(len(mesh.vertices))])
    for _ in range(12):
        force = solid.internal_forces(x)
        step = splu(full(solid.tangent(x).upper)[free][:, free].tocsc()).solve((load - force)[free])
        x[free] += step
    assert np.abs(step).max() < 1e-9
    sides = np.unique(np.concatenate([mesh.facets[k].ravel() for k in ("y-", "y+", "z-", "z+")]))
    inside = np.setdiff1d(np.unique(mesh.facets["x-"]), sides)
    got = np.linalg.norm(mesh.points[inside] + x[:n].reshape(-1, 3)[inside], axis=1) / inner
    assert np.abs(got / stretch - 1.0).max() < 5e-3


def test_a_uniform_deformation_stretches_every_direction_by_its_gradient() -> None:
    mesh = quadratic(grid((2, 2)))
    slope = np.array([[0.3, 0.1], [-0.2, -0.1]])
    u = mesh.points @ slope.T
    for angle in (0.0, 0.7, 2.0):
        direction = np.array([np.cos(angle), np.sin(angle)])
        expected = np.linalg.norm(direction + slope @ direction) - 1.0
        assert stretch(mesh, u, np.array([0.4, 0.6]), direction) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("law", [NeoHooke(1.0), Ogden(1.0, ((0.7, 2.0), (0.3, -2.0)))])
@pytest.mark.parametrize(("nu", "plane_stress"), [(0.3, True), (0.5, False)])
@pytest.mark.parametrize("relaxes", [False, True])
def test_a_stiff_part_has_the_stress_of_its_law_without_round_off(
    law: IsochoricLaw, nu: float, plane_stress: bool, relaxes: bool
) -> None:
    rng, points = np.random.default_rng(3), 6
    parts = Isotropic(1.0, nu), Isotropic(1e6, 0.3)
    material = Hyperelastic.of_parts(law, parts, np.repeat([0, 1], points // 2), plane_stress)
    slope, p = rng.normal(size=(points, 2, 2)), rng.normal(size=points)
    past = rng.normal(size=(points, 3, 3)) * (np.arange(points) >= points // 2)[:, None, None]
    past += np.swapaxes(past, 1, 2)

    def stress(size: float, exact: bool) -> Float:
        """Return the stress at the stiff points, over the size of the displacement gradients."""
        held = Relaxing(0.7, 0.8, 1e6 * size * past) if relaxes else None
        f = material.deformation(size * slope, held)
        pressure = 1e6 * size * p if material.mixed else None
        return material.stress(f, pressure, held, size * slope if exact else None)[points // 2 :] / size

    by_law, scale = stress(1e-5, False), np.abs(stress(1e-5, False)).max()
    assert np.abs(stress(1e-5, True) - by_law).max() < 1e-4 * scale  # both are linear but for some strains of 1e-5
    assert np.abs(stress(1e-15, True) - by_law).max() < 1e-4 * scale
    assert np.abs(stress(1e-15, False) - by_law).max() > 1e-4 * scale


def bars(dim: int) -> Bars:
    """Three bars of unit length in a chain of four points along x."""
    chain = sp.csr_matrix(np.diff(np.eye(4), axis=0))
    yielding = 0.1 * np.array([[2.0, 0.5, 0.1], [0.5, 2.0, 0.5], [0.1, 0.5, 2.0]])
    directions = np.tile(np.eye(dim)[0], (3, 1))
    relative = sp.kron(chain, np.eye(dim), format="csr")
    return Bars(directions, relative, np.array([1.0, 2.0, 3.0]), yielding)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("relaxation", [None, BarRelaxation(0.6, np.array([0.01, 0.0, -0.02]))])
def test_the_tangent_is_the_derivative_of_the_forces(dim: int, relaxation: BarRelaxation | None) -> None:
    made, rng = bars(dim), np.random.default_rng(0)
    u, step, h = 0.3 * rng.normal(size=(4, dim)), rng.normal(size=(4, dim)), 1e-6
    difference = (made.forces(u + h * step, relaxation) - made.forces(u - h * step, relaxation)) / (2.0 * h)
    assert made.tangent(u, relaxation) @ step.ravel() == pytest.approx(difference, rel=1e-6, abs=1e-8)


def test_a_stretch_is_shared_by_bar_and_surroundings() -> None:
    made = bars(3)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    rest = np.outer(np.arange(4.0), np.eye(3)[0])
    u = 1.25 * rest @ turn.T - rest  # every bar is stretched by a quarter, and turned
    tension = made.tension(u)
    assert made.strain(u, np.zeros(3)) == pytest.approx(np.full(3, 0.25), rel=1e-12)
    # e = T / k + S T
    assert tension / made.stiffness + made.yielding @ tension == pytest.approx(np.full(3, 0.25), rel=1e-12)
    assert made.yielded(u) == pytest.approx(made.yielding @ tension, rel=1e-12)
    # forces on a chain balance, and a rigid rotation of the stretched chain turns them
    forces = made.forces(u).reshape(4, 3)
    assert forces.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert forces @ turn == pytest.approx(made.forces(0.25 * rest).reshape(4, 3), abs=1e-12)


def test_bars_at_rest_have_no_force_at_all() -> None:
    # round-off of a foil's stiffness would outweigh the least of the contact forces
    directions = np.random.default_rng(4).normal(size=(3, 3))
    made = replace(bars(3), directions=directions / np.linalg.norm(directions, axis=1)[:, None])
    assert not made.forces(np.zeros((4, 3))).any()
    assert made.strain(1e-20 * np.eye(4, 3), np.zeros(3)).any()


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
