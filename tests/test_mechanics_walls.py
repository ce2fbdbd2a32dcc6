"""Objects that touch walls and ends, or pass the finger."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.large_deformation import Effect
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError, Outcome, UnresolvedError
from finger3d.fem.mesh import FREE_FACES
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.objects import Cylinder, MeshObject, Plane, RigidObject, Sphere, Wave
from tests.bodies import ball, box, channel, write_stl
from tests.models import block, ended, fig9, last, run
from tests.scenes import BLOCK, changed, written

WALLS, ENDS = FREE_FACES.index("walls"), FREE_FACES.index("ends")
CLEARANCE = 1e-5


def in_slot(**changes: object) -> Model:
    """A block in a slot as long as the block is high, but for the strip that the slot goes down and a little more."""
    slot = MeshObject(surface=channel(8.0 + 2.0 * CLEARANCE, 2.75, 3.0))
    model = block(
        object=slot, friction=Coulomb(0.0), legs=(Leg(0.2, steps=2),), mesh=MeshOptions(0.8, 0.8, "swept"),
        domain="plane-strain",
    )  # fmt: skip
    return replace(model, **changes)


def test_a_confined_block_is_compressed_uniaxially() -> None:
    """Without friction strain is uniform, u_x = 0: pressures are M eps and nu/(1 - nu) of it (Hooke's law)."""
    problem, end = ended(in_slot())
    assert set(problem.points.face) == {0, WALLS}
    nu, strain = 0.3, 0.2 / 3.0
    vertical = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) * strain
    pressure = end.state.force[:, 0] / problem.points.area
    # the slot is open over the lowest 0.05 mm of 3 mm, and has a clearance of 1e-5 mm
    np.testing.assert_allclose(pressure[problem.points.face == 0], vertical, rtol=1e-3)
    np.testing.assert_allclose(pressure[problem.points.face == WALLS], nu / (1.0 - nu) * vertical, rtol=5e-3)


def test_the_part_between_symmetry_planes_is_the_whole() -> None:
    slot = MeshObject(surface=channel(8.02, 2.0, 3.0))
    model = in_slot(object=slot, domain="solid", friction=Coulomb(0.4), mesh=MeshOptions(1.0, 1.5, "swept"))
    part, whole = build(model), build(replace(model, symmetry=()))
    assert part.axes == ("x", "z")
    found = []
    for problem in (part, whole):
        *_, end = march(problem)
        assert end.outcome.ok
        found.append(measure(problem.points, end))
        assert (end.state.status[problem.points.face == WALLS] != OPEN).any()
    for name in ("normal_force_N", "friction_sum_N", "contact_area_mm2", "contact_half_length_mm"):
        assert found[0][name] == pytest.approx(found[1][name], rel=1e-6)
    assert np.isin(part.points.nodes[part.points.face == WALLS], part.points.nodes[part.points.face == 0]).any()


@pytest.mark.parametrize("effect", [None, Effect()], ids=["small strain", "large deformation"])
def test_a_slot_that_slides_pushes_the_wall(effect: Effect | None) -> None:
    """With 1 mm of clearance the wall touches after a slide of less than that, and the push grows from there."""
    slot = MeshObject(surface=channel(102.0, 20.0))
    legs = (Leg(2.0, steps=2), Leg(2.0, slide_x_mm=4.0, steps=8))
    model = fig9(object=slot, mesh=MeshOptions(2.0, 8.0, "swept"), legs=legs, domain="plane-strain", gauges=())
    problem, steps = run(effect.apply(model) if effect else model)
    on_walls = [(step.state.status[problem.points.face == WALLS] != OPEN).any() for step in steps]
    first = on_walls.index(True)
    assert 2 <= first <= 4
    assert all(on_walls[first:])
    table = [measure(problem.points, step) for step in steps]
    pushes = [row["force_x_N"] for row in table]
    wall = [
        problem.world_force(step.meshed_state.contact)[problem.points.face == WALLS, 0].sum() for step in steps[first:]
    ]
    assert all(b > a for a, b in zip(wall, wall[1:], strict=False))
    assert pushes[-1] > wall[-1] > 10.0  # the friction on the contact face pushes the same way
    checks = check_surface(problem, steps)
    assert all(check.within_candidates for check in checks)
    # the slot's mouth is a sharp edge between points 2 mm apart
    assert max(check.penetration_mm for check in checks) < 0.15 * 2.0


def test_a_plane_above_the_finger_has_no_candidates_on_its_walls() -> None:
    """A press on a plane costs what it costs without walls."""
    for domain in ("plane-strain", "solid"):
        problem = build(block(object=Plane(), domain=domain))
        assert set(problem.points.face) == {0}


def test_a_ball_over_the_rim_touches_contact_face_wall_and_end() -> None:
    ball = Sphere(5.0, 3.0, radius_mm=3.0)
    model = block(object=ball, mesh=MeshOptions(0.4, 1.0, "swept"), legs=(Leg(1.0, steps=4),))
    problem, end = ended(model)
    assert set(problem.points.face) == {0, WALLS, ENDS}
    force = problem.world_force(end.meshed_state.contact).sum(axis=0)
    # the corner is pushed inwards along both axes, from the ball's middle
    assert force[0] < 0.0
    assert force[2] < 0.0
    assert force[1] < 0.0


