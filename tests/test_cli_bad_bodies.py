"""Bad bodies as a user meets them: the command ends with code 2 and one line, at once."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.geometry.surface import Triangles
from tests.bodies import ball, box, channel, write_stl

SCENE = """[finger]
geometry = {finger}
[material]
E_MPa = 1.0
nu = 0.3
[press]
depth_mm = 0.5
[object]
{object}
[mesh]
size_mm = {size}
"""
PAD = '"block"\nhalf_length_mm = 5.0\nheight_mm = 5.0\nwidth_mm = 4.0'
CUBE = box(8.0, 6.0, 4.0)


def moved(change: Callable[[np.ndarray], Any], surface: Triangles = CUBE) -> Triangles:
    return Triangles(change(surface.points), surface.faces)


def joined(*surfaces: Triangles) -> Triangles:
    starts = np.cumsum([0, *(len(s.points) for s in surfaces)])
    return Triangles(
        np.vstack([s.points for s in surfaces]),
        np.vstack([s.faces + n for s, n in zip(surfaces, starts, strict=False)]),
    )


def inward(surface: Triangles) -> Triangles:
    return replace(surface, faces=surface.faces[:, ::-1])


SURFACES: dict[str, tuple[Triangles, str]] = {
    "a hole": (replace(CUBE, faces=CUBE.faces[1:]), "is not closed"),
    "a face missing": (replace(CUBE, faces=CUBE.faces[2:]), "is not closed"),
    "no top and no bottom": (
        replace(CUBE, faces=CUBE.faces[np.abs(CUBE.normals[:, 1]) < 0.5]),
        "is not closed",
    ),
    "a flipped face": (replace(CUBE, faces=np.vstack([CUBE.faces[:1, ::-1], CUBE.faces[1:]])), "flipped triangles"),
    "inside out": (inward(CUBE), "inside out"),
    "flat": (moved(lambda p: p * [1.0, 0.0, 1.0]), "no volume"),
    "a point": (moved(lambda p: 0.0 * p), "STL|no volume|enclose nothing"),
    "nan": (moved(lambda p: np.where(np.arange(8)[:, None] == 3, np.nan, p)), "not a number"),
    "inf": (moved(lambda p: np.where(np.arange(8)[:, None] == 3, np.inf, p)), "not a number"),
    "two pieces": (joined(CUBE, moved(lambda p: p + [20.0, 0.0, 0.0])), "in 2 pieces"),
    "two that overlap": (joined(CUBE, moved(lambda p: p + [3.0, 0.3, 0.2])), "in 2 pieces"),
    "hollow": (joined(CUBE, inward(moved(lambda p: 0.5 * p))), "in 2 pieces .or hollow"),
    "two that share an edge": (joined(CUBE, moved(lambda p: p + [8.0, 6.0, 0.0])), "more than two triangles meet"),
    "faces twice": (replace(CUBE, faces=np.vstack([CUBE.faces, CUBE.faces[:2]])), "more than two triangles meet"),
    "one triangle": (replace(CUBE, faces=CUBE.faces[:1]), "enclose nothing|STL"),
    "metres": (moved(lambda p: 1e-3 * p), "unit"),
    "micrometres": (moved(lambda p: 1e3 * p), "unit"),
    "1e-9": (moved(lambda p: 1e-9 * p), "unit|no volume|STL|enclose nothing"),
    "1e9": (moved(lambda p: 1e9 * p), "unit"),
}  # fmt: skip


def refused(capsys: Any, folder: Path, finger: str, obj: str, size: float = 1.0, more: tuple[str, ...] = ()) -> str:
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(finger=finger, object=obj, size=size), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(folder / "out"), "--no-figures", *more]) == 2
    said = capsys.readouterr().err
    complaint = [line for line in said.splitlines() if line.startswith("finger3d: ")]
    assert len(complaint) == 1, said
    assert "Traceback" not in said
    assert not list((folder / "out").glob("summary.json"))
    return complaint[0]


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("role", ["finger", "object"])
def test_meshes_that_are_no_body(name: str, role: str, tmp_path: Path, capsys: Any) -> None:
    surface, text = SURFACES[name]
    write_stl(tmp_path / "body.stl", surface)
    where = ('"body.stl"', 'shape = "plane"') if role == "finger" else (PAD, 'shape = "mesh"\npath = "body.stl"')
    said = refused(capsys, tmp_path, *where)
    assert "body.stl" in said or "object.path" in said
    assert re.search(text, said), said


@pytest.mark.parametrize(
    ("surface", "table", "text"),
    [
        (CUBE, "x_mm = 60.0", "never"),
        (CUBE, "z_mm = -30.0", "never"),
        (channel(12.0, 4.9), "", "base"),
        (channel(10.0, 3.0), "[effects.elastic_object]\nE_MPa = 1.0\nnu = 0.3\n", "wall"),
        (box(4.0, 5.0, 9.0), "x_mm = 7.0", "area"),
        (moved(lambda p: 300.0 * p), "", "unit"),
        (moved(lambda p: 0.003 * p), "", "1000 "),
    ],
    ids=["beside", "beside along z", "base", "wall", "rim", "large", "small"],
)
def test_objects_that_meet_something_else_first(
    surface: Triangles, table: str, text: str, tmp_path: Path, capsys: Any
) -> None:
    write_stl(tmp_path / "body.stl", surface)
    said = refused(capsys, tmp_path, PAD, f'shape = "mesh"\npath = "body.stl"\n{table}')
    assert text in said


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ('shape = "sphere"\nradius_mm = 3.0\nx_mm = 40.0', "never"),
        ('shape = "cylinder"\nradius_mm = 2.0\nx_mm = 30.0', "base|never"),
    ],
)
def test_shapes_beside_the_finger(table: str, text: str, tmp_path: Path, capsys: Any) -> None:
    assert re.search(text, refused(capsys, tmp_path, PAD, table))


# what crashes or hangs pytetwild, as far as a scene can ask for it; the rest, as arrays, is in test_meshing_tetwild.py
@pytest.mark.parametrize(
    ("size", "text"),
    [(100.0, "mesh.size_mm = 100.0"), (0.02, "tetrahedra"), (0.0, "from 0.0001"), (-1.0, "from 0.0001")],
)
def test_sizes_that_hang_the_mesher(size: float, text: str, tmp_path: Path, capsys: Any) -> None:
    assert text in refused(capsys, tmp_path, PAD, 'shape = "plane"', size)


def test_a_finger_without_base_or_through_itself(tmp_path: Path, capsys: Any) -> None:
    write_stl(tmp_path / "ball.stl", ball(5.0, 8, 12))
    assert "base" in refused(capsys, tmp_path, '"ball.stl"', 'shape = "plane"')
    crossed = moved(lambda p: np.vstack([p[:6], [[-12.0, 8.0, 1.0]], p[7:]]))
    write_stl(tmp_path / "crossed.stl", crossed)
    assert "itself" in refused(capsys, tmp_path, '"crossed.stl"', 'shape = "plane"')
    write_stl(tmp_path / "leaf.stl", box(8.0, 1e-3, 4.0))  # its size can be asked for, its tetrahedra cannot
    thin = ("--set", "press.depth_mm=1e-4")
    assert "tetrahedra" in refused(capsys, tmp_path, '"leaf.stl"', 'shape = "plane"', 1e-3, thin)


def test_a_point_at_the_end_of_single_precision_is_told(tmp_path: Path, capsys: Any) -> None:
    # a triangle with three equal corners is left out of the surface, its corner is not
    body = moved(lambda p: p)
    far = Triangles(np.vstack([body.points, [[3e38] * 3]]), np.vstack([body.faces, [[8, 8, 8]]]))
    write_stl(tmp_path / "far.stl", far)
    for said in (refused(capsys, tmp_path, '"far.stl"', 'shape = "plane"'),
                 refused(capsys, tmp_path, PAD, 'shape = "mesh"\npath = "far.stl"')):  # fmt: skip
        assert "3e+38" in said


def test_too_many_triangles_are_told_before_they_are_checked(tmp_path: Path, capsys: Any) -> None:
    from finger3d.geometry.files import MOST_TRIANGLES

    body = moved(lambda p: p)
    many = Triangles(body.points, np.tile(body.faces, (MOST_TRIANGLES // len(body.faces) + 1, 1)))
    write_stl(tmp_path / "many.stl", many)
    assert str(MOST_TRIANGLES) in refused(capsys, tmp_path, '"many.stl"', 'shape = "plane"')


def test_a_finger_drawn_far_away_is_none_the_worse(tmp_path: Path, capsys: Any) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.format(finger='"far.stl"', object='shape = "plane"', size=1.0), encoding="utf-8")
    for away in (1e6, 1e9):  # as drawn, 1e9 hangs pytetwild: the body is moved onto its base first
        write_stl(tmp_path / "far.stl", moved(lambda p, by=away: p + [by, -by, 0.0]))
        assert main(["plan", str(scene)]) == 0, capsys.readouterr().err
