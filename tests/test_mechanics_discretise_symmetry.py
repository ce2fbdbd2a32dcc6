"""Symmetry planes of a press, and sums and states of the whole finger from those of its part."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.symmetry import held_dofs, symmetry
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg
from finger3d.objects import Plane, Sphere
from tests.models import block


@pytest.mark.parametrize(
    ("changes", "axes"),
    [
        ({}, ("x", "z")),
        ({"domain": "plane-strain"}, ("x",)),
        ({"legs": (Leg(0.3, slide_x_mm=0.1),)}, ("z",)),
        ({"legs": (Leg(0.3, slide_z_mm=0.1),)}, ("x",)),
        ({"object": Sphere(radius_mm=4.0, x_mm=0.5)}, ("z",)),
        ({"object": Plane(tilt=0.1)}, ("z",)),
        ({"symmetry": ()}, ()),
    ],
)
def test_planes_are_those_of_body_object_and_path(changes: dict[str, object], axes: tuple[str, ...]) -> None:
    assert symmetry(block(**changes)) == axes


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_the_whole_finger_is_the_part_and_its_mirror_images(domain: Domain) -> None:
    problem = build(block(domain=domain))
    frame = list(march(problem))[-1]
    points, whole = problem.points.points, frame.state
    assert np.sum(whole.force[:, 0]) == pytest.approx(problem.symmetry.total(frame.meshed_state.contact.force[:, 0]))
    assert problem.symmetry.total(problem.surface.area) == pytest.approx(problem.points.area.sum())
    at = {tuple(np.round(p, 9)): i for i, p in enumerate(points)}
    mirrored = [at[tuple(np.round(p * [-1.0, 1.0, 1.0], 9) + 0.0)] for p in points]
    assert whole.force[mirrored, 0] == pytest.approx(whole.force[:, 0])
    assert whole.force[mirrored, 1] == pytest.approx(-whole.force[:, 1])
    assert (whole.status[mirrored] == whole.status).all()


def test_points_on_a_symmetry_plane_do_not_move_across_it() -> None:
    problem = build(block())
    held = held_dofs(problem.body.mesh, problem.axes, held_ends=False)
    on_plane = np.flatnonzero(problem.body.mesh.points[:, 0] == 0.0)
    assert set(on_plane * 3) <= set(held)
    row = np.flatnonzero(problem.surface.points[:, 0] == 0.0) * 3 + 1
    assert not set(row) & set(problem.system.active_dofs)
