"""Derivatives of increments at large deformation: against central differences of presses."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws import NeoHooke
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import ElasticObject, Foils, Leg, MeshOptions
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Taxel
from finger3d.mechanics.small_strain.relaxation import Relaxation
from finger3d.objects import Cylinder, Plane, Sphere
from tests.differences import assert_equal_to_differences, other_parameters, parameters
from tests.models import block, small_section
from tests.viscous_cases import TWO

GAUGES = (Gauge("g", 0.7, 2.3, 0.2, 0.5), Gauge("l", -1.0, 1.5, 0.0, 0.3, length_mm=1.0))
SOLID = block(
    symmetry=(), material=Isotropic(1.0, 0.3), mesh=MeshOptions(0.97, 1.45, "swept"), gauges=GAUGES,
    hyperelastic_law=NeoHooke(1.0),
)  # fmt: skip
SECTION = small_section(symmetry=(), hyperelastic_law=NeoHooke(1.0))
SLIDE = (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, steps=2))
CASES = {
    "section": replace(SECTION, legs=SLIDE),
    "bar": replace(SECTION, object=Cylinder(radius_mm=3.0, axis="z"), legs=(Leg(0.4, steps=2),)),
    "plane": replace(
        SOLID, object=Plane(tilt=0.03), friction=Coulomb(0.3),
        legs=(Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, slide_z_mm=0.02, steps=2), Leg(0.1, steps=1)),
    ),
    "ball": replace(SOLID, object=Sphere(radius_mm=5.0), legs=SLIDE),
    "force": replace(SOLID, object=Plane(tilt=0.03), legs=(Leg(0.3, force_N=1.0, steps=2),)),
    "turn": replace(SOLID, object=Sphere(radius_mm=5.0), legs=(Leg(0.3, steps=1), Leg(0.3, turn_z=0.05, steps=1))),
}  # fmt: skip
TIMED = tuple(replace(leg, duration_s=t) for leg, t in zip(SLIDE, (1.0, 0.5), strict=True))
TAXELS = (Taxel("t1", 0.3, 0.0, 1.5, 1.5),)
CASES |= {
    "viscous section": replace(SECTION, legs=TIMED, relaxation=Relaxation(TWO, False), taxels=TAXELS),
    "viscous plane stress": replace(SECTION, domain="plane-stress", legs=TIMED, relaxation=Relaxation(TWO, True)),
    "viscous, nearly incompressible": replace(
        CASES["bar"], material=Isotropic(1.0, 0.49), relaxation=Relaxation(TWO, False),
        legs=(Leg(0.3, steps=2, duration_s=1.0), Leg(0.3, force_N=0.5, steps=2, duration_s=0.3)),
    ),
    "viscous solid": replace(
        CASES["plane"], relaxation=Relaxation(TWO, True),
        legs=tuple(replace(leg, duration_s=0.5) for leg in CASES["plane"].legs[:2]),
    ),
}  # fmt: skip
QUICK = ("bar", "viscous plane stress")


@pytest.mark.parametrize("case", [pytest.param(n, marks=[pytest.mark.slow] * (n not in QUICK)) for n in CASES])
def test_every_derivative_is_that_of_presses(case: str) -> None:
    model = CASES[case]
    # the presses themselves are solved to a residual of 5e-9
    assert_equal_to_differences(build(model), parameters(model), tolerance=1e-5, step=2e-5)


@pytest.mark.slow
def test_derivatives_beside_an_elastic_object() -> None:
    bar = replace(CASES["bar"].object, x_mm=0.1)
    model = replace(CASES["bar"], object=bar, object_compliance=ElasticObject(3.0, 0.3, None))
    ways = parameters(model) | other_parameters(model)
    assert_equal_to_differences(build(model), ways, tolerance=1e-5, step=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["section", "viscous section"])
def test_derivatives_beside_foils(case: str) -> None:
    foils = tuple(Gauge(g.name, g.x_mm, 1.4, angle=g.angle, length_mm=1.0) for g in GAUGES)
    model = replace(CASES[case], inclusions=Foils(100.0, 0.05, 0.3), gauges=foils, taxels=())
    ways = parameters(model) | other_parameters(model)
    assert_equal_to_differences(build(model), ways, tolerance=1e-5, step=2e-5)
