"""What all rigid objects share, and the body of an elastic one."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.geometry.surface import Triangles
from finger3d.objects import Cylinder, HeldBody, MeshObject, PlacedObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.objects.rigid import CROSSWISE, HALF_TURN, UPSIDE_DOWN, Prism, rotation, vertical_frame
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


def test_turns_are_about_fixed_axes_x_first() -> None:
    quarter = 0.5 * np.pi
    # y goes to z about x, and z to x about y
    assert rotation(quarter, quarter, 0.0) @ [0.0, 1.0, 0.0] == pytest.approx([1.0, 0.0, 0.0], abs=1e-15)
    assert rotation(0.0, 0.0, quarter) @ [1.0, 0.0, 0.0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    turned = rotation(0.3, -0.7, 1.1)
    assert turned @ turned.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.array_equal(rotation(0.0, 0.0, 0.0), np.eye(3))


@pytest.mark.parametrize("dim", [2, 3])
def test_an_upright_object_presses_down(dim: int) -> None:
    frame = vertical_frame(dim)
    assert np.array_equal(frame[0], -np.eye(dim)[1])
    assert np.array_equal(frame @ frame.T, np.eye(dim))
    assert np.linalg.det(frame) == pytest.approx(1.0)


@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("kind", [Cylinder, Wave, Wedge])
def test_a_prism_is_the_same_all_along_its_axis(kind: type[Prism], axis: str) -> None:
    sizes = {Cylinder: {"radius_mm": 3.0}, Wave: {"wavelength_mm": 2.0, "amplitude_mm": 0.3}, Wedge: {"angle": 0.3}}
    obj = kind(axis=axis, **sizes[kind])
    points = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 3))
    value, gradient = obj.distance(points)
    moved, same = obj.distance(points + 5.0 * obj.direction)
    assert moved == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert same == pytest.approx(gradient, rel=1e-9, abs=1e-9)
    assert gradient @ obj.direction == pytest.approx(np.zeros(20))
    drawn = obj.drawing(1.0)
    assert np.abs(obj.distance(drawn.points)[0]).max() < 1e-12
    assert obj.is_level(np.eye(3))
    assert not obj.is_level(rotation(0.1, 0.0, 0.0) if axis == "z" else rotation(0.0, 0.0, 0.1))


@pytest.mark.parametrize("obj", [Plane(), Cylinder(radius_mm=2.0), Sphere(radius_mm=2.0)])
def test_a_pose_counts_as_turned_only_where_it_changes_the_body(obj: RigidObject) -> None:
    turned = type(obj)(**{**vars(obj), "turn_y": 0.2})
    assert not obj.is_turned
    assert turned.is_turned == (not isinstance(obj, Sphere))
