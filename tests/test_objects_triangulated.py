"""Objects made of triangles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.contact.friction import OPEN
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import MeshObject, ObjectPose, PlacedObject, Sphere
from finger3d.scene import scene_of
from tests.bodies import ball, box
from tests.object_cases import pad, pressed

GEAR = Path(__file__).parents[1] / "geometries" / "gear.stl"


def test_a_mesh_object_stands_on_its_lowest_point() -> None:
    surface = ball(5.0)
    moved = MeshObject(3.0, -2.0, surface=replace(surface, points=surface.points + [7.0, 8.0, 9.0]))
    placed = PlacedObject.of(moved, 0.0)
    assert placed.height(np.array([3.0]), np.array([-2.0]))[0] == pytest.approx(0.0, abs=1e-12)
    assert PlacedObject.of(moved, 0.0, ObjectPose(0.0, 1.0, 0.5)).lowest == pytest.approx((4.0, -1.5))
    distance, normal = placed.distance(np.array([[3.0, -1.0, -2.0], [3.0, 1.0, -2.0]]))
    np.testing.assert_allclose(distance, [1.0, -1.0], atol=2e-2)
    np.testing.assert_allclose(normal, [[0, -1, 0]] * 2, atol=0.1)
    flat = MeshObject(surface=box(4.0, 1.0, 2.0, (1.0, 2.0, 3.0)))  # of many lowest points the middle
    height = flat.profile(np.array([1.99, 2.01]), np.zeros(2))
    assert height[0] == 0.0
    assert np.isnan(height[1])


def test_a_triangulated_ball_presses_like_the_exact_one() -> None:
    exact, _ = pressed(pad(object=Sphere(radius_mm=4.0)))
    meshed, _ = pressed(pad(object=MeshObject(surface=ball(4.0, 60, 120))))
    # facets of 3 degrees lie up to 1.4 um inside, 0.5 % of the depth
    assert meshed["normal_force_N"] == pytest.approx(exact["normal_force_N"], rel=0.01)
    assert abs(meshed["tangential_force_x_N"]) < 1e-10  # symmetric, so the quarter is solved


@pytest.mark.slow
def test_turning_a_mesh_object_and_its_slide_turns_the_result() -> None:
    # A quarter turn about y of a square pad: x becomes z. The mesh is not its own image, so to its accuracy only.
    square = designs()["block"](half_length_mm=3.0, height_mm=3.0, width_mm=6.0)
    surface = replace(ball(4.0), points=ball(4.0).points * [1.8, 1.0, 1.0])
    turned = replace(surface, points=surface.points[:, [2, 1, 0]] * [1.0, 1.0, -1.0])
    options = MeshOptions(0.4, 1.5, "swept")
    legs = (Leg(0.2, steps=1), Leg(0.2, slide_x_mm=0.05, steps=1))
    across = (Leg(0.2, steps=1), Leg(0.2, slide_z_mm=-0.05, steps=1))
    a, _ = pressed(pad(design=square, mesh=options, object=MeshObject(0.5, 0.2, surface=surface), legs=legs))
    b, _ = pressed(pad(design=square, mesh=options, object=MeshObject(0.2, -0.5, surface=turned), legs=across))
    assert b["normal_force_N"] == pytest.approx(a["normal_force_N"], rel=0.03)
    assert b["tangential_force_z_N"] == pytest.approx(-a["tangential_force_x_N"], rel=0.05)


def test_a_ball_has_no_edges_where_contact_ends_and_a_box_has() -> None:
    assert not MeshObject(surface=ball(5.0)).has_edges
    assert MeshObject(surface=box(2.0, 3.0, 4.0)).has_edges
    assert not Sphere(radius_mm=5.0).has_edges


def test_points_in_contact_beside_a_gear_lie_on_its_teeth() -> None:
    # the gap of a point is a mean over samples of the finger's face, some of which are far from any tooth
    scene = scene_of(
        {
            "finger": {"geometry": "block", "half_length_mm": 8.0, "height_mm": 6.0, "width_mm": 6.0},
            "material": {"E_MPa": 1.0, "nu": 0.4}, "friction": {"mu": 2.0}, "press": {"depth_mm": 0.8, "steps": 4},
            "object": {"shape": "mesh", "path": str(GEAR), "x_mm": -1.952}, "model": {"domain": "plane-strain"},
            "mesh": {"size_mm": 0.8, "base_size_mm": 1.6, "mesher": "swept"},
        }
    )  # fmt: skip
    for step in march(build(scene.model())):
        assert step.outcome.ok
        closed = step.state.status != OPEN
        assert closed.any()
        # the tolerance of the iteration, over the depth
        assert np.abs(step.state.gap[closed]).max() <= 1e-8 * step.target.depth_mm
