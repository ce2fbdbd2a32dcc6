"""Files of a mold, and its page."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

import numpy as np
import pytest
import trimesh

from finger3d.mold.body import Shell, shell
from finger3d.mold.output import mold_page, print_remarks, write_mold
from finger3d.mold.parts import Mold
from finger3d.mold.printing import as_printed, in_a_row
from finger3d.mold.sheet import pour_lines
from finger3d.progress import Progress
from tests.bodies import box


def write(made: Mold, out: Path) -> str:
    shells = {name: made.shell(name, 0.5, 0.8) for name in made.parts}
    mold_page("a finger", made, shells, as_printed(shells), out, "the sheet", ["a remark"])
    return (out / "mold.html").read_text(encoding="utf-8")


def test_every_step_has_its_picture(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    made = molds["screws, gauges"]
    text = write(made, tmp_path)
    assert re.findall(r"<h2>(\d)\. [A-Z]", text) == ["1", "2", "3", "4", "5"]
    words = ("print", "prepare", "close", "pour", "open")
    pictures = [f"mold_step_{i}_{word}.png" for i, word in enumerate(words, 1)]
    assert sorted(path.name for path in tmp_path.glob("mold_step_*.png")) == pictures
    assert text.count("data:image/png") == 5
    assert f"{made.bolts.number} M3 x {made.bolts.length_mm:g}" in text
    assert "a remark" in text
    assert "the sheet" in text


def test_every_pour_has_a_step(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the parts that are in the mold then: the lid of that pour, and all that was cast so far."""
    drawn = {}
    monkeypatch.setattr(
        "finger3d.mold.output.step_pictures", lambda shown: drawn.update((p.path.stem, set(p.parts)) for p in shown)
    )
    made = molds["pours"]
    text = write(made, tmp_path)
    for i, name in enumerate(("skin", "body", "core"), 1):
        assert f"Pour {i} of 3: {name}" in text
        (parts,) = (parts for stem, parts in drawn.items() if stem.endswith(f"pour_{name}"))
        assert f"lid_{name}" in parts
        assert sum(part.startswith("silicone") for part in parts) == i
    assert all(escape(line) in text for pour in made.pours for line in pour_lines(made, pour))


def test_parts_and_plate_load_again_in_mm(paper_mold, tmp_path: Path) -> None:
    from lib3mf import Lib3MF

    from finger3d.mold.body import write_3mf, write_stl

    shells = {name: shell(part, 0.05, name) for name, part in paper_mold.parts.items()}
    printed = as_printed(shells)
    placed = in_a_row(printed)
    write_3mf(tmp_path / "mold.3mf", placed)
    wanted = {name: part.volume for name, part in paper_mold.parts.items()}
    for name, part in printed.items():
        write_stl(tmp_path / f"{name}.stl", part.surface, text=False)
        mesh = trimesh.load(tmp_path / f"{name}.stl")
        assert mesh.is_watertight
        assert mesh.body_count == 1
        assert mesh.volume == pytest.approx(wanted[name], rel=1e-3)
        np.testing.assert_allclose(mesh.bounds[0], 0.0, atol=1e-6)
        np.testing.assert_allclose(mesh.extents, part.extent, atol=1e-4)
    model = Lib3MF.Wrapper(str(Path(Lib3MF.__file__).with_name("lib3mf"))).CreateModel()
    model.QueryReader("3mf").ReadFromFile(str(tmp_path / "mold.3mf"))
    assert model.GetUnit() == Lib3MF.ModelUnit.MilliMeter
    meshes = model.GetMeshObjects()
    for name, part in placed.items():
        assert meshes.MoveNext()
        mesh = meshes.GetCurrentMeshObject()
        assert mesh.GetName() == name
        assert mesh.IsManifoldAndOriented()
        points = np.array([list(v.Coordinates) for v in mesh.GetVertices()])
        faces = np.array([list(t.Indices) for t in mesh.GetTriangleIndices()])
        assert trimesh.Trimesh(points, faces).volume == pytest.approx(wanted[name], rel=1e-3)
        np.testing.assert_allclose(points.min(axis=0), part.surface.low, atol=1e-4)
    assert not meshes.MoveNext()


def test_the_step_files_hold_the_parts_together_and_apart(molds, tmp_path: Path, monkeypatch) -> None:
    from build123d import import_step

    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    made = molds["plain, sla"]
    files, remarks = write_mold("a ball", made, Shell(made.body.surface, 0.5, 0.8), tmp_path, False, Progress())
    assert {path.name for path in files} == {path.name for path in tmp_path.glob("[!.]*")}
    assert remarks == []
    together, apart = (import_step(str(tmp_path / f"mold{end}.step")) for end in ("", "_exploded"))
    assert [part.label for part in apart.children] == list(made.parts)
    for name, a, b in zip(made.parts, together.children, apart.children, strict=True):
        assert a.volume == pytest.approx(made.parts[name].volume, rel=1e-6)
        assert b.volume == pytest.approx(a.volume, rel=1e-6)
    for i, a in enumerate(apart.children):
        assert all(a.distance_to(b) > 5.0 for b in apart.children[:i])
    assert "half A" in (tmp_path / "sheet.txt").read_text()


def test_a_plate_that_is_too_thin_is_told() -> None:
    (told,) = print_remarks({"thin": Shell(box(20.0, 10.0, 0.3, (10.0, 5.0, 0.15)), 0.0, 0.0)}, 0.6)
    assert re.fullmatch(r"mold_thin: .* 0\.3 mm near \(.*\b0\.6 mm", told)
