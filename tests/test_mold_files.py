"""Files of a finger and of its mold: CAD, triangles, printed parts, instructions, and the page."""

from __future__ import annotations

import math
import re
from html import escape
from pathlib import Path

import numpy as np
import pytest
import trimesh

from finger3d.errors import Finger3dError
from finger3d.geometry.imported import imported
from finger3d.geometry.surface_checks import mistake
from finger3d.materials.silicones import Mix, Silicone, silicone_named, silicones
from finger3d.mold.body import Shell, shell
from finger3d.mold.cover import Ports
from finger3d.mold.export import export
from finger3d.mold.options import MoldOptions
from finger3d.mold.output import as_printed, in_a_row, islands, mold_page, print_remarks, thickness, write_mold
from finger3d.mold.parts import Mold
from finger3d.mold.sheet import (
    close_lines,
    flow_ml_min,
    open_lines,
    pour_lines,
    prepare_lines,
    sheet,
    silicone_lines,
)
from finger3d.progress import Progress
from finger3d.scene import parse
from tests.bodies import box
from tests.mold_cases import BODIES, FEW, made, scene_of

# --- files of the finger ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(BODIES))
def test_every_design_becomes_a_closed_stl_in_mm(name, tmp_path: Path) -> None:
    scene = scene_of(name)
    done = export(scene, tmp_path)
    assert [f.name for f in done.files] == ["finger.step", "finger.stl"]
    mesh = trimesh.load(tmp_path / "finger.stl")
    assert mesh.is_watertight
    assert mesh.body_count == 1
    # promised: within 1e-3 of the closed form
    assert mesh.volume == pytest.approx(scene.design.volume_mm3, rel=1e-3)
    assert done.volume_mm3 == scene.design.volume_mm3
    height, width = scene.design.height_mm, scene.design.width_mm
    np.testing.assert_allclose(mesh.extents[1:], [height, width], atol=2 * done.tolerance_mm)


def test_the_step_file_is_the_finger(paper_finger, tmp_path: Path) -> None:
    export(scene_of("clipped_cylinder"), tmp_path)
    again = imported(tmp_path / "finger.step")
    assert again.solid().volume == pytest.approx(paper_finger.volume_mm3, rel=1e-9)
    assert again.height_mm == pytest.approx(paper_finger.height_mm, abs=1e-3)


def test_an_imported_stl_is_written_as_it_is(tmp_path: Path) -> None:
    export(scene_of("block"), tmp_path / "first")
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "first" / "finger.stl")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
        }
    )
    done = export(scene, tmp_path / "second")
    assert [f.name for f in done.files] == ["finger.stl"]
    assert any("finger.step" in text for text in done.remarks)
    assert trimesh.load(tmp_path / "second" / "finger.stl").volume == pytest.approx(16000.0, rel=1e-6)
    before = (tmp_path / "first" / "finger.stl").read_bytes()
    with pytest.raises(Finger3dError, match="finger.stl"):
        export(scene, tmp_path / "first")
    assert (tmp_path / "first" / "finger.stl").read_bytes() == before
    with pytest.raises(Finger3dError, match="--parts"):
        export(scene, tmp_path / "third", MoldOptions(parts=True))
    assert not (tmp_path / "third").exists()


def test_a_step_file_away_from_the_origin_is_enlarged_about_its_base(tmp_path: Path) -> None:
    """A block drawn elsewhere: its cavity is larger by the shrinkage, and its base stays on y = 0."""
    from build123d import Box, Pos, export_step

    from finger3d.mold.parts import mold

    export_step(Pos(30.0, 50.0, 10.0) * Box(20.0, 8.0, 12.0), str(tmp_path / "away.step"))
    found = mold(imported(tmp_path / "away.step").solid(), (), MoldOptions(shrinkage=0.1))
    low, high = found.body.box
    np.testing.assert_allclose(low * 0.9, [-10.0, 0.0, -6.0], atol=1e-5)
    np.testing.assert_allclose(high * 0.9, [10.0, 8.0, 6.0], atol=1e-5)


