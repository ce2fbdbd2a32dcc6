"""Order of the error that increments leave: about two, since points that close are held where they touch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, Sphere
from tests.models import fig9

NAMES = ("normal_force_N", "friction_sum_N", "dissipation_mJ")

COUNTS = (10, 20, 40, 80)


def on_a_bar(**changes: object) -> Model:
    """The section of the paper's finger on a round bar."""
    mesh, bar = MeshOptions(1.0, 4.0), Cylinder(radius_mm=20.0, axis="z")
    model = fig9(domain="plane-strain", mesh=mesh, object=bar, friction=Coulomb(0.5), legs=(Leg(6.0),))
    return replace(model, **changes)


def solid(**changes: object) -> Model:
    """The paper's finger on a coarse mesh."""
    return fig9(mesh=MeshOptions(2.5, 10.0, "swept"), friction=Coulomb(0.5), **changes)


PRESSES = {
    "section on a bar": (on_a_bar(), 320),
    "that slides": (on_a_bar(legs=(Leg(5.0), Leg(5.0, slide_x_mm=2.0))), 320),
    "that is released": (on_a_bar(legs=(Leg(6.0), Leg(2.0))), 320),
    "with viscosity": (
        on_a_bar(legs=(Leg(6.0, duration_s=1.0),), relaxation=Relaxation(((0.4, 0.5),), bulk=True)),
        320,
    ),
    "at large deformation": (LargeDeformation().apply(on_a_bar(friction=Coulomb(0.3))), 160),
    "solid on a plane": (solid(), 320),
    "solid on a ball": (solid(object=Sphere(radius_mm=30.0), legs=(Leg(5.0),)), 320),
}


def numbers(problem: Problem, count: int) -> np.ndarray:
    legs = tuple(replace(leg, steps=count) for leg in problem.model.legs)
    end = list(march(replace(problem, model=replace(problem.model, legs=legs))))[-1]
    assert end.outcome.ok
    measured = measure(problem.points, end)
    return np.array([measured[name] for name in NAMES])


SLOW = ("at large deformation", "that slides", "that is released", "with viscosity", "solid on a ball")


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in SLOW)) for n in PRESSES])
def test_errors_fall_at_second_order(name: str) -> None:
    # points touch one by one, so that single ratios scatter widely about 4: the median is taken, and the whole fall
    model, finest = PRESSES[name]
    problem = build(model)
    exact = numbers(problem, finest)
    errors = np.abs([numbers(problem, count) / exact - 1.0 for count in COUNTS])
    assert np.median(errors[:-1] / errors[1:]) >= 3.3
    assert (errors[-1] <= errors[0] / 10.0).all()
    assert errors[1, 0] <= 1e-3
    assert errors[1, 1] <= 1e-2


def test_a_touch_so_light_that_gaps_are_at_the_round_off_of_coordinates_converges() -> None:
    # the first part of the increment is 7e-7 mm deep on a block 200 mm high, whose coordinates are exact to 3e-14 mm
    block = designs()["block"](half_length_mm=200.0, height_mm=200.0, width_mm=1.0)
    bar = Cylinder(radius_mm=1000.0)
    model = Model(
        block, Isotropic(1.0, 0.3), MeshOptions(0.05, 25.0, "swept"), (Leg(1.1e-5, steps=1),), object=bar,
        friction=Coulomb(0.25), domain="plane-strain",
    )  # fmt: skip
    (end,) = march(build(model, margin=-0.5))
    assert end.outcome.ok
