"""Derivatives of presses of relaxing bodies: against central differences, where the active sets do not change."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import ElasticObject, Foils, Leg, MeshOptions
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.mechanics.small_strain.relaxation import Relaxation
from finger3d.objects import Cylinder, Plane
from tests.differences import assert_equal_to_differences, other_parameters, parameters
from tests.models import block, small_section
from tests.viscous_cases import TWO

READINGS = {
    "gauges": (Gauge("g", 0.7, 2.3, 0.2, 0.5), Gauge("l", -1.0, 1.5, 0.0, 0.3, length_mm=1.0)),
    "markers": (Marker("m1", 0.5, 2.9),),
    "taxels": (Taxel("t1", 0.3, 0.0, 1.5, 1.5),),
}
NU_CONSTANT, BULK_CONSTANT = Relaxation(TWO, True), Relaxation(TWO, False)
SOLID = block(
    symmetry=(), material=Isotropic(1.0, 0.3), mesh=MeshOptions(0.97, 1.45, "swept"), object=Plane(tilt=0.03),
    relaxation=NU_CONSTANT, **READINGS,
)  # fmt: skip
SECTION = small_section(symmetry=(), relaxation=NU_CONSTANT, **READINGS)
SLIDE = (Leg(0.3, steps=2, duration_s=1.0), Leg(0.35, slide_x_mm=0.05, steps=2, duration_s=0.5))
HOLD = (Leg(0.3, steps=2, duration_s=1.0), Leg(0.3, force_N=0.5, steps=2, duration_s=0.3))
BAR = Cylinder(radius_mm=3.0, axis="z")
CASES = {
    "section": replace(SECTION, legs=SLIDE),
    "section with constant bulk modulus": replace(SECTION, legs=SLIDE, relaxation=BULK_CONSTANT),
    "nearly incompressible": replace(
        SECTION, legs=SLIDE, relaxation=BULK_CONSTANT, material=Isotropic(1.0, 0.49), object=BAR
    ),
    "bar": replace(SECTION, legs=SLIDE, object=BAR),
    "force": replace(SECTION, legs=HOLD),
    "solid": replace(SOLID, legs=SLIDE, friction=Coulomb(0.3)),
    "solid with constant bulk modulus": replace(SOLID, legs=HOLD, relaxation=BULK_CONSTANT),
}  # fmt: skip
QUICK = ("section",)


@pytest.mark.parametrize("case", [pytest.param(n, marks=[pytest.mark.slow] * (n not in QUICK)) for n in CASES])
def test_every_derivative_is_that_of_presses(case: str) -> None:
    assert_equal_to_differences(build(CASES[case]), parameters(CASES[case]))


FOILS = tuple(Gauge(g.name, g.x_mm, 1.4, angle=g.angle, length_mm=1.0) for g in READINGS["gauges"])


@pytest.mark.parametrize("relaxation", [NU_CONSTANT, BULK_CONSTANT], ids=["nu", "bulk"])
def test_derivatives_beside_foils(relaxation: Relaxation) -> None:
    model = replace(
        SECTION, legs=SLIDE, relaxation=relaxation, inclusions=Foils(100.0, 0.05, 0.3), gauges=FOILS, taxels=()
    )
    assert_equal_to_differences(build(model), parameters(model) | other_parameters(model))


def test_derivatives_beside_an_elastic_object() -> None:
    thing = ElasticObject(3.0, 0.3, None)
    model = replace(CASES["bar"], object_compliance=thing)
    ways = parameters(model) | other_parameters(model)
    names = ("mu", "E", "x", "radius_mm", "object radius_mm", "object_compliance E_MPa", "g 0", "tau 1", "duration 1")
    assert_equal_to_differences(build(model), {name: ways[name] for name in names})