@pytest.mark.slow
def test_a_step_file_with_splines_has_the_right_volume_and_a_mold(tmp_path: Path, monkeypatch) -> None:
    """CAD's own volume is more than 5 % wrong here; wanted is the integral of 8 + 2 sin 1.2 x over 54 mm, times 30."""
    from build123d import Polyline, Spline, export_step, extrude, make_face

    x = 0.3 * np.arange(181)
    top = [(float(a), float(8.0 + 2.0 * np.sin(1.2 * a))) for a in x]
    face = make_face([Spline(*top), Polyline(top[-1], (54.0, 0.0), (0.0, 0.0), top[0])])
    solid = extrude(face, 30.0)
    wanted = 30.0 * (8.0 * 54.0 + 2.0 / 1.2 * (1.0 - math.cos(1.2 * 54.0)))
    assert abs(solid.volume / wanted - 1.0) > 0.05
    export_step(solid, str(tmp_path / "wavy.step"))
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "wavy.step")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "press": {"depth_mm": 1.0},
        }
    )
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    done = export(scene, tmp_path / "out", MoldOptions(shrinkage=0.01))
    assert trimesh.load(tmp_path / "out" / "finger.stl").volume == pytest.approx(wanted, rel=1e-3)
    assert done.volume_mm3 == pytest.approx(wanted, rel=1e-4)
    assert done.silicone_ml == pytest.approx(wanted / 0.99**3 / 1e3, rel=1e-4)


@pytest.mark.parametrize("parts", [False, True])
def test_a_rigid_part_is_printed_and_its_volume_is_not_poured(parts, tmp_path: Path, monkeypatch) -> None:
    """A block of 20 x 8 x 12 mm with a core of 8 x 5 x 12 mm: 1.92 ml less .48 ml."""
    from build123d import Box, Compound, Pos, export_step

    core = Pos(0.0, 2.5, 0.0) * Box(8.0, 5.0, 12.0)
    body = Pos(0.0, 4.0, 0.0) * Box(20.0, 8.0, 12.0) - core
    core.label = "core"
    export_step(Compound(children=[body, core]), str(tmp_path / "two.step"))
    scene = parse(
        {
            "finger": {"geometry": str(tmp_path / "two.step")},
            "material": {"E_MPa": 1.0, "nu": 0.45},
            "parts": {"core": {"rigid": True}},
            "press": {"depth_mm": 1.0},
        }
    )
    monkeypatch.setattr("finger3d.mold.output.write_pictures", lambda views: None)  # drawn in tests of the page
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    done = export(scene, tmp_path / "out", MoldOptions(parts=parts))
    assert done.silicone_ml == pytest.approx(1.44, rel=1e-6)
    # two blind holes for the pegs, at most 4.4 mm wide and 2.7 mm deep
    insert = trimesh.load(tmp_path / "out" / "mold_insert_core.stl").volume
    assert 480.0 - 2.0 * math.pi * 2.2**2 * 2.7 < insert < 480.0
    assert any("core is rigid" in text for text in done.remarks)
    assert "1.44 ml" in (tmp_path / "out" / "sheet.txt").read_text()


def test_an_export_leaves_nothing_of_an_older_one(tmp_path: Path) -> None:
    for name in ("mold.3mf", "mold_bed_2.3mf", "mold_plug_1a.stl", "sheet.txt", "mine.txt"):
        (tmp_path / name).write_text("older")
    export(scene_of("block"), tmp_path)
    assert {f.name for f in tmp_path.glob("[!.]*")} == {"finger.step", "finger.stl", "mine.txt"}


# --- files of a mold, and its page -----------------------------------------------------------------------------------


def write(made: Mold, out: Path) -> str:
    shells = {name: made.shell(name, 0.5, 0.8) for name in made.parts}
    mold_page(out, "a finger", made, shells, "the sheet", ["a remark"])
    return (out / "mold.html").read_text(encoding="utf-8")


