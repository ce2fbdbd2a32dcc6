"""Derivatives of increments: against central differences of presses, where the active sets do not change."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Branch, Coulomb, TwoCoefficients
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import Mesh
from finger3d.mechanics.discretise import elastic_object
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.moved_mesh import stretched_object
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.sensitivity import derivatives, tangents
from finger3d.mechanics.model import ElasticObject, Foils, Leg, MeshOptions
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Marker
from finger3d.mechanics.small_strain import linear_contact, variations
from finger3d.mechanics.small_strain.variations import VariedBody
from finger3d.objects import Cylinder, Plane, Sphere
from finger3d.progress import QUIET
from tests.differences import STEP, assert_equal_to_differences, other_parameters, parameters
from tests.models import block, fig9, small_section

READINGS = {
    "gauges": (Gauge("g", 0.7, 2.3, 0.2, 0.5), Gauge("l", -1.0, 1.5, 0.0, 0.3, length_mm=1.0)),
    "markers": (Marker("m1", 0.5, 2.9),),
}
SOLID = block(symmetry=(), material=Isotropic(1.0, 0.3), mesh=MeshOptions(0.97, 1.45, "swept"), **READINGS)
TILTED = replace(SOLID, object=Plane(tilt=0.03))
SLIDE = (
    Leg(0.3, steps=2),
    Leg(0.3, slide_x_mm=0.05, slide_z_mm=0.02, steps=2),
    Leg(0.1, slide_x_mm=0.05, slide_z_mm=0.02, steps=1),
)
FORCE = (Leg(0.3, force_N=1.0, steps=2), Leg(0.3, slide_x_mm=0.1, force_N=1.2, steps=1))
SLIDE_2D = (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, steps=2))
HELD = (
    Leg(0.3, steps=1),
    Leg(0.3, force_x_N=0.1, force_z_N=0.05, steps=2),
    Leg(0.3, slide_x_mm=0.05, steps=2),
)
CASES = {
    "plane": replace(TILTED, legs=(Leg(0.3, steps=2),)),
    "slide": replace(TILTED, legs=SLIDE, friction=Coulomb(0.3)),
    "force": replace(TILTED, legs=FORCE),
    "ball": replace(SOLID, legs=(Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.2, steps=2))),
    "bar": small_section(object=Cylinder(radius_mm=3.0, axis="z"), symmetry=(), legs=(Leg(0.4, steps=3),)),
    # the directions follow the displacements so strongly that the plain iteration does not converge
    "deep bar": fig9(
        domain="plane-strain", mesh=MeshOptions(5.0, 12.0), object=Cylinder(radius_mm=30.0, axis="z", x_mm=1.0),
        material=Isotropic(1.0, 0.45), friction=Coulomb(0.4), legs=(Leg(10.0, steps=2),),
        gauges=(Gauge("g", 36.0, 40.0, 0.0, 0.5), Gauge("l", 20.0, 30.0, 0.0, 0.3, length_mm=3.0)),
    ),
    "tangential force": replace(TILTED, friction=Coulomb(0.5), legs=HELD),
    "turn": replace(TILTED, legs=(Leg(0.3, steps=1), Leg(0.3, turn_y=0.05, turn_z=0.01, steps=2))),
}  # fmt: skip


SLOW = ("plane", "force", "bar", "ball", "tangential force", "turn")
"""Cases that only `make test-all` runs."""


@pytest.mark.parametrize("case", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in CASES])
def test_every_derivative_is_that_of_presses(case: str) -> None:
    model = CASES[case]
    ways, thing = parameters(model), model.object
    if hasattr(thing, "radius_mm"):
        ways["radius"] = lambda h: replace(model, object=replace(thing, radius_mm=thing.radius_mm + h))
        ways["place"] = lambda h: replace(model, object=replace(thing, x_mm=thing.x_mm + h))
    else:
        ways["tilt"] = lambda h: replace(model, object=replace(thing, tilt=thing.tilt + np.deg2rad(h)))
    assert_equal_to_differences(build(model), ways)


FOILS = tuple(Gauge(g.name, g.x_mm, 1.4, angle=g.angle, length_mm=1.0) for g in READINGS["gauges"])
FOIL = Foils(100.0, 0.05, 0.3)
WITH_FOILS = {
    "solid": replace(TILTED, legs=SLIDE_2D, inclusions=FOIL, gauges=FOILS),
    # off the middle, where the moment is not a small difference
    "bar": replace(CASES["bar"], object=Cylinder(radius_mm=3.0, axis="z", x_mm=0.5), inclusions=FOIL, gauges=FOILS),
    "exact path": small_section(symmetry=(), legs=SLIDE_2D, inclusions=FOIL, gauges=FOILS),
}


@pytest.mark.parametrize(
    ("case", "some"),
    [
        ("exact path", ("mu", "nu", "x", "inclusions thickness_mm")),
        *(pytest.param(name, (), marks=pytest.mark.slow) for name in ("exact path", "bar")),
        pytest.param("solid", ("goal 1", "E", "nu", "x", "width_mm", "inclusions width_mm"), marks=pytest.mark.slow),
    ],
)
def test_derivatives_beside_foils(case: str, some: tuple[str, ...]) -> None:
    model = WITH_FOILS[case]
    ways = parameters(model) | other_parameters(model)
    assert_equal_to_differences(build(model), {name: ways[name] for name in some or ways})


BESIDE = {
    "bar": replace(CASES["bar"], object=Cylinder(radius_mm=3.0, axis="z", x_mm=0.1)),
    "solid": replace(SOLID, object=Cylinder(radius_mm=3.1, axis="z", x_mm=0.1), legs=SLIDE_2D),
    "block": replace(TILTED, legs=SLIDE_2D),
}


@pytest.mark.parametrize("case", [pytest.param(n, marks=[pytest.mark.slow] * (n != "bar")) for n in BESIDE])
def test_derivatives_beside_an_elastic_object(case: str) -> None:
    model = replace(BESIDE[case], object_compliance=ElasticObject(3.0, 0.3, 4.13 if case == "block" else None))
    assert_equal_to_differences(build(model), parameters(model) | other_parameters(model))


@pytest.mark.slow
def test_derivatives_beside_an_elastic_ball(monkeypatch: pytest.MonkeyPatch) -> None:
    # fTetWild makes another mesh each time; that of the ball stretches with its radius
    ball = Sphere(radius_mm=3.1, x_mm=0.1, z_mm=0.07)
    model = replace(BESIDE["solid"], object=ball, object_compliance=ElasticObject(3.0, 0.3, None))
    mesh, whole = elastic_object.object_mesh(
        build(replace(model, object_compliance=None)), model.object_compliance, model.first_contact.contact_box, QUIET
    )

    def same_cells(problem: Problem, *_: object) -> tuple[Mesh, bool]:
        return stretched_object(mesh, model, problem.model) or mesh, whole

    for module in (elastic_object, variations):
        monkeypatch.setattr(module, "object_mesh", same_cells)
    # with a long step a sample of the finger may cross the edge of a facet of the ball, where the trace jumps by 1e-11
    monkeypatch.setattr(linear_contact, "_TARGET", 1e-12)
    assert_equal_to_differences(build(model), parameters(model) | other_parameters(model), step=1e-6)


@pytest.mark.parametrize("branch", ["keep", "paper"])
def test_both_coefficients_of_friction_have_derivatives(branch: Branch) -> None:
    law = TwoCoefficients(0.3, 0.7, branch)
    legs = (Leg(0.3, steps=4), Leg(0.3, slide_x_mm=0.1, steps=2))
    model = small_section(symmetry=(), legs=legs, friction=law)
    ways = {
        "mu": lambda h: replace(model, friction=replace(law, mu=law.mu + h)),
        "ratio": lambda h: replace(model, friction=replace(law, ratio=law.ratio + h)),
    }
    assert_equal_to_differences(build(model), ways)


def test_a_hold_changes_no_derivative() -> None:
    ways = parameters(TILTED)
    found = []
    for legs in ((Leg(0.3, steps=2),), (Leg(0.3, steps=2), Leg(0.3, steps=1))):
        model = replace(TILTED, legs=legs)
        problem = build(model)
        own = [replace(ways["mu"](h), legs=legs) for h in (-STEP, STEP)]
        one = [VariedBody(problem).variation(*own, STEP)]
        *_, (step, _, growing) = tangents(problem, one)
        (slopes,) = derivatives(step, one, growing)
        found.append({n: slope for n, slope in slopes.items() if not n.startswith("stick")})  # what slipped now sticks
    assert found[1] == pytest.approx(found[0], rel=1e-6, abs=1e-7)
