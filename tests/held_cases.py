"""A block that is pressed with a force, and held by tangential ones."""

from __future__ import annotations

from dataclasses import replace

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model

N, MU = 0.2, 0.25
PRESS = Leg(0.2, steps=2, force_N=N, duration_s=1.0)


def held(force_x: float, force_z: float | None = None, **changes: object) -> Leg:
    return replace(PRESS, force_x_N=force_x, force_z_N=force_z, **changes)


def pressed(model: Model) -> tuple[list[StepResult], list[dict[str, float]]]:
    problem = build(replace(model, friction=Coulomb(MU) if type(model.friction) is Coulomb else model.friction))
    steps = list(march(problem))
    return steps, [measure(problem.points, step) for step in steps]


def numbers(model: Model) -> list[dict[str, float]]:
    steps, out = pressed(model)
    assert all(step.outcome.ok and step.residual <= 1e-8 for step in steps), steps[-1].detail
    return out