def test_every_step_has_its_picture(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    made = molds["screws, gauges"]
    text = write(made, tmp_path)
    assert re.findall(r"<h2>(\d)\. [A-Z]", text) == ["1", "2", "3", "4", "5"]
    words = ("print", "prepare", "close", "pour", "open")
    pictures = [f"mold_step_{i}_{word}.png" for i, word in enumerate(words, 1)]
    assert sorted(path.name for path in tmp_path.glob("mold_step_*.png")) == pictures
    assert text.count("data:image/png") == 6
    assert f"{made.bolts.number} M3 x {made.bolts.length_mm:g}" in text
    assert "a remark" in text
    assert "the sheet" in text


def test_every_pour_has_a_step(molds, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the parts that are in the mold then: the lid of that pour, and all that was cast so far."""
    drawn = {}
    monkeypatch.setattr(
        "finger3d.mold.output.write_pictures",
        lambda views: drawn.update((path.stem, set(view.parts)) for path, view in views.items()),
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
        write_stl(tmp_path / f"{name}.stl", part.surface)
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


def test_the_step_file_holds_the_parts(molds, tmp_path: Path, monkeypatch) -> None:
    from build123d import import_step

    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    made = molds["plain, sla"]
    files, remarks = write_mold("a ball", made, Shell(made.body.surface, 0.5, 0.8), tmp_path, Progress())
    assert {path.name for path in files} == {path.name for path in tmp_path.glob("[!.]*")}
    assert remarks == []
    read = import_step(str(tmp_path / "mold.step")).children
    assert [part.label for part in read] == list(made.parts)
    for part in read:
        assert part.volume == pytest.approx(made.parts[part.label].volume, rel=1e-6)
    assert "half A" in (tmp_path / "sheet.txt").read_text()


def test_a_plate_that_is_too_thin_is_told() -> None:
    (told,) = print_remarks({"thin": Shell(box(20.0, 10.0, 0.3, (10.0, 5.0, 0.15)), 0.0, 0.0)}, 0.6)
    assert re.fullmatch(r"mold_thin: .* 0\.3 mm near \(.*\b0\.6 mm", told)


# --- mold parts as a slicer sees them, and as they lie ---------------------------------------------------------------


ALL = [
    {"printer": "fdm-0.4"},
    {"printer": "sla", "screw": "M4"},
    {"printer": "sla", "screw": "none", "pour_mm": 2.0},
    {"printer": "fdm-0.4", "shrinkage": 0.01, "split": "x"},
]
"""Options that together hold every kind of value."""

NAMES = ["screws, gauges", *(name for name in FEW if name != "insert"), pytest.param("insert", marks=pytest.mark.slow)]


def check(found: Mold) -> None:
    """Closed, oriented, no wall below what the printer makes, nothing that begins in the air.

    3 %: rays are slanted and chords cut corners.
    """
    printed = as_printed({name: found.shell(name, 0.1, 0.3) for name in found.parts})
    for name, part in printed.items():
        assert mistake(part.surface) == "", name
        assert thickness(part.surface)[0] >= 0.97 * found.options.machine.thinnest_mm, name
        assert len(islands(part.surface)) == 0, name


@pytest.mark.parametrize("name", NAMES)
def test_every_part_prints(name, molds) -> None:
    check(molds[name])


@pytest.mark.slow
@pytest.mark.parametrize("design", sorted(set(BODIES) - {"fingertip"}))
@pytest.mark.parametrize(("kind", "options"), [("", ALL[0]), (" as STL", ALL[2])], ids=["CAD", "STL"])
def test_every_design_prints(design, kind, options) -> None:
    check(made(design + kind, options))


@pytest.mark.slow
@pytest.mark.parametrize("options", ALL, ids=lambda options: "-".join(str(value) for value in options.values()))
def test_a_design_prints_with_all_options(options) -> None:
    check(made("clipped_cylinder", options))


def test_a_thin_wall_is_found() -> None:
    """A plate 0.3 mm thick: the thickness is that of the plate, but for the slant of the rays."""
    found, where = thickness(box(20.0, 10.0, 0.3, (0.0, 0.0, 0.15)))
    assert found == pytest.approx(0.3, rel=1e-3)
    assert np.abs(where[2] - 0.15) == pytest.approx(0.15, abs=1e-3)
    assert thickness(box(20.0, 10.0, 3.0, (0.0, 0.0, 1.5)))[0] == pytest.approx(3.0, rel=1e-2)


def test_what_begins_in_the_air_is_found() -> None:
    """A table upside down is sound, a table with its top first is sound, a hook that hangs down is not."""
    from build123d import Box, Pos

    from finger3d.mold.body import shell

    hook = Pos(0, 0, 5) * Box(4, 4, 10) + Pos(4, 0, 9) * Box(8, 4, 2) + Pos(7, 0, 6) * Box(2, 4, 6)
    found = islands(shell(hook.solids()[0], 0.1, "hook").surface)
    assert len(found) == 1
    np.testing.assert_allclose(found[0], [7.0, 0.0, 3.25], atol=0.26)
    assert len(islands(box(20.0, 10.0, 3.0, (0.0, 0.0, 1.5)))) == 0


def test_outer_faces_lie_on_the_bed(paper_mold) -> None:
    """Pegs of half B and of the lid point up."""
    printed = as_printed({name: paper_mold.shell(name, 0.2, 0.4) for name in ("half_b", "lid")})
    for name, part in printed.items():
        assert part.surface.low == pytest.approx(np.zeros(3), abs=1e-9)
        top = part.surface.points[part.surface.points[:, 2] > part.extent[2] - 1e-6]
        area = np.prod(np.ptp(top[:, :2], axis=0))
        assert area > 0.0, name
    lid = printed["lid"].surface
    assert lid.normals[np.abs(lid.corners[:, :, 2]).max(axis=1) < 1e-9, 2].max() < -0.99


# --- the casting sheet and the text of its steps ---------------------------------------------------------------------


def test_the_steps_name_what_the_mold_has(molds) -> None:
    """Screws with their size, the strips, the hole that is poured through."""
    made = molds["screws, gauges"]
    assert f"{made.bolts.number} screws M3 x {made.bolts.length_mm:g}" in " ".join(close_lines(made))
    assert f"{made.bolts.number} M3 nuts" in " ".join(prepare_lines(made))
    assert "strips" in " ".join(prepare_lines(made))
    told = " ".join(pour_lines(made, made.pours[0]))
    assert f"{made.silicone_mm3 / 1e3:.2f} ml" in told
    assert "6 mm" in told
    assert "along z" in " ".join(open_lines(made))


def test_a_skin_is_poured_before_its_lid(molds) -> None:
    skin, body, core = molds["pours"].pours
    poured, pushed, off = pour_lines(molds["pours"], skin)
    assert f"{skin.silicone_mm3 / 1e3:.2f} ml" in poured
    assert "lid_skin" in pushed
    assert "lid_skin off" in off
    closed, poured, off = pour_lines(molds["pours"], body)
    assert "lid_body" in closed
    assert f"{body.silicone_mm3 / 1e3:.2f} ml" in poured
    assert "lid_body off" in off
    assert not any("pull" in line for line in pour_lines(molds["pours"], core))


def test_an_insert_is_printed_and_not_poured(molds) -> None:
    """The volume of the sheet is that of skin and body; before the last pour the core is put onto its lid."""
    made = molds["insert"]
    printed = as_printed({name: made.shell(name, 0.2, 0.4) for name in made.parts})
    text = " ".join(sheet("mine", made, printed).split())
    volume = float(re.search(r"cavity ([\d.]+) ml, without what is inserted: core", text)[1])
    assert volume == pytest.approx((made.body.volume_mm3 - 10.0 * 8.0 * 16.0) / 1e3, abs=0.006)
    assert "insert core" in text
    skin, body = made.pours
    assert "core, which is printed (mold_insert_core.stl)" in pour_lines(made, body)[0]
    assert not any("core" in line for line in pour_lines(made, skin))
    assert "but not the inserts" in prepare_lines(made)[0]


def test_the_sheet_has_the_silicone_of_the_scene(paper_mold) -> None:
    printed = as_printed({name: paper_mold.shell(name, 0.2, 0.4) for name in paper_mold.parts})
    named = sheet("mine", paper_mold, printed, silicone_named("Dragon Skin 20"))
    unnamed = sheet("mine", paper_mold, printed)
    heads = ["SILICONE", "PARTS", "PRINT", "FRICTION FACE", "CURE INHIBITION", "GAUGES", "MIX", "POUR"]
    for text in (named, unnamed):
        assert [line for line in text.splitlines() if line.isupper()] == heads
    mixing = named.split("\nMIX\n")[1]
    assert mixing.index("weigh") < mixing.index("Mix slowly for 3 min") < mixing.index("Degas")
    assert re.search(r"\bz up\b.* along x\b.* along z\b", named)  # ribs run across the axis of the split
    assert "Dragon Skin 20" in named
    assert "g of A" in named
    assert "g of A" not in unnamed
    assert 'silicone = "NAME"' in unnamed


# --- casting instructions of a silicone ------------------------------------------------------------------------------


def hole(narrow_mm: float, wide_mm: float) -> Ports:
    return Ports(narrow_mm, (0.0, 0.0), wide_mm, 1.0, ())


HOLE = hole(6.0, 14.0)


def lines_of(name: str, volume_ml: float = 100.0, ports: Ports | None = HOLE, shrinkage: float = 0.0) -> str:
    return "\n".join(silicone_lines(silicone_named(name), volume_ml, ports, shrinkage))


def silicone_with(**values) -> Silicone:
    return Silicone(name="mine", maker="me", scale="A", shore=20.0, sources=("me",), **values)


def test_a_cylinder_flows_as_poiseuille_says() -> None:
    """Q = pi rho g r^4 / (8 eta) for a cylinder that its own weight drains."""
    silicone = silicone_with(density_g_ml=1.1, viscosity_Pa_s=10.0)
    wanted = math.pi * 1100.0 * 9.81 * 0.003**4 / (8.0 * 10.0)  # m3/s
    assert flow_ml_min(hole(6.0, 6.0), silicone) == pytest.approx(60e6 * wanted, rel=1e-12)
    assert flow_ml_min(HOLE, silicone) > flow_ml_min(hole(6.0, 6.0), silicone)
    assert flow_ml_min(HOLE, silicone_with()) is None


def test_grams_of_each_component_for_the_volume() -> None:
    text = lines_of("Dragon Skin 20")
    assert re.search(r" 108\.0 g .* 54\.0 g of A and 54\.0 g of B \(1 A : 1 B ", text)
    grams = [
        float(g)
        for g in re.search(r"weigh +([\d.]+) g .*: ([\d.]+) g of A and ([\d.]+) g", lines_of("Smooth-Sil 950")).groups()
    ]
    assert grams[1] / grams[2] == pytest.approx(10.0, rel=0.01)
    # no density is known: the largest one of the table, so that there is enough
    assert grams[0] == pytest.approx(100.0 * max(s.density_g_ml or 0.0 for s in silicones().values()))
    assert grams[1] + grams[2] == pytest.approx(grams[0], abs=0.11)
    assert "50.0 ml of A and 50.0 ml of B (1 A : 1 B " in lines_of("Mold Star 16")
    assert re.search(r"weigh .*mix ratio.*data sheet", lines_of("Elastosil M4601"))
    text = "\n".join(silicone_lines(silicone_with(mix=Mix(2.0, 1.0, "volume")), 90.0, HOLE, 0.0))
    assert "60.0 ml of A and 30.0 ml of B" in text


def test_the_cup_holds_five_times_the_volume() -> None:
    assert " 500 ml" in lines_of("Dragon Skin 20")
    assert " 500 ml" in "\n".join(silicone_lines(None, 100.0, HOLE, 0.0))


def test_pot_life_against_pouring() -> None:
    slow = lines_of("Dragon Skin 20", 200.0)
    assert "25 min" in slow
    assert re.search(r"degas 5 min.* 17 min ", slow)
    assert "syringe" in slow
    assert "flow" not in lines_of("Dragon Skin 20", 200.0, None)
    assert "syringe" not in lines_of("Ecoflex 00-30", 50.0, hole(10.0, 20.0))
    assert "degas 5 min" not in lines_of("Mold Star 16")
    assert re.search(r"pot life .*data sheet", lines_of("Smooth-Sil 960"))


def test_cure_shrinkage_and_notes() -> None:
    text = lines_of("Dragon Skin 10")
    assert " 5 h at 23 degrees" in text
    assert "below 0.1 %" in text
    assert "MEDIUM" in text
    (more,) = set(lines_of("Dragon Skin 10", shrinkage=0.005).splitlines()) - set(text.splitlines())
    assert re.search(r"shrinkage .* 0\.1 % .*mold", more)
    assert " 0.5 h (30 min)" in lines_of("Mold Star 16")
    assert "60 min at 90 degrees" in lines_of("Elastosil M4601")
    assert "data sheet" in lines_of("Smooth-Sil 940")


@pytest.mark.parametrize("name", silicones())
def test_every_silicone_has_its_lines(name: str) -> None:
    lines = silicone_lines(silicone_named(name), 63.0, HOLE, 0.0)
    assert name in lines[0]
    assert re.search(r"E = [\d.]+ MPa \+- \d+ %", lines[0])
    assert all(len(line) < 200 for line in lines)
    assert "None" not in "\n".join(lines)
