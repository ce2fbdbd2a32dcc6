"""Derivatives along the exact path: against central differences of presses, where the active sets do not change."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import ElasticObject, Leg, MeshOptions
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.objects import Plane
from tests.differences import assert_equal_to_differences, other_parameters, parameters
from tests.models import fig9, small_section

TILTED = {"symmetry": (), "object": Plane(tilt=np.deg2rad(2.0))}
PRESS = (Leg(8.0, steps=3),)
SLIDE = (Leg(8.0, steps=2), Leg(8.0, slide_x_mm=1.0, steps=2), Leg(3.0, slide_x_mm=-0.5, steps=2))
FORCE = (
    Leg(8.0, steps=2, force_N=200.0),
    Leg(8.0, slide_x_mm=1.0, steps=2, force_N=220.0),
    Leg(8.0, slide_x_mm=1.0, steps=1, force_N=20.0),
)
READINGS = {
    "gauges": (Gauge("g36", 36.0, 40.0, 0.0, 0.5), Gauge("g20", 20.0, 30.0, 0.0, 0.3, length_mm=3.0)),
    "markers": (Marker("m1", 10.0, 49.0),),
    "taxels": (Taxel("t1", 0.0, 0.0, 10.0, 5.0),),
}
CASES = {
    "press": ({"legs": PRESS, "material": Isotropic(1.0, 0.49)}, "plane-strain", 0.4),
    "slide": ({"legs": SLIDE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-strain", 0.4),
    "force": ({"legs": FORCE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-stress", 0.4),
    "grip": ({"legs": SLIDE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-strain", 1.0),
}


@pytest.mark.parametrize(
    "case", ["slide", "force", *(pytest.param(n, marks=pytest.mark.slow) for n in ("press", "grip"))]
)
def test_every_derivative_is_that_of_presses(case: str) -> None:
    changes, domain, mu = CASES[case]
    model = fig9(domain=domain, mesh=MeshOptions(4.0, 10.0), friction=Coulomb(mu), **(READINGS | changes))
    assert_equal_to_differences(build(model), parameters(model))


BESIDE = {
    "slide": (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, steps=2)),
    "force": (Leg(0.3, force_N=1.0, steps=2), Leg(0.3, slide_x_mm=0.1, force_N=1.2, steps=2)),
}


@pytest.mark.parametrize("case", BESIDE)
def test_derivatives_beside_an_elastic_plane(case: str) -> None:
    # the directions of the points follow the share of the object in the compliance
    thing = ElasticObject(3.0, 0.3, 4.13)
    model = small_section(object_compliance=thing, legs=BESIDE[case], symmetry=(), object=Plane(tilt=0.03))
    assert_equal_to_differences(build(model), parameters(model) | other_parameters(model))
