"""The body of an object, as it is meshed where it is elastic."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.surface import Triangles
from finger3d.objects import Cylinder, HeldBody, MeshObject, PlacedObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.objects.held import CROSSWISE, HALF_TURN, UPSIDE_DOWN
from tests.bodies import ball
from tests.designs import SMALL


def half_ball(radius: float) -> Triangles:
    """The lower half of a ball, closed by its cut."""
    whole = ball(radius, 16, 32)
    lower = whole.points * [1.0, 1.0, 1.0]
    lower[:, 1] = np.minimum(lower[:, 1], 0.0)
    return Triangles(lower, whole.faces)


@pytest.mark.parametrize("turn", [UPSIDE_DOWN, CROSSWISE, HALF_TURN])
def test_a_place_comes_back_from_the_scene(turn: np.ndarray) -> None:
    rng = np.random.default_rng(0)
    body = HeldBody(design=SMALL, turn=turn, origin=rng.normal(size=3), place=rng.normal(size=3))
    points = rng.normal(size=(10, 3))
    assert body.to_design(body.to_scene(points)) == pytest.approx(points, rel=1e-12)
    # the design's top faces down
    assert (body.to_scene(np.eye(3)[1:2]) - body.to_scene(np.zeros((1, 3))))[0] == pytest.approx([0.0, -1.0, 0.0])
    assert body.is_reflected == (turn is UPSIDE_DOWN)
    assert body.is_crosswise == (turn is CROSSWISE)


@pytest.mark.parametrize(
    "obj",
    [
        Cylinder(0.3, radius_mm=4.0),
        Cylinder(0.0, 0.2, radius_mm=4.0, axis="x"),
        Sphere(0.3, -0.2, radius_mm=4.0),
    ],
)
def test_its_contact_face_is_the_surface_of_the_object(obj: RigidObject) -> None:
    held = obj.held_body(SMALL, True)
    assert held is not None
    half = np.array([held.design.half_length_mm, 0.5 * held.design.width_mm])
    x, z = (0.9 * np.random.default_rng(0).uniform(-1.0, 1.0, (40, 2)) * half).T
    top = held.design.top(x, z)
    there = np.isfinite(top)
    at = held.to_scene(np.column_stack([x, top, z])[there])
    # the design stands with its base at y = 0: the object's lowest point is its height below
    at[:, 1] += held.design.height_mm
    distance, _ = PlacedObject.of(obj, 0.0).distance(at)
    assert np.abs(distance).max() < 1e-12


def test_an_endless_object_is_as_long_or_as_wide_as_the_finger() -> None:
    along_z, along_x = (Cylinder(radius_mm=4.0, axis=axis).held_body(SMALL, True) for axis in ("z", "x"))
    assert along_z.design.width_mm == SMALL.width_mm
    assert along_x.design.width_mm == 2.0 * SMALL.half_length_mm
    section = Cylinder(radius_mm=4.0, axis="x").held_body(SMALL, False)
    assert (section.design.height_mm, section.design.half_length_mm) == (4.0, SMALL.half_length_mm)


def test_faces_have_a_block_behind_them_and_bodies_their_own() -> None:
    shapes = (
        Plane(),
        Wedge(angle=0.2),
        Wave(wavelength_mm=3.0, amplitude_mm=0.1),
        Cylinder(radius_mm=1.0),
        Sphere(radius_mm=1.0),
    )
    for obj in shapes:
        assert obj.is_face == (obj.held_body(SMALL, True) is None)
        assert obj.has_section


def test_a_body_of_triangles_is_held_whole_on_its_highest_plane() -> None:
    obj = MeshObject(0.5, -0.25, surface=half_ball(3.0))
    held = obj.held_body(SMALL, True)
    assert held.is_whole
    assert held.mesher == obj.body_mesher == "ftetwild"
    assert not obj.has_section
    assert held.design.height_mm == pytest.approx(3.0)
    # the top of the design, its middle, is the lowest point of the object
    lowest = held.to_scene(np.array([[0.0, held.design.height_mm, 0.0]]))[0]
    assert lowest == pytest.approx([0.5, 0.0, -0.25], abs=1e-9)
