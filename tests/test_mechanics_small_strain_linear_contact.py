"""Contact of a linear body along the normals of the object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.state import ContactState
from finger3d.fem.tensors import bases_of, rotated_delassus
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.generalised import GeneralisedForces
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.mechanics.results.history import measure
from finger3d.mechanics.small_strain.linear_contact import LinearBody, carried_by_object, transported
from finger3d.objects import Move, ObjectPose, Plane, Sphere, vertical_frame
from tests.contact_cases import random_compliance
from tests.models import block, run


def directions(count: int, dim: int, seed: int = 0) -> np.ndarray:
    normal = np.random.default_rng(seed).normal(size=(count, dim))
    return bases_of(normal / np.linalg.norm(normal, axis=1)[:, None])


@pytest.mark.parametrize("dim", [2, 3])
def test_displacements_follow_forces_along_any_directions(dim: int) -> None:
    rng, bases = np.random.default_rng(0), directions(6, dim)
    delassus, past, force = random_compliance(rng, 6, dim), rng.normal(size=(6, dim)), rng.normal(size=(6, dim))
    force[4:] = 0.0  # the last points do not touch
    body = LinearBody(delassus, past)
    frame = vertical_frame(dim)
    upright = np.einsum("ca,cak->ck", force, bases) @ frame.T
    wanted = (past + np.einsum("idjk,jk->id", delassus, upright)) @ frame
    assert body.displacement(force, bases) == pytest.approx(wanted, rel=1e-10)
    # the same compliance, of some points and along their directions
    points = np.array([0, 2, 3])
    rotations = bases[points] @ frame.T
    own = rotated_delassus(delassus, rotations, points)
    alone = np.zeros_like(force)
    alone[points] = force[points]
    moved = (body.displacement(alone, bases) - past @ frame)[points]
    assert np.einsum("idjk,jk->id", own, force[points]) == pytest.approx(
        np.einsum("cak,ck->ca", bases[points], moved), rel=1e-10
    )


def test_a_transported_state_keeps_the_length_of_its_tangential_vectors_under_a_turn_about_the_normal() -> None:
    rng, bases = np.random.default_rng(1), directions(5, 3)
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    turned = bases.copy()
    turned[:, 1], turned[:, 2] = c * bases[:, 1] + s * bases[:, 2], -s * bases[:, 1] + c * bases[:, 2]
    rest = ContactState.at_rest(np.zeros(5), 3)
    state = ContactState(
        rest.status, rng.normal(size=(5, 3)), rest.gap, rng.normal(size=(5, 2)), rng.normal(size=(5, 2)), bases
    )
    after = transported(state, turned)
    assert after.scene_force == pytest.approx(state.scene_force)
    lengths = np.linalg.norm(state.tangential_displacement, axis=1)
    assert np.linalg.norm(after.tangential_displacement, axis=1) == pytest.approx(lengths)
    assert transported(state, bases) is state
    assert transported(after, bases).accumulated_slip == pytest.approx(state.accumulated_slip)


def test_the_object_carries_points_by_its_slide_and_its_turn() -> None:
    problem = build(block(mesh=MeshOptions(2.0, 2.0, "swept")))
    at = np.zeros_like(problem.surface.points)
    slid = carried_by_object(problem, Move(ObjectPose(0.1), ObjectPose(0.3, 0.5, -0.25)), at)
    assert np.allclose(slid, [0.5, -0.2, -0.25])
    angle = 0.2
    turned = carried_by_object(problem, Move(ObjectPose(0.1), ObjectPose(0.1, turn_y=angle)), at)
    # the mean over each hat of the turn that brought the object's material there, about the vertical in the middle
    x, z = problem.surface.samples[:, 0], problem.surface.samples[:, 2]
    c, s = 1.0 - np.cos(angle), np.sin(angle)
    mean = problem.surface.average @ np.stack([c * x + s * z, 0.0 * x, c * z - s * x], axis=1)
    assert turned == pytest.approx(mean, abs=1e-12)


@pytest.mark.parametrize("thing", [Sphere(radius_mm=4.0), Plane()], ids=["ball", "plane"])
def test_an_increment_to_a_force_ends_at_the_depth_that_has_it(thing: Sphere | Plane) -> None:
    problem, frames = run(block(object=thing, legs=(Leg(0.2, steps=1), Leg(0.2, slide_x_mm=0.3, steps=1))))
    wanted = measure(problem.points, frames[1])["normal_force_N"]
    workspace = formulation_of(problem.model).workspace()
    # the iteration begins a fifth of the depth off
    move = Move(frames[0].target, replace(frames[1].target, depth_mm=0.24))
    force = GeneralisedForces((0,), np.array([wanted]), wanted)
    formulation = formulation_of(problem.model)
    solution = formulation.increment(problem, frames[0].meshed_state, move, None, workspace, force)
    there, _ = solution.state.last
    # both geometries are exact to 1e-9 of the depth
    assert there.end.depth_mm == pytest.approx(0.2, rel=1e-8)
    assert solution.state.contact.force == pytest.approx(frames[1].meshed_state.contact.force, abs=1e-7 * wanted)
    assert solution.state.body == pytest.approx(frames[1].meshed_state.body, abs=1e-8)
    assert -problem.world_force(solution.state.contact)[:, 1].sum() == pytest.approx(wanted, rel=1e-10)
