"""Presses with every second multiplier: the same body and object, seen at fewer points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.accuracy.coarse_multipliers import with_coarse_multipliers
from finger3d.accuracy.estimate import press_numbers
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_geometry import ContactGeometry
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.small_strain.linear_contact import LinearBody, solve_linearised
from finger3d.objects import Move, Sphere, Wave
from tests.models import half_cylinder, swept_fig9

MODELS = {
    "section": half_cylinder(0.2, steps=4),
    "solid": replace(swept_fig9(4.0), legs=(Leg(8.0, steps=3),)),
    "ball on a section": replace(half_cylinder(0.2, steps=3), object=Sphere(radius_mm=20.0)),
    "wave": replace(half_cylinder(0.1, steps=3), object=Wave(amplitude_mm=0.05, wavelength_mm=1.0)),
}


@pytest.mark.parametrize("name", MODELS)
def test_fewer_points_bear_nearly_the_same_press(name: str) -> None:
    model: Model = MODELS[name]
    problem = build(model)
    frames = list(march(problem))
    exact = press_numbers(problem, frames[-1])
    for coarse in with_coarse_multipliers(problem, frames):
        assert 0.25 * len(problem.delassus) < len(coarse.delassus) < 0.8 * len(problem.delassus)
        steps = list(march(coarse))
        assert all(step.outcome.ok for step in steps)
        found = press_numbers(coarse, steps[-1])
        assert found["normal_force_N"] == pytest.approx(exact["normal_force_N"], rel=0.05)
        assert found["friction_sum_N"] != exact["friction_sum_N"]


def test_a_uniform_traction_keeps_its_force_and_its_work() -> None:
    problem = build(MODELS["solid"])
    c, d = problem.delassus.shape[:2]
    for coarse in with_coarse_multipliers(problem, list(march(problem))):
        fine, few = problem.surface.area, coarse.surface.area
        assert few.sum() == pytest.approx(fine.sum(), rel=1e-12)
        loads = [np.zeros((n, d)) for n in (c, len(few))]
        loads[0][:, 0], loads[1][:, 0] = fine, few
        energies = [
            load.ravel() @ one.delassus.reshape(load.size, -1) @ load.ravel()
            for load, one in zip(loads, (problem, coarse), strict=True)
        ]
        assert energies[1] == pytest.approx(energies[0], rel=1e-12)
        # points and their images add up to the whole face
        assert coarse.points.area.sum() == pytest.approx(problem.points.area.sum(), rel=1e-12)


def test_the_gap_of_a_plane_is_exact() -> None:
    problem = build(MODELS["section"])
    target = problem.last_pose
    fine = problem.gap(target)
    for coarse in with_coarse_multipliers(problem, list(march(problem))):
        mean = np.average(coarse.gap(target), weights=coarse.surface.area)
        assert mean == pytest.approx(np.average(fine, weights=problem.surface.area), rel=1e-12)


@pytest.mark.parametrize("name", ["ball on a section", "wave"])
def test_no_distance_from_a_curved_object_is_computed_again(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = build(MODELS[name])
    coarse = list(with_coarse_multipliers(problem, list(march(problem))))
    thing, asked = type(problem.model.object), []
    distance = thing.distance

    def counted(self: object, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        asked.append(len(points))
        return distance(self, points)

    monkeypatch.setattr(thing, "distance", counted)
    for press in coarse:
        assert all(step.outcome.ok for step in march(press))
    assert len(asked) == len(coarse)  # at rest, once a press


@pytest.mark.parametrize("name", ["ball on a section", "wave"])
def test_an_increment_linearised_about_its_own_solution_is_that_solution(name: str) -> None:
    problem = build(MODELS[name])
    start, after = formulation_of(problem.model).start(problem), list(march(problem))[0]
    pose, state = after.parts[0]
    contact, moved = state.contact, state.body
    own = ContactGeometry(contact.gap, np.ones(len(contact.gap)), np.zeros_like(moved), contact.bases)
    known = replace(problem, contact_geometry={pose: (own, moved)})
    body = LinearBody(problem.delassus, np.zeros_like(moved))
    found = solve_linearised(known, start, Move(problem.origin, pose), body, None)
    assert found.outcome.ok
    assert found.state.contact.force == pytest.approx(contact.force, abs=1e-6 * np.abs(contact.force).max())
