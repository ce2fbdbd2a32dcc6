"""What all rigid objects share."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.objects import Cylinder, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.objects.rigid import Prism, rotation, vertical_frame


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
