"""Derivatives along the exact path: against central differences of presses, where the active sets do not change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.solids.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.sensitivity import derivatives
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.mechanics.results.history import table_row
from finger3d.mechanics.small_strain.variations import variation
from finger3d.objects import Plane
from tests.models import fig9

STEP, DIFFERENCE = 1e-5, 2e-6
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


def with_leg(model: Model, number: int, name: str) -> Callable[[float], Model]:
    def changed(h: float) -> Model:
        legs = list(model.legs)
        legs[number] = replace(legs[number], **{name: getattr(legs[number], name) + h})
        return replace(model, legs=tuple(legs))

    return changed


def parameters(model: Model) -> dict[str, Callable[[float], Model]]:
    """The model with each of its parameters changed by h."""
    mu, nu, (gauge, other) = model.friction.mu, model.material.nu, model.gauges
    found = {
        "mu": lambda h: replace(model, friction=Coulomb(mu + h)),
        "E": lambda h: replace(model, material=Isotropic(1.0 + h, nu)),
        "nu": lambda h: replace(model, material=Isotropic(1.0, nu + h)),
        "x": lambda h: replace(model, gauges=(replace(gauge, x_mm=gauge.x_mm + h), other)),
        "angle": lambda h: replace(model, gauges=(replace(gauge, angle=gauge.angle + h), other)),
    }
    for number, leg in enumerate(model.legs):
        found[f"goal {number}"] = with_leg(model, number, "depth_mm" if leg.force_N is None else "force_N")
        if leg.slide_x_mm:
            found[f"slide {number}"] = with_leg(model, number, "slide_x_mm")
    return found


CASES = {
    "press": ({"legs": PRESS, "material": Isotropic(1.0, 0.49)}, "plane-strain", 0.4),
    "slide": ({"legs": SLIDE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-strain", 0.4),
    "force": ({"legs": FORCE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-stress", 0.4),
    "grip": ({"legs": SLIDE, "material": Isotropic(1.0, 0.3), **TILTED}, "plane-strain", 1.0),
}


@pytest.mark.parametrize("case", CASES)
def test_every_derivative_is_that_of_presses(case: str) -> None:
    changes, domain, mu = CASES[case]
    model = fig9(domain=domain, mesh=MeshOptions(4.0, 10.0), friction=Coulomb(mu), **(READINGS | changes))
    problem, ways = build(model), parameters(model)
    steps, slopes = derivatives(problem, [variation(problem, way(-STEP), way(STEP), STEP) for way in ways.values()])
    values = [table_row(problem.points, step) for step in steps]
    for k, (name, way) in enumerate(ways.items()):
        ends = []
        for h in (-DIFFERENCE, DIFFERENCE):
            condensed = name in ("E", "nu", "x", "angle")
            other = build(way(h)) if condensed else replace(problem, model=way(h))
            ends.append((other, list(march(other))))
        for number, (low, high) in enumerate(zip(*(found for _, found in ends), strict=True)):
            assert (low.state.status == high.state.status).all()
            rows = [table_row(p.points, step) for (p, _), step in zip(ends, (low, high), strict=True)]
            for column, slope in slopes[number][k].items():
                size = 1e-3 if column.startswith("gauge") else 0.1  # of numbers that are zero
                largest = max(abs(slope), size, *(abs(row[column]) for row in values))
                assert (rows[1][column] - rows[0][column]) / (2.0 * DIFFERENCE) == pytest.approx(
                    slope, abs=1e-6 * largest
                ), (name, number, column)


def test_forces_are_proportional_to_the_modulus_and_places_are_not() -> None:
    model = fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), friction=Coulomb(0.4), legs=PRESS, **READINGS)
    problem = build(model)
    stiffer = variation(problem, *(replace(model, material=Isotropic(1.0 + h, 0.49)) for h in (-STEP, STEP)), STEP)
    steps, slopes = derivatives(problem, [stiffer])
    value, slope = table_row(problem.points, steps[-1]), slopes[-1][0]
    for name in ("normal_force_N", "friction_sum_N", "taxel_t1_MPa", "dissipation_mJ"):
        assert slope[name] == pytest.approx(value[name], rel=1e-8)
    for name in ("stick_area_mm2", "gauge_g36", "marker_m1_x_mm"):
        assert slope[name] == pytest.approx(0.0, abs=1e-8 * abs(value[name]))


def test_what_changes_the_mesh_and_what_has_no_exact_path_is_refused() -> None:
    model = fig9(domain="plane-strain", mesh=MeshOptions(4.0, 10.0), friction=Coulomb(0.4), legs=PRESS)
    problem = build(model)
    other = replace(model, design=replace(model.design, radius_mm=101.0))
    with pytest.raises(Finger3dError, match="changes the mesh or the object"):
        variation(problem, model, other, STEP)
    with pytest.raises(Finger3dError, match="exact path"):
        derivatives(replace(problem, model=replace(model, rule="paper")), [])
