"""How far the surface enters the object between contact points, whose mean gaps alone are never negative."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from finger3d.analyses.press_record import depth_warning
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import (
    SurfaceCheck,
    check_surface,
    penetration_advice,
    penetration_warnings,
)
from finger3d.objects import Plane, RigidObject, Wedge
from finger3d.scene import parse

HEIGHT, DEPTH = 10.0, 0.6


def penetration(obj: RigidObject, size: float, mu: float, base: float = 2.0) -> float:
    """Deepest place inside the object over the depth, of a section of a block."""
    design = designs()["block"](half_length_mm=7.0, height_mm=HEIGHT, width_mm=HEIGHT)
    options = MeshOptions(size, base * size, "swept")
    model = Model(design, Isotropic(1.0, 0.4), options, (Leg(DEPTH, steps=3),), object=obj, friction=Coulomb(mu))
    model = Effect().apply(replace(model, domain="plane-strain"))
    problem = build(model)
    steps = list(march(problem))
    assert all(step.outcome.ok for step in steps)
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
    model = Model(
        designs()["block"](half_length_mm=7.0, height_mm=HEIGHT, width_mm=HEIGHT), Isotropic(1.0, 0.4),
        MeshOptions(0.8, 1.6, "swept"), (Leg(DEPTH, steps=3),), object=Plane(), friction=Coulomb(2.0),
        domain="plane-strain",
    )  # fmt: skip
    problem, check = pressed(Effect().apply(model))
    assert check.at_crease
    (line,) = penetration_advice(problem, [check])
    assert "fillet" in line


def test_penetration_is_compared_with_the_depth_that_a_force_reaches() -> None:
    leg = Leg(5.0 * DEPTH, steps=2, force_N=12.0)  # the depth is a forecast, which is far too large
    forced = Model(
        designs()["block"](half_length_mm=7.0, height_mm=HEIGHT, width_mm=HEIGHT), Isotropic(1.0, 0.4),
        MeshOptions(0.8, 1.6, "swept"), (leg,), object=Plane(), friction=Coulomb(2.0), domain="plane-strain",
    )  # fmt: skip
    problem = build(Effect().apply(forced))
    steps = list(march(problem))
    checks, reached = check_surface(problem, steps), steps[-1].target.depth_mm
    assert reached < 0.5 * leg.depth_mm
    share = max(check.penetration_mm for check in checks) / reached
    assert 0.01 < share < 0.1
    assert penetration_advice(problem, checks)


def test_the_warning_of_a_deep_press_tells_the_depth_that_a_force_reaches() -> None:
    leg = Leg(9.0, steps=3, force_N=60.0)
    forced = Model(
        designs()["block"](half_length_mm=7.0, height_mm=HEIGHT, width_mm=HEIGHT), Isotropic(1.0, 0.4),
        MeshOptions(1.6, 1.6, "swept"), (leg,), object=Plane(), friction=Coulomb(0.2), domain="plane-strain",
    )  # fmt: skip
    problem = build(forced)
    steps = list(march(problem))
    depth = steps[-1].target.depth_mm
    assert 0.3 * HEIGHT < depth < 0.8 * leg.depth_mm
    (line,) = depth_warning(problem, steps)
    assert f"is {10.0 * depth:.0f} % of the finger's height" in line