def test_contact_csv_names_the_face(tmp_path: Path) -> None:
    import csv

    write_stl(tmp_path / "slot.stl", channel(8.1, 2.0, 3.0))
    body = {"half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 4.0, "nu": 0.45, "x_mm": 1.0, "y_mm": 1.5}
    text = changed(BLOCK, **body, depth_mm=0.3, steps=3, size_mm=0.5, base_size_mm=0.5)
    scene = written(tmp_path, text + '[object]\nshape = "mesh"\npath = "slot.stl"\n')
    out = tmp_path / "out"
    assert main(["press", str(scene), "--out", str(out), "--no-figures", "--no-error"]) == 0
    with (out / "contact.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["face"] for row in rows} == {"contact", "walls"}
    walls = [row for row in rows if row["face"] == "walls" and row["status"] != "open"]
    assert walls
    normals = sorted(abs(float(row["normal_x"])) for row in walls)
    assert normals[-1] == pytest.approx(1.0, abs=1e-9)
    assert normals[0] > 0.5  # at the edge of the slot's mouth
    steps = json.loads((out / "summary.json").read_text(encoding="utf-8"))["steps"]
    with (out / "history.csv").open(encoding="utf-8", newline="") as stream:
        history = list(csv.DictReader(stream))
    for step, row in zip(steps, history, strict=True):
        assert 0.0 <= step["largest_penetration_mm"] < 0.1
        assert float(row["largest_penetration_mm"]) == pytest.approx(step["largest_penetration_mm"], rel=1e-6)


def test_a_cylinder_that_rolls_on_keeps_its_force() -> None:
    """Its reference point, lowest at first, rises by R (1 - cos t), so that the depth becomes negative."""
    radius, depth, path = 10.0, 0.05, [Leg(0.05, steps=2)]
    for k in range(1, 9):
        t = -0.025 * k
        slide = radius * (np.sin(t) - t)
        path.append(Leg(depth - radius * (1.0 - np.cos(t)), slide_x_mm=slide, turn_z=t, steps=1))
    assert path[-1].depth_mm < -0.1
    body = block(
        object=Cylinder(-1.0, radius_mm=radius), legs=tuple(path), friction=Coulomb(0.0), domain="plane-strain",
        mesh=MeshOptions(0.1, 1.0, "swept"),
    )  # fmt: skip
    problem, steps = run(body)
    forces = [measure(problem.points, step)["normal_force_N"] for step in steps[1:]]
    assert forces == pytest.approx([forces[0]] * len(forces), rel=0.02)  # the block is finite
    assert max(check.penetration_mm for check in check_surface(problem, steps)) < 0.02 * depth


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
@pytest.mark.parametrize("shape", [Cylinder, Sphere])
def test_one_increment_beyond_the_radius_presses_as_many_do(shape: type[RigidObject], finite: bool) -> None:
    obj = shape(radius_mm=1.0)
    once, often = (last(section(obj, Leg(2.4, steps=n), finite=finite))["normal_force_N"] for n in (1, 12))
    assert once == pytest.approx(often, rel=0.02)
    assert once > 2.0


def test_a_slide_over_more_than_a_ball_presses_as_a_slide_in_many_increments_does() -> None:
    ball_07 = Sphere(radius_mm=0.7)
    once, often = (last(section(ball_07, Leg(0.5, steps=n), Leg(0.5, slide_x_mm=3.0, steps=n))) for n in (1, 4))
    assert once["normal_force_N"] == pytest.approx(often["normal_force_N"], rel=0.1)
    assert once["tangential_force_x_N"] == pytest.approx(often["tangential_force_x_N"], rel=0.1)


@pytest.mark.parametrize("thickness", [0.4, 1.5])
def test_a_closed_plate_presses_as_a_thick_one_whatever_its_thickness(thickness: float) -> None:
    thick, thin = (
        last(section(MeshObject(surface=box(6.0, t, 40.0)), Leg(1.0, steps=1)))["normal_force_N"]
        for t in (6.0, thickness)
    )
    assert thin == pytest.approx(thick, rel=1e-3)


def test_a_foil_whose_edges_cut_through_between_the_points_is_not_converged() -> None:
    *_, end = march(build(section(MeshObject(surface=box(6.0, 1e-3, 40.0)), Leg(1.0, steps=1))))
    assert end.outcome is Outcome.PASSED_THROUGH
    assert not end.outcome.ok


def test_a_ball_pressed_to_its_radius_pushes_a_solid() -> None:
    mesh = MeshOptions(0.5, 1.5, "swept")
    pressed = [last(block(object=Sphere(radius_mm=1.0), legs=(Leg(1.0, steps=n),), mesh=mesh)) for n in (1, 8)]
    assert pressed[0]["normal_force_N"] == pytest.approx(pressed[1]["normal_force_N"], rel=0.02)
    assert pressed[0]["normal_force_N"] > 0.5


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
