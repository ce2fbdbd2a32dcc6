"""Models that several tests press."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import Sphere


def fig9(**changes: object) -> Model:
    """The finger of Maeno 2004, Fig. 9, 20 mm wide."""
    finger = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    model = Model(
        finger, Isotropic(1.0, 0.49), MeshOptions(2.0, 8.0, "swept"), (Leg(10.0, steps=10),), friction=Coulomb(0.25),
        gauges=(Gauge("g36", 36.0, 40.0, 0.0, np.deg2rad(30.0)),),
    )  # fmt: skip
    return replace(model, **changes)


def large_fig9(nu: float, size: float = 2.0, **changes: object) -> Model:
    """The section of that finger at large deformation, with a gauge and its mirror image."""
    gauges = (Gauge("g", 36.0, 40.0, 0.0, 0.5236), Gauge("mirror", -36.0, 40.0, 0.0, np.pi - 0.5236))
    mesh = MeshOptions(size, 4 * size, "swept")
    model = fig9(material=Isotropic(1.0, nu), mesh=mesh, gauges=gauges, domain="plane-strain")
    return LargeDeformation().apply(replace(model, **changes))


def block(**changes: object) -> Model:
    """A block under a rigid ball."""
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2, "swept"), (Leg(0.3, steps=3),), object=Sphere(radius_mm=4.0),
        friction=Coulomb(0.25),
    )  # fmt: skip
    return replace(model, **changes)


def small_section(**changes: Any) -> Model:
    """A section 5 mm high with a gauge at a point and one along a line."""
    finger = designs()["clipped_cylinder"](radius_mm=10.0, half_length_mm=5.0, edge_height_mm=4.0, width_mm=3.0)
    model = Model(
        finger, Isotropic(1.0, 0.45), MeshOptions(0.6, 1.5, "swept"), (Leg(0.5, steps=4),), friction=Coulomb(0.25),
        gauges=(Gauge("g", 2.0, 4.5, angle=0.5), Gauge("long", -1.0, 4.5, length_mm=1.0)), domain="plane-strain",
    )  # fmt: skip
    return replace(model, **changes)


def run(model: Model) -> tuple[Problem, list[StepResult]]:
    """Condense and press a model; every increment converges."""
    problem = build(model)
    return problem, marched(problem)


def marched(problem: Problem) -> list[StepResult]:
    """Press a condensed body; every increment converges."""
    frames = list(march(problem))
    assert all(f.outcome.ok and f.residual <= 1e-8 for f in frames)
    return frames


def last(model: Model) -> dict[str, float]:
    """Quantities at the end of a press."""
    problem, frames = run(model)
    return measure(problem.points, frames[-1])


def half_cylinder(size: float, steps: int = 10) -> Model:
    """A section of the finger of Maeno 2004, Fig. 1, on a swept mesh."""
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    return Model(
        design, Isotropic(1.0, 0.45), MeshOptions(size, 5.0 * size, "swept"), (Leg(1.0, steps=steps),),
        friction=Coulomb(0.25), gauges=(Gauge("g", 1.5, 4.0, angle=0.5),), domain="plane-strain",
    )  # fmt: skip


def swept_fig9(size: float, mu: float = 0.125, nu: float = 0.4) -> Model:
    """The finger of Fig. 9 as a solid without gauges."""
    mesh = MeshOptions(size, 4.0 * size, "swept")
    return fig9(material=Isotropic(1.0, nu), mesh=mesh, friction=Coulomb(mu), gauges=())


def ended(model: Model) -> tuple[Problem, StepResult]:
    """A press, and its last increment."""
    problem, frames = run(model)
    return problem, frames[-1]
