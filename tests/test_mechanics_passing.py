"""Objects that could pass through the finger within an increment, and fingers through thin objects."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError, Outcome, UnresolvedError
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.passing import moves_too_far, passes_through
from finger3d.objects import Cylinder, MeshObject, Move, ObjectPose, Plane, RigidObject, Sphere, Wave
from tests.bodies import ball, box
from tests.models import block, last


def section(obj: RigidObject, *legs: Leg, finite: bool = False, **changes: object) -> Model:
    """A block, 12 x 8 mm, in plane strain."""
    body = designs()["block"](half_length_mm=6.0, height_mm=8.0, width_mm=5.0)
    model = block(
        design=body, object=obj, legs=legs, domain="plane-strain", mesh=MeshOptions(0.4, 2.0, "swept"),
        friction=Coulomb(0.5),
    )  # fmt: skip
    model = replace(model, **changes)
    return LargeDeformation().apply(model) if finite else model


@pytest.mark.parametrize("finite", [False, True])
@pytest.mark.parametrize(("radius", "depth"), [(1.0, 1.2), (1.0, 2.4), (2.0, 2.4)])
@pytest.mark.parametrize("shape", [Cylinder, Sphere])
def test_one_increment_beyond_the_radius_presses_as_many_do(
    shape: type[RigidObject], radius: float, depth: float, finite: bool
) -> None:
    obj = shape(radius_mm=radius)
    once, often = (last(section(obj, Leg(depth, steps=n), finite=finite))["normal_force_N"] for n in (1, 12))
    assert once == pytest.approx(often, rel=0.02)
    assert once > 2.0


@pytest.mark.parametrize("finite", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_slide_over_more_than_a_ball_presses_as_a_slide_in_many_increments_does(finite: bool) -> None:
    ball_07 = Sphere(radius_mm=0.7)
    once, often = (
        last(section(ball_07, Leg(0.5, steps=n), Leg(0.5, slide_x_mm=3.0, steps=n), finite=finite)) for n in (1, 4)
    )
    assert once["normal_force_N"] == pytest.approx(often["normal_force_N"], rel=0.1)
    assert once["tangential_force_x_N"] == pytest.approx(often["tangential_force_x_N"], rel=0.1)


@pytest.mark.parametrize("thickness", [0.4, 1.1, 1.5])
def test_a_closed_plate_presses_as_a_thick_one_whatever_its_thickness(thickness: float) -> None:
    thick, thin = (
        last(section(MeshObject(surface=box(6.0, t, 40.0)), Leg(1.0, steps=1)))["normal_force_N"]
        for t in (6.0, thickness)
    )
    assert thin == pytest.approx(thick, rel=1e-3)


@pytest.mark.parametrize("thickness", [1e-4, 1e-3])
def test_a_foil_whose_edges_cut_through_between_the_points_is_not_converged(thickness: float) -> None:
    *_, end = march(build(section(MeshObject(surface=box(6.0, thickness, 40.0)), Leg(1.0, steps=1))))
    assert end.outcome is Outcome.PASSED_THROUGH
    assert not end.outcome.ok


def test_a_ball_pressed_to_its_radius_pushes_a_solid() -> None:
    mesh = MeshOptions(0.5, 1.5, "swept")
    pressed = [last(block(object=Sphere(radius_mm=1.0), legs=(Leg(1.0, steps=n),), mesh=mesh)) for n in (1, 8)]
    assert pressed[0]["normal_force_N"] == pytest.approx(pressed[1]["normal_force_N"], rel=0.02)
    assert pressed[0]["normal_force_N"] > 0.5


def test_increments_are_cut_only_where_the_object_moves_by_half_its_mean_chord() -> None:
    # the mean chord of a circle is pi R / 2
    problem = build(section(Cylinder(radius_mm=2.0), Leg(1.0, steps=1)))
    gap, still = np.zeros(len(problem.surface.nodes)), np.zeros_like(problem.surface.points)
    for depth, far in ((0.49 * math.pi, False), (0.51 * math.pi, True)):
        carried = still + [0.0, -depth]
        assert moves_too_far(problem, Move(ObjectPose(0.0), ObjectPose(depth)), gap, carried) == far
        assert not moves_too_far(problem, Move(ObjectPose(0.0), ObjectPose(depth)), gap + 4.0, carried)  # out of reach
    assert moves_too_far(problem, Move(ObjectPose(1.0), ObjectPose(1.0, turn_z=0.6)), gap, still)
    plane = build(section(Plane(), Leg(1.0, steps=1)))
    assert not moves_too_far(plane, Move(ObjectPose(0.0), ObjectPose(5.0)), gap[:0], still[:0])


def test_a_point_that_ends_at_the_far_face_or_beyond_has_passed_through() -> None:
    plate = MeshObject(surface=box(6.0, 0.02, 40.0))
    problem = build(section(plate, Leg(1.0, steps=1)))
    count = len(problem.surface.nodes)
    gap, rest = np.zeros(count), np.zeros((count, 2))
    under = problem.surface.points[:, 0] == np.abs(problem.surface.points[:, 0]).min()
    move = Move(ObjectPose(0.0), ObjectPose(1.0))
    for height, through in ((-1.0, False), (-0.98, True), (-0.5, True), (0.0, True)):
        after = np.where(under[:, None], [0.0, height], [0.0, -1.0])
        assert passes_through(problem, move, rest, after, gap) == through
    # from above the first touch, too: the path is followed, however thin the object is
    apart = np.where(under[:, None], [0.0, -0.2], [0.0, -1.0])
    assert passes_through(problem, move, apart, np.where(under[:, None], 0.0, apart), gap + 0.2)


def test_mean_chords_are_volume_over_projected_area() -> None:
    down, tilted = np.array([0.0, -1.0, 0.0]), np.array([0.6, -0.8, 0.0])
    plate = MeshObject(surface=box(6.0, 0.5, 40.0))
    assert plate.mean_chord(down) == pytest.approx(0.5)
    assert plate.mean_chord(tilted) == pytest.approx(6.0 * 0.5 / (0.8 * 6.0 + 0.6 * 0.5))
    assert Sphere(radius_mm=3.0).mean_chord(tilted) == pytest.approx(4.0)
    assert MeshObject(surface=ball(3.0)).mean_chord(down) == pytest.approx(4.0, rel=0.01)
    assert Cylinder(radius_mm=3.0).mean_chord(down) == pytest.approx(1.5 * math.pi)
    assert Cylinder(radius_mm=3.0, axis="x").mean_chord(tilted) == pytest.approx(1.5 * math.pi / 0.8)
    assert Wave(wavelength_mm=4.0, amplitude_mm=0.2).mean_chord(down) == math.inf


def test_a_blade_that_no_contact_point_sees_is_refused_with_an_edge_length_that_feels_it() -> None:
    body = designs()["block"](half_length_mm=5.0, height_mm=5.0, width_mm=5.0)
    blade = MeshObject(surface=box(0.5, 10.0, 20.0))
    with pytest.raises(UnresolvedError) as refused:
        build(block(design=body, object=blade, legs=(Leg(1.0, steps=2),), mesh=MeshOptions(1.5, 1.5, "swept")))
    size = refused.value.size_mm
    assert size is not None
    assert f"mesh.size_mm = {size:g} resolves it" in str(refused.value)
    pressed = last(block(design=body, object=blade, legs=(Leg(1.0, steps=2),), mesh=MeshOptions(size, 2.0, "swept")))
    assert pressed["normal_force_N"] > 0.0


def test_a_half_space_that_reaches_the_base_is_refused() -> None:
    with pytest.raises(Finger3dError, match=r"turned by 0, 0, 50 deg.* reaches the finger's base") as refused:
        build(section(Plane(), Leg(1.0, steps=2), Leg(1.0, turn_z=2.0 * math.pi, steps=4)))
    assert refused.value.exit_code == 2
    # a corner of the base, 6 mm beside the middle and 7 mm below the plane, is reached at atan(7 / 6)
    reached = math.atan2(7.0, 6.0)
    build(section(Plane(), Leg(1.0, steps=2), Leg(1.0, turn_z=reached - 0.01, steps=4)))
    with pytest.raises(Finger3dError, match="reaches the finger's base"):
        build(section(Plane(), Leg(1.0, steps=2), Leg(1.0, turn_z=reached + 0.01, steps=4)))


def test_a_cylinder_that_is_turned_over_is_turned_in_parts() -> None:
    pressed = [
        last(section(Cylinder(radius_mm=2.0), Leg(0.5, steps=1), Leg(0.5, turn_z=0.5 * math.pi, steps=n)))
        for n in (1, 8)
    ]
    assert pressed[0]["normal_force_N"] == pytest.approx(pressed[1]["normal_force_N"], rel=0.02)


@pytest.mark.parametrize("obj", [Sphere(radius_mm=0.7), Cylinder(radius_mm=0.7)])
def test_no_depth_beyond_the_half_that_is_held(obj: RigidObject) -> None:
    effect = ElasticObject(0.2, 0.45)
    effect.apply(section(obj, Leg(0.69, steps=2)))
    with pytest.raises(Finger3dError, match=r"press.depth_mm = 0.71: deeper .* held 0.7 mm above"):
        effect.apply(section(obj, Leg(0.71, steps=2)))
    effect.apply(section(Plane(), Leg(0.71, steps=2)))
