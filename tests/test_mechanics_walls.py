"""Contact on walls and ends: creases, symmetry, slides into a side, and candidates on every face."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.contact.friction import OPEN, Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.mesh.simplex import FREE_FACES
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.postprocess.penetration import check_surface
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, MeshObject, Plane, Sphere
from tests.bodies import channel, write_stl
from tests.models import block, fig9

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
    problem = build(in_slot())
    *_, end = march(problem)
    assert end.outcome.ok
    assert set(problem.points.face) == {0, WALLS}
    nu, strain = 0.3, 0.2 / 3.0
    vertical = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) * strain
    pressure = end.state.force[:, 0] / problem.points.area
    # the slot is open over the lowest 0.05 mm of 3 mm, and has a clearance of 1e-5 mm
    np.testing.assert_allclose(pressure[problem.points.face == 0], vertical, rtol=1e-3)
    np.testing.assert_allclose(pressure[problem.points.face == WALLS], nu / (1.0 - nu) * vertical, rtol=5e-3)


def test_a_vertex_on_a_crease_is_a_point_of_each_face() -> None:
    surface = build(in_slot()).surface
    rim = surface.nodes[(surface.face == WALLS) & (surface.points[:, 1] == 3.0)]
    assert len(rim) == 1
    first, second = np.flatnonzero(surface.nodes == rim[0])
    assert {surface.face[first], surface.face[second]} == {0, WALLS}
    normals = {int(surface.face[k]): surface.normals[k] for k in (first, second)}
    np.testing.assert_allclose(normals[0], [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(normals[WALLS], [1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_the_part_between_symmetry_planes_is_the_whole(friction: float) -> None:
    slot = MeshObject(surface=channel(8.02, 2.0, 3.0))
    model = in_slot(object=slot, domain="solid", friction=Coulomb(friction), mesh=MeshOptions(1.0, 1.5, "swept"))
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
    problem = build(effect.apply(model) if effect else model)
    steps = list(march(problem))
    assert all(step.outcome.ok for step in steps)
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
    problem = build(model)
    *_, end = march(problem)
    assert end.outcome.ok
    assert set(problem.points.face) == {0, WALLS, ENDS}
    force = problem.world_force(end.meshed_state.contact).sum(axis=0)
    # the corner is pushed inwards along both axes, from the ball's middle
    assert force[0] < 0.0
    assert force[2] < 0.0
    assert force[1] < 0.0


def test_contact_csv_names_the_face(tmp_path: Path) -> None:
    import csv

    write_stl(tmp_path / "slot.stl", channel(8.1, 2.0, 3.0))
    (tmp_path / "scene.toml").write_text(
        """
        [finger]
        geometry = "block"
        half_length_mm = 4.0
        height_mm = 3.0
        width_mm = 4.0
        [material]
        E_MPa = 1.0
        nu = 0.45
        [object]
        shape = "mesh"
        path = "slot.stl"
        [press]
        depth_mm = 0.3
        steps = 3
        [model]
        domain = "plane-strain"
        [mesh]
        size_mm = 0.5
        base_size_mm = 0.5
        """,
        encoding="utf-8",
    )
    out = tmp_path / "out"
    assert main(["press", str(tmp_path / "scene.toml"), "--out", str(out), "--no-figures", "--no-error"]) == 0
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
    problem = build(body)
    steps = list(march(problem))
    forces = [measure(problem.points, step)["normal_force_N"] for step in steps[1:]]
    assert all(step.outcome.ok for step in steps)
    assert forces == pytest.approx([forces[0]] * len(forces), rel=0.02)  # the block is finite
    assert max(check.penetration_mm for check in check_surface(problem, steps)) < 0.02 * depth
