"""The adjoint of a press: its loads predict what a small change of the Delassus operator does to every number."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.adjoint import adjoint_loads, forces_of, press_goals
from finger3d.accuracy.estimate import press_numbers
from finger3d.contact.friction import Coulomb, TwoCoefficients
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, Model
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.objects import Sphere
from tests.models import half_cylinder, swept_fig9

SMALL = 1e-6
"""Relative change of the Delassus operator: active sets stay, and round-off of the press is far below."""


def with_readings(model: Model) -> Model:
    high = model.design.height_mm
    return replace(
        model,
        gauges=(Gauge("g", 0.3 * high, 0.7 * high, angle=0.5),),
        markers=(Marker("m", 0.2 * high, 0.6 * high),),
        taxels=(Taxel("t", 0.0, 0.0, 0.4 * high, 0.4 * model.design.width_mm),),
    )


def sliding(model: Model) -> Model:
    depth = model.legs[0].depth_mm
    return replace(model, legs=(Leg(depth, steps=3), Leg(depth, slide_x_mm=0.1 * depth, steps=3)))


PLAIN = TwoCoefficients(0.25, 1.0, "keep")
"""Coulomb's law by one with two equal coefficients, under which sections keep increments."""

MODELS = {
    "section": with_readings(replace(half_cylinder(0.5, steps=4), friction=PLAIN)),
    "section without friction": with_readings(replace(half_cylinder(0.5, steps=4), friction=Coulomb(0.0))),
    "section that slides": with_readings(replace(sliding(half_cylinder(0.5)), friction=PLAIN)),
    "solid": with_readings(replace(swept_fig9(8.0, mu=0.3), legs=(Leg(8.0, steps=3),))),
    "solid that slides": with_readings(sliding(replace(swept_fig9(8.0, mu=0.3), legs=(Leg(8.0),)))),
}


def perturbed(problem: Problem, change: np.ndarray) -> Problem:
    c, d = problem.delassus.shape[:2]
    matrix = problem.delassus + change.reshape(c, d, c, d)
    return replace(problem, system=replace(problem.system, delassus=matrix))


def test_the_results_of_an_exact_path_predict_it_to_a_fifth() -> None:
    # they count as increments: friction is held where points touch, which a change of the operator moves
    found, expected, before = changes(with_readings(half_cylinder(0.5, steps=4)))
    for name in ("normal_force_N", "friction_sum_N", "external_work_mJ", "gauge_g"):
        assert found[name] == pytest.approx(expected[name], rel=0.2, abs=1e-3 * SMALL * abs(before[name])), name


@pytest.mark.parametrize("name", MODELS)
def test_loads_predict_the_effect_of_a_change_of_the_delassus_operator(name: str) -> None:
    model = MODELS[name]
    found, expected, before = changes(model)
    for key, value in expected.items():
        # second order in the change; the dissipation counts the slip along the friction at the end of an increment
        within = 1e-2 if key == "dissipation_mJ" and model.domain == "solid" else 1e-3
        assert found[key] == pytest.approx(value, rel=within, abs=1e-3 * SMALL * abs(before[key])), key


def changes(model: Model) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Changes of all numbers by a change of the Delassus operator, as predicted by the loads, and numbers before it."""
    problem = build(model)
    c, d = problem.delassus.shape[:2]
    matrix = problem.delassus.reshape(c * d, c * d)
    random = np.random.default_rng(3).normal(size=(c * d, 4))
    moves = np.zeros(c * d, dtype=bool)
    moves[problem.system.active_dofs] = True
    random[~moves] = 0.0  # symmetry holds these directions
    change = SMALL * np.diag(matrix).mean() * random @ random.T
    steps = list(march(problem))
    goals = press_goals(problem, steps)
    loads, forces = adjoint_loads(problem, steps, goals), forces_of(problem, steps)
    predicted = np.einsum("kcg,cd,dk->g", loads, change, forces)
    before = press_numbers(problem, steps[-1])
    after = press_numbers(problem, list(march(perturbed(problem, change)))[-1])
    names = [goal.name for goal in goals]
    found = {name: after[name] - before[name] for name in names}
    return found, dict(zip(names, predicted, strict=True)), before


def test_normals_of_a_curved_object_are_held() -> None:
    model = with_readings(replace(half_cylinder(0.4, steps=3), object=Sphere(radius_mm=20.0)))
    problem = build(model)
    steps = list(march(problem))
    goals = press_goals(problem, steps)
    change = SMALL * problem.delassus.reshape(problem.delassus.shape[0] * 2, -1)
    predicted = np.einsum("kcg,cd,dk->g", adjoint_loads(problem, steps, goals), change, forces_of(problem, steps))
    after = press_numbers(perturbed(problem, change), list(march(perturbed(problem, change)))[-1])
    force = after["normal_force_N"] - press_numbers(problem, steps[-1])["normal_force_N"]
    # normals turn by the displacements over the radius, some per cent
    assert force == pytest.approx(predicted[0], rel=0.1)
