"""States, histories, cavities, slip limits and penetration of a press."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, Coulomb
from finger3d.contact.state import ContactState
from finger3d.effects.large_deformation import Effect
from finger3d.errors import Outcome
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import Mesh, boundary, quadratic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, largest_force, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import (
    CAVITY,
    SurfaceCheck,
    beyond_candidates,
    cavity_warnings,
    check_surface,
    penetration_advice,
    penetration_warnings,
)
from finger3d.objects import Cylinder, ObjectPose, Plane, RigidObject, Sphere, Wedge
from finger3d.scene import parse
from tests.held_cases import MU, PRESS, N, held
from tests.meshes import grid
from tests.models import block, ended, fig9, half_cylinder, run, small_section


def test_the_increment_in_which_contact_begins_has_three_parts() -> None:
    _, steps = run(replace(half_cylinder(0.5, steps=4), object=Cylinder(radius_mm=20.0)))
    assert [len(step.parts) for step in steps] == [3, 1, 1, 1]
    depths = [pose.depth_mm / steps[0].target.depth_mm for pose, _ in steps[0].parts]
    assert depths == pytest.approx([1.0 / 16.0, 0.25, 1.0])
    assert steps[0].parts[-1][1] is steps[0].meshed_state


def level_points(nx: int, nz: int, shift: float = 0.0) -> ContactPoints:
    """A plane of points 1 mm apart, joined along x, along z and along one diagonal; z runs from `shift`."""
    x, z = np.meshgrid(np.arange(nx, dtype=float), np.arange(nz, dtype=float) + shift)
    number = np.arange(nx * nz).reshape(nz, nx)
    a, b, c, e = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    facets = np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, e], axis=1)])
    at = np.stack([x.ravel(), np.zeros(x.size), z.ravel()], axis=1)
    return ContactPoints(
        np.arange(x.size), np.zeros(x.size, dtype=np.int8), at, np.ones(x.size), np.eye(3)[[1, 0, 2]], 10.0, 0.75,
        facets, np.ones(x.size),
    )  # fmt: skip


def test_a_length_does_not_depend_on_the_half_that_is_meshed() -> None:
    block = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=8.0)
    model = Model(
        block, Isotropic(1.0, 0.4), MeshOptions(0.8, 2.0, "swept"), (Leg(0.3, steps=2),),
        object=Sphere(radius_mm=6.0), friction=Coulomb(0.25),
    )  # fmt: skip
    lengths = []
    for symmetry in (None, ()):
        problem = build(replace(model, symmetry=symmetry))
        frame = list(march(problem))[-1]
        numbers, at = measure(problem.points, frame), problem.points.points
        line = np.unique(at[at[:, 2] == 0.0, 0])
        last = at[(frame.state.status != OPEN) & (at[:, 2] == 0.0), 0].max()
        assert last < numbers["contact_half_length_mm"] < line[line > last].min()
        lengths.append([numbers["contact_half_length_mm"], numbers["stick_half_length_mm"]])
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)


def test_without_contact_the_force_is_0_and_not_minus_0() -> None:
    points = level_points(3, 3)
    n = len(points.points)
    state = ContactState(np.full(n, OPEN), np.zeros((n, 3)), np.zeros(n), np.zeros((n, 2)), np.zeros((n, 2)))
    step = StepResult(
        ObjectPose(0.1), state, state, (0.0, 0.0), np.zeros(3), {}, 0.0, 0.0, Outcome.CONVERGED, 0.0, 1, "newton", 0.0
    )
    assert str(measure(points, step)["normal_force_N"]) == "0.0"


def test_a_point_at_the_lowest_place_of_the_object_is_on_neither_side_of_it() -> None:
    problem, step = ended(small_section(legs=(Leg(0.2, steps=2, slide_x_mm=0.1),)))
    friction = problem.points.friction(step.state.force)[:, 0]
    at, most = problem.points.points[:, 0], int(np.argmax(np.abs(friction)))
    expected = float(friction @ np.sign(at - at[most]))
    for off in (-1e-6, 0.0, 1e-6):  # by as much as a difference of a dimension moves a point
        numbers = measure(problem.points, replace(step, lowest=(at[most] + off, 0.0)))
        assert numbers["outward_friction_x_N"] == pytest.approx(expected, rel=1e-12)


def hollow() -> Mesh:
    """A unit cube of 6 x 6 x 6 cells without the cells of a cube of half its size in its middle."""
    mesh = grid((6, 6, 6))
    centre = mesh.points[mesh.cells].mean(axis=1)
    cells = mesh.cells[(np.abs(centre - 0.5) > 1.0 / 3.0).any(axis=1)]
    facets = boundary(cells, 3)
    inner = (np.abs(mesh.points[facets] - 0.5) < 0.4).all(axis=(1, 2))
    return quadratic(replace(mesh, cells=cells, facets={"walls": facets[~inner], CAVITY: facets[inner]}))


@pytest.mark.parametrize(("share", "crosses"), [(0.0, False), (0.9, False), (1.1, True)])
def test_an_inner_surface_is_told_to_cross_itself_when_its_faces_pass_each_other(share: float, crosses: bool) -> None:
    # The top of the cavity bulges down by a share of the cavity's height, 2/3, and aside, so that no points coincide.
    mesh = hollow()
    x, y, z = mesh.points.T
    top = np.isclose(y, 5.0 / 6.0) & (np.abs(x - 0.5) < 0.3) & (np.abs(z - 0.5) < 0.3)
    move = np.zeros_like(mesh.points)
    move[top, 1] = -share * 2.0 / 3.0 * np.cos(np.pi * (x[top] - 0.5)) * np.cos(np.pi * (z[top] - 0.5))
    move[top, 0] = 0.05 * share
    assert bool(cavity_warnings(mesh, move)) == crosses


def test_the_largest_force_of_a_flat_contact() -> None:
    """mu N along every axis in its plane."""
    problem = build(block(object=Plane(), legs=(PRESS, held(0.03, 0.04 * 0.5))))
    *_, last = march(problem)
    for along in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]):
        most, pressure = largest_force(problem.points, last.state, problem.model.friction, np.array(along))
        assert most == pytest.approx(MU * N, rel=1e-9)
        assert pressure == pytest.approx(0.0, abs=1e-12)


HEIGHT, DEPTH = 10.0, 0.6


PRESS_BLOCK = Leg(DEPTH, steps=3)


def section(obj: RigidObject, size: float, mu: float, leg: Leg = PRESS_BLOCK, base: float = 2.0) -> Model:
    """A section of a block."""
    design = designs()["block"](half_length_mm=7.0, height_mm=HEIGHT, width_mm=HEIGHT)
    options = MeshOptions(size, base * size, "swept")
    model = Model(design, Isotropic(1.0, 0.4), options, (leg,), object=obj, friction=Coulomb(mu))
    return replace(model, domain="plane-strain")


def penetration(obj: RigidObject, size: float, mu: float, base: float = 2.0) -> float:
    """Deepest place inside the object over the depth, of a section of a block."""
    problem, steps = run(Effect().apply(section(obj, size, mu, base=base)))
    return max(check.penetration_mm for check in check_surface(problem, steps)) / DEPTH


def test_penetration_under_a_round_object_is_at_most_some_times_the_sagitta_of_a_facet() -> None:
    """It is largest at the edge of contact, where the mean gap of a point is of a part that touches and one that opens.

    It depends on where the edge lies between the points: 0.8 to 2.1 times the sagitta on these meshes.
    """
    radius, sizes = 2.4, np.array([0.4, 0.2, 0.1])
    wedge = Wedge(angle=float(np.radians(31.0)), tip_radius_mm=radius)
    found = np.array([penetration(wedge, size, 0.25) for size in sizes])
    assert (found < 3.0 * sizes**2 / (8.0 * radius * DEPTH)).all()
    assert found[-1] < 0.01  # at a section's default edge length, a hundredth of the height
    assert found[-1] < 0.5 * found[0]


def test_penetration_at_a_sharp_edge_of_the_finger_is_that_of_the_edges_there() -> None:
    """The stress is singular at the corner of a block that sticks; longer edges away from it hardly matter."""
    found = [penetration(Plane(), size, 2.0) for size in (0.8, 0.4, 0.2)]
    assert found[0] > 1.2 * found[1] > 1.44 * found[2]
    assert penetration(Plane(), 0.4, 2.0, base=1.0) > 0.8 * found[1]


SOLID = {
    "finger": {"geometry": "block", "half_length_mm": 7.0, "height_mm": HEIGHT, "width_mm": 14.0},
    "material": {"E_MPa": 1.0, "nu": 0.45},
    "press": {"depth_mm": 0.9, "steps": 3},
    "mesh": {"mesher": "swept"},
}


def pressed(model: Model) -> tuple[Problem, SurfaceCheck]:
    problem = build(model)
    return problem, check_surface(problem, list(march(problem)))[-1]


def test_a_ball_enters_a_solid_by_less_than_a_hundredth_of_the_depth_by_default() -> None:
    scene = parse({**SOLID, "object": {"shape": "sphere", "radius_mm": 6.8}})
    _, check = pressed(scene.model())
    assert check.penetration_mm < 0.01 * 0.9


def test_the_edge_length_that_is_advised_leaves_a_hundredth_of_the_depth() -> None:
    scene = parse({**SOLID, "object": {"shape": "sphere", "radius_mm": 6.8}})
    model = replace(scene.model(), mesh=MeshOptions(0.6, 2.0, "swept"))
    problem, check = pressed(model)
    assert not penetration_warnings(problem, [check])
    (line,) = penetration_advice(problem, [check])
    (length,) = re.findall(r"mesh\.size_mm = ([\d.]+) .*\b1%", line)
    finer = replace(model, mesh=MeshOptions(float(length), 2.0, "swept"))
    assert "fillet" not in line
    assert 0.2 < float(length) < 0.6
    problem, check = pressed(finer)
    assert check.penetration_mm < 0.01 * 0.9
    assert not penetration_advice(problem, [check])


def test_a_sharp_edge_of_the_finger_is_named_where_the_object_enters_there() -> None:
    problem, check = pressed(Effect().apply(section(Plane(), 0.8, 2.0)))
    assert check.at_crease
    (line,) = penetration_advice(problem, [check])
    assert "fillet" in line


def test_penetration_is_compared_with_the_depth_that_a_force_reaches() -> None:
    leg = Leg(5.0 * DEPTH, steps=2, force_N=12.0)  # the depth is a forecast, which is far too large
    problem, steps = run(Effect().apply(section(Plane(), 0.8, 2.0, leg)))
    checks, reached = check_surface(problem, steps), steps[-1].target.depth_mm
    assert reached < 0.5 * leg.depth_mm
    share = max(check.penetration_mm for check in checks) / reached
    assert 0.01 < share < 0.1
    assert penetration_advice(problem, checks)


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_too_few_candidate_points_are_noticed(domain: Domain) -> None:
    model = fig9(domain=domain, gauges=(), legs=(Leg(3.0, steps=10),))
    narrow, usual, whole = (build(model, margin=margin) for margin in (-0.6, 0.3, math.inf))
    assert len(narrow.surface.nodes) < len(usual.surface.nodes) < len(whole.surface.nodes)
    steps = [list(march(problem)) for problem in (narrow, usual, whole)]
    checks = [check_surface(p, s) for p, s in zip((narrow, usual, whole), steps, strict=True)]
    assert [every[-1].within_candidates for every in checks] == [False, True, True]
    assert 0 not in beyond_candidates(whole).face
    assert 0 in beyond_candidates(usual).face
    # the first increments stay within the few points
    assert checks[0][0].within_candidates


def test_penetration_is_compared_to_the_depth_that_was_reached() -> None:
    problem = build(fig9(domain="plane-strain", gauges=(), legs=(Leg(3.0, steps=10), Leg(1.0, steps=2))))
    steps = list(march(problem))
    for count, depth in ((2, 0.6), (12, 3.0)):  # as of a press that ended early, and of the whole one
        assert [check.depth_mm for check in check_surface(problem, steps[:count])] == pytest.approx([depth] * count)
