"""Bodies from STEP and STL files, and bodies of several solids."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.geometry.cad import OUTSIDE, cut_part, glue, labelled_faces
from finger3d.geometry.files import read_solid, read_step, read_surface, welded
from finger3d.geometry.imported import imported
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from finger3d.geometry.tessellate import tessellate, tessellate_parts
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing import generate
from finger3d.scene import parse
from tests.bodies import box, step_of, write_stl
from tests.designs import SMALL, make
from tests.scene_tables import HALF_CYLINDER

# --- files with bodies -----------------------------------------------------------------------------------------------


DRAWN: list[Path] = []


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: (p / "a.stl").write_text("hello"), "a.stl: .*STL"),
        (lambda p: (p / "a.stl").write_bytes(bytes(range(256)) * 10), "STL"),
        (lambda p: (p / "a.stl").write_bytes(b"\0" * 80 + (2**31).to_bytes(4, "little")), "STL"),
        (lambda p: (p / "a.step").write_text("hello"), "a.step: .*STEP"),
        (lambda p: shutil.copy(DRAWN[0] / "two.step", p / "a.step"), "a.step: .*2 solids"),
        (lambda p: shutil.copy(DRAWN[0] / "face.step", p / "a.step"), "solid"),
        (lambda p: (p / "a.obj").write_text("v 0 0 0"), ".stl, .step or .stp"),
        (lambda p: None, "a.stl"),
    ],
    ids=["text", "bytes", "header", "step text", "two solids", "face", "obj", "none"],
)
def test_files_that_hold_no_body(drawn: Path, tmp_path: Path, make, text: str) -> None:
    DRAWN[:] = [drawn]
    make(tmp_path)
    path = next(tmp_path.iterdir(), tmp_path / "a.stl")
    for read in (read_surface, imported):
        with pytest.raises(Finger3dError, match=text) as refused:
            read(path)
        assert "\n" not in str(refused.value)


def test_gaps_of_single_precision_are_closed() -> None:
    soup = box(20.0, 10.0, 6.0)
    loose = soup.corners.reshape(-1, 3) + np.random.default_rng(0).uniform(-1e-6, 1e-6, (36, 3))
    joined = welded(loose, np.arange(36).reshape(-1, 3))
    assert len(joined.points) == 8
    assert mistake(joined) == ""


def patches(surface: Triangles) -> str:
    """An STL text with a solid for each pair of triangles."""
    lines = []
    for k, pair in enumerate(surface.corners.reshape(-1, 2, 3, 3)):
        lines += [f"solid vertex of patch {k}"]
        for corners in pair:
            lines += ["facet normal 0 0 0", "outer loop", *("vertex {} {} {}".format(*p) for p in corners)]
            lines += ["endloop", "endfacet"]
        lines += [f"endsolid vertex of patch {k}"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("change", [str, str.upper, lambda t: t.replace("\n", "\r\n"), lambda t: "\ufeff\n" + t])
def test_a_text_of_several_solids_is_one_body(tmp_path: Path, change) -> None:
    (tmp_path / "a.stl").write_bytes(change(patches(box(20.0, 10.0, 6.0))).encode())
    assert read_surface(tmp_path / "a.stl").volume == pytest.approx(1200.0, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda t: t[: t.rindex("endloop")],
            "11 whole facets and 36 vertices, where a facet has three: it was cut off",
        ),
        (lambda t: t[: t.rindex("endsolid")], "does not end with 'endsolid': it was cut off"),
        (lambda t: t.replace("10.0", "10,0"), "not three numbers"),
        (lambda t: "solid a\nendsolid a\n", "no triangles"),
    ],
    ids=["facet", "end", "comma", "none"],
)
def test_the_reason_of_a_refused_text_is_the_true_one(tmp_path: Path, change, reason: str) -> None:
    (tmp_path / "a.stl").write_text(change(patches(box(20.0, 10.0, 6.0))))
    with pytest.raises(Finger3dError, match=reason):
        read_surface(tmp_path / "a.stl")


def test_a_binary_file_that_was_cut_off_is_told_and_one_with_more_bytes_is_read(tmp_path: Path) -> None:
    from trimesh import Trimesh
    from trimesh.exchange.stl import export_stl

    body = box(20.0, 10.0, 6.0)
    content = b"solid" + export_stl(Trimesh(body.points, body.faces))[5:]  # as some programs begin the header
    path = tmp_path / "a.stl"
    for more in (b"", b"0123456789"):
        path.write_bytes(content + more)
        assert read_surface(path).volume == pytest.approx(1200.0, rel=1e-6)
    path.write_bytes(content[:-60])
    with pytest.raises(Finger3dError, match="announces 12 triangles, and 10 follow: it was cut off"):
        read_surface(path)


def test_a_body_that_runs_through_itself_is_no_object(tmp_path: Path) -> None:
    whole = box(10.0, 4.0, 6.0)
    points = whole.points.copy()
    points[points[:, 0] > 0.0, 1] *= -0.9  # the cross-section is a figure of eight
    write_stl(tmp_path / "eight.stl", Triangles(points, whole.faces))
    with pytest.raises(Finger3dError, match="runs through itself at .* near"):
        read_surface(tmp_path / "eight.stl")


# --- STEP files, which are read in a child process -------------------------------------------------------------------


def test_a_step_file_that_crashes_the_reader_is_told_in_one_line(drawn: Path, tmp_path: Path) -> None:
    text = (drawn / "finger.step").read_text()
    (tmp_path / "a.step").write_text(re.sub(r"#\d+ = VECTOR\(.*\n", "", text))
    with pytest.raises(Finger3dError, match=r"a.step: OpenCASCADE crashed \(SIGSEGV.*damaged") as refused:
        read_surface(tmp_path / "a.step")
    assert "\n" not in str(refused.value)


def test_solids_of_a_moved_assembly_have_the_names_of_their_products(tmp_path: Path) -> None:
    from build123d import Box, Compound, Pos, export_step

    small, large = Box(2.0, 2.0, 2.0), Pos(0.0, 3.0, 0.0) * Box(4.0, 4.0, 4.0)
    small.label, large.label = "core.a", "skin"
    inner = Compound(label="inner", children=[small, large])
    export_step(Compound(label="outer", children=[inner]).moved(Pos(30.0, 0.0, 0.0)), tmp_path / "a.step")
    read = read_step(tmp_path / "a.step")
    found = {label: solid.volume for label, solid in zip(read.labels, read.solids, strict=True)}
    assert found == pytest.approx({"core_a": 8.0, "skin": 64.0})


# --- bodies from files: STL and STEP read, checked, put on their base, meshed, snapped, cached by content; in scenes -


BOTH = ("x", "z")


@pytest.mark.parametrize("name", ["finger.step", "inches.step", "finger.stl"])
def test_a_finger_drawn_elsewhere_comes_onto_its_base(drawn: Path, name: str) -> None:
    body = imported(drawn / name)
    unit = 25.4 if name == "inches.step" else 1.0  # a STEP file says its unit
    assert body.name == name
    assert body.height_mm == pytest.approx(unit * SMALL.height_mm, rel=1e-4)
    assert body.half_length_mm == pytest.approx(unit * 10.0, rel=1e-4)
    assert body.width_mm == pytest.approx(unit * 8.0, rel=1e-4)
    assert body.volume_mm3 == pytest.approx(unit**3 * SMALL.volume_mm3, rel=1e-3)
    x, z = np.linspace(-9.9, 9.9, 50), np.linspace(-3.9, 3.9, 50)
    np.testing.assert_allclose(body.top(unit * x, unit * z), unit * SMALL.top(x, z), atol=unit * 3e-3)
    assert np.isnan(body.top(np.array([unit * 10.5]), np.zeros(1)))[0]
    assert body.mirrors() == (() if name == "finger.stl" else BOTH)


def step_with_base(path: Path, solid: Any, *bases: Any) -> Path:
    """A STEP file in which these faces of the solid are named base, as CAD programs write it."""
    step_of(path, solid)
    written = read_solid(path).faces()  # in the order of the file
    numbers = {min(range(len(written)), key=lambda i: (written[i].center() - f.center()).length) for f in bases}
    text, count = path.read_text(encoding="utf-8"), iter(range(99))
    text = re.sub(r"ADVANCED_FACE\(''", lambda m: m[0][:-2] + ("'Base'" if next(count) in numbers else "''"), text)
    assert text.count("'Base'") == len(bases)
    path.write_text(text, encoding="utf-8")
    return path


SLOW_TURNS = [pytest.param(t, marks=pytest.mark.slow) for t in ((0.0, 0.0, 90.0), (0.0, 0.0, 180.0), (0.0, 0.0, 0.0))]


@pytest.mark.parametrize("turn", [(90.0, 0.0, 0.0), (31.0, 0.0, 17.0), *SLOW_TURNS])
def test_the_face_named_base_is_turned_down(tmp_path: Path, turn: tuple[float, float, float]) -> None:
    from build123d import Axis, Rot

    solid = SMALL.solid()
    base = solid.faces().sort_by(Axis.Y)[0]
    body = imported(step_with_base(tmp_path / "finger.step", Rot(*turn) * solid, Rot(*turn) * base))
    assert body.height_mm == pytest.approx(SMALL.height_mm, abs=1e-9)
    assert body.surface.low[1] == 0.0
    if turn[0] != 31.0:  # the shortest way down leaves that one turned about y
        np.testing.assert_allclose([2.0 * body.half_length_mm, body.width_mm], [20.0, 8.0], atol=1e-9)
    assert [f.label for f in labelled_faces(body.solid())].count("base") == 1
    assert body.volume_mm3 == pytest.approx(SMALL.volume_mm3, rel=1e-3)


@pytest.mark.slow
def test_a_face_named_base_that_is_none_is_refused(tmp_path: Path) -> None:
    from build123d import Axis, Box, Pos

    solid = (Box(8.0, 8.0, 4.0) + Pos(4.0, 0.0, 0.0) * Box(4.0, 2.0, 4.0)).solids()[0]  # a ledge on one side
    side = next(f for f in solid.faces() if f.normal_at(f.center()).X > 0.99 and abs(f.center().X - 4.0) < 1e-6)
    with pytest.raises(Finger3dError, match="2 mm .*'base'"):
        imported(step_with_base(tmp_path / "ledge.step", solid, side))
    both = [solid.faces().sort_by(axis)[0] for axis in (Axis.X, Axis.Y)]
    with pytest.raises(Finger3dError, match="2 .*'base'"):
        imported(step_with_base(tmp_path / "two.step", solid, *both))
    dome = next(f for f in SMALL.solid().faces() if not f.is_planar)
    with pytest.raises(Finger3dError, match="'base'"):
        imported(step_with_base(tmp_path / "round.step", SMALL.solid(), dome))


@pytest.mark.slow
def test_a_body_drawn_with_z_up_is_turned_about_x(tmp_path: Path) -> None:
    from build123d import Axis, Rot

    upright = imported(step_of(tmp_path / "y.step", SMALL.solid()))
    lying = Rot(90.0, 0.0, 0.0) * SMALL.solid()
    path = step_of(tmp_path / "z.step", lying)
    body = imported(path, up="z")
    np.testing.assert_allclose(body.surface.high, upright.surface.high, atol=1e-9)
    np.testing.assert_allclose(
        body.top(np.array([3.0]), np.zeros(1)), SMALL.top(np.array([3.0]), np.zeros(1)), atol=3e-3
    )
    assert body.mirrors() == BOTH
    assert body.solid().bounding_box().max.Y == pytest.approx(SMALL.height_mm, abs=1e-9)
    assert body != imported(path)
    where = (options(1.0, 2.0), (-1.0, 1.0, -1.0, 1.0), ())
    assert generate.cache_key(body, *where) != generate.cache_key(imported(path), *where)
    # a face named base agrees with it
    based = imported(step_with_base(tmp_path / "base.step", lying, lying.faces().sort_by(Axis.Z)[0]), up="z")
    np.testing.assert_allclose(based.surface.high, body.surface.high, atol=1e-9)


def test_z_up_turns_y_to_minus_z_as_a_rotation_does(tmp_path: Path) -> None:
    drawn = box(30.0, 12.0, 16.0)
    drawn = replace(drawn, points=drawn.points * np.where(drawn.points[:, [1]] < 0.0, [0.5, 1.0, 1.0], 1.0))
    body = imported(write_stl(tmp_path / "wedge.stl", drawn), up="z")
    assert body.extent.startswith("30 x 16 x 12 mm (x, y up, z), base 30 x 12 mm; unit of the file: mm, as STL ")
    assert body.extent.endswith(", its z turned up")
    narrow = body.surface.points[:, 2] > 0.0  # y < 0 in the file
    assert np.abs(body.surface.points[narrow, 0]).max() == pytest.approx(7.5)
    assert body.volume_mm3 == pytest.approx(0.75 * 30.0 * 12.0 * 16.0)


def test_the_unit_of_a_step_file_is_told(tmp_path: Path) -> None:
    path = step_of(tmp_path / "finger.step", SMALL.solid())
    assert imported(path).unit == "mm, as it says"
    path.write_text(path.read_text(encoding="utf-8").replace(".MILLI.,.METRE.", ".CENTI.,.METRE."), encoding="utf-8")
    body = imported(path)
    assert body.unit == "cm, as it says"
    assert body.extent.startswith("200 x 76.79 x 80 mm (x, y up, z), base 200 x 80 mm; ")


def options(size: float, base: float) -> Any:
    return MeshOptions(size, base, "ftetwild")


@pytest.mark.slow
def test_press_takes_a_finger_and_an_object_from_files(drawn: Path, tmp_path: Path, capsys: Any) -> None:
    write_stl(tmp_path / "plate.stl", box(30.0, 1.0, 20.0))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'effects.auto = false\n[finger]\ngeometry = "{drawn}/finger.step"\n[material]\nE_MPa = 1.0\n'
        'nu = 0.3\n[press]\ndepth_mm = 0.6\nsteps = 2\n[object]\nshape = "mesh"\npath = "plate.stl"\n'
        "[mesh]\nsize_mm = 1.6\nbase_size_mm = 4.0\n",
        encoding="utf-8",
    )
    assert main(["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures"]) == 0, capsys.readouterr().err
    import json

    got = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert got["outcome"] == "converged"
    assert got["mesh"]["symmetry"] == ["x", "z"]
    design = {
        "geometry": "clipped_cylinder",
        "radius_mm": 20.0,
        "half_length_mm": 10.0,
        "edge_height_mm": 5.0,
        "width_mm": 8.0,
    }
    same = parse(
        {
            **HALF_CYLINDER,
            "finger": design,
            "press": {"depth_mm": 0.6, "steps": 2},
            "mesh": {"size_mm": 1.6, "base_size_mm": 4.0, "mesher": "swept"},
        }
    )
    from finger3d.mechanics.discretise.build import build
    from finger3d.mechanics.history import measure
    from finger3d.mechanics.march.solve import march

    problem = build(same.model())
    wanted = measure(problem.points, list(march(problem))[-1])["normal_force_N"]
    assert got["steps"][-1]["normal_force_N"] == pytest.approx(wanted, rel=0.02)


def test_solids_away_from_the_origin_are_scaled_together(tmp_path: Path) -> None:
    # build123d's `scale` enlarges every solid about its own location.
    from build123d import Box, Compound, Pos, export_step

    solids = [Pos(30.0, 1.0, 0.0) * Box(4.0, 2.0, 4.0), Pos(30.0, 2.5, 0.0) * Box(4.0, 1.0, 4.0)]
    solids[1].label = "skin"
    path = tmp_path / "two.step"
    export_step(Compound(children=solids), path)
    half = imported(path, scale=0.5)
    assert half.volume_mm3 == pytest.approx((2.0 + 1.0) * 16.0 / 8.0)
    skin = half.solids()["skin"].bounding_box()
    assert (skin.min.Y, skin.max.Y) == pytest.approx((1.0, 1.5))
    assert (skin.min.X, skin.max.X) == pytest.approx((-1.0, 1.0))


# --- solids glued along the faces where they touch, their triangles, and STEP files of several solids ----------------


FINGERTIP = make("fingertip")


def file_of(path: Path, **solids: Any) -> Path:
    """A STEP file of solids with these labels, an underscore for none."""
    from build123d import Compound

    for label, solid in solids.items():
        solid.label = label.strip("_")
    return step_of(path, Compound(children=list(solids.values())))


@pytest.mark.parametrize("symmetry", [(), ("x", "z")])
def test_glued_parts_share_their_faces(symmetry: tuple[str, ...]) -> None:
    solids = {label: cut_part(solid, symmetry) for label, solid in FINGERTIP.solids().items()}
    glued = glue(solids, "fingertip")
    assert glued.labels == ("", "skin", "core")
    assert sum(glued.volumes_mm3) == pytest.approx(FINGERTIP.volume_mm3 / 2 ** len(symmetry), rel=1e-12)
    sides = [(f.inside, f.outside) for f in glued.faces]
    assert sides.count((0, 1)) == 1  # the arc
    assert sides.count((0, 2)) == (3 if not symmetry else 2)  # the core's upper side and its walls
    body = tessellate_parts(glued, 1e-3)
    assert body.part_labels == ("skin", "core")
    assert body.volume_mm3 == pytest.approx(sum(glued.volumes_mm3), rel=1e-4)
    for number, volume in enumerate(glued.volumes_mm3):
        assert mistake(body.part(number)) == ""
        assert body.part(number).volume == pytest.approx(volume, rel=1e-4)
    assert {f.label for f in body.faces if f.outside != OUTSIDE} == {""}
    corners = {tuple(c) for c in np.round(np.abs(body.corners), 6).tolist()}
    assert (3.0, 6.0, 8.0) in corners  # of the core


def test_solids_that_overlap_are_refused() -> None:
    from build123d import Box, Pos

    with pytest.raises(Finger3dError, match="^two: .*overlap"):
        glue({"": Box(4.0, 4.0, 4.0), "core": Pos(1.0, 0.0, 0.0) * Box(4.0, 4.0, 4.0)}, "two")


@pytest.mark.slow
def test_solids_of_a_step_file_are_parts_with_their_names(tmp_path: Path) -> None:
    from build123d import Pos, Rot

    where = Rot(0.0, 0.0, 30.0) * Pos(5.0, 3.0, 1.0)
    parts = {label or "_": where * solid for label, solid in FINGERTIP.solids().items()}
    path = file_of(tmp_path / "finger.step", **parts)
    assert sorted(read_step(path).labels) == ["", "core", "skin"]
    upright = file_of(tmp_path / "upright.step", **{label or "_": s for label, s in FINGERTIP.solids().items()})
    body = imported(upright)
    assert set(body.part_labels) == {"skin", "core"}
    assert body.volume_mm3 == pytest.approx(FINGERTIP.volume_mm3, rel=1e-4)
    for label, area in FINGERTIP.section().areas_mm2.items():
        assert body.solids()[label].volume == pytest.approx(area * FINGERTIP.width_mm, rel=1e-9)
    assert body.mirrors() == ("x", "z")
    assert sum(s.volume for s in body.solids().values()) == pytest.approx(body.solid().volume, rel=1e-9)
    with pytest.raises(Finger3dError, match="no base"):
        imported(path)


@pytest.mark.parametrize(
    ("shift", "text"),
    [(9.0, "2 solids .*2 bodies.* 1 mm apart"), (8.0005, " 0.0005 mm apart near "), (3.0, "two.step: .*overlap")],
)
def test_step_files_of_solids_that_do_not_fit_together(tmp_path: Path, shift: float, text: str) -> None:
    from build123d import Box, Pos

    path = file_of(tmp_path / "two.step", _=Box(8.0, 4.0, 8.0), core=Pos(shift, 0.0, 0.0) * Box(8.0, 4.0, 8.0))
    with pytest.raises(Finger3dError, match=text) as refused:
        imported(path)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_a_core_with_clearance_in_its_pocket_is_told_with_the_place(tmp_path: Path) -> None:
    from build123d import Box, Pos

    outer = Pos(0.0, 3.0, 0.0) * Box(20.0, 6.0, 10.0)
    for gap in (0.005, 5e-5, 0.2):
        pocket = Pos(0.0, 1.0, 0.0) * Box(10.0 + 2.0 * gap, 2.0, 4.0)
        core = Pos(0.0, 1.0, 0.0) * Box(10.0, 2.0, 4.0)
        path = file_of(tmp_path / "finger.step", _=outer - pocket, core=core)
        if gap > 0.1:  # a slot that can be meshed
            assert imported(path).part_labels == ("core",)
            continue
        with pytest.raises(Finger3dError, match=rf"not touch, but are {gap:.2g} mm apart near \(-?5(\.\d+)?, "):
            imported(path)


def test_a_thin_part_between_two_others_is_no_gap(tmp_path: Path) -> None:
    from build123d import Box, Pos

    low, foil, high = (Pos(0.0, y, 0.0) * Box(20.0, h, 10.0) for y, h in ((1.0, 2.0), (2.0025, 0.005), (3.005, 2.0)))
    body = imported(file_of(tmp_path / "finger.step", _=low, foil=foil, top=high))
    assert set(body.part_labels) == {"foil", "top"}


def test_solids_with_one_name_are_one_body(tmp_path: Path) -> None:
    from build123d import Box, Pos

    path = file_of(tmp_path / "two.step", _=Box(8.0, 4.0, 8.0), __=Pos(8.0, 0.0, 0.0) * Box(8.0, 4.0, 8.0))
    body = imported(path)
    assert body.part_labels == ()
    assert body.volume_mm3 == pytest.approx(512.0)


def test_the_faces_of_a_void_are_a_cavity(tmp_path: Path) -> None:
    from build123d import Box, Pos, Sphere

    hollow = (Pos(0.0, 5.0, 0.0) * Box(10.0, 10.0, 10.0) - Pos(0.0, 5.0, 0.0) * Sphere(2.0)).solids()[0]
    labels = [f.label for f in tessellate(hollow, 0.01).faces]
    assert sorted(labels) == ["base", "cavity", "contact", "ends", "ends", "walls", "walls"]
    body = imported(step_of(tmp_path / "hollow.step", hollow))
    assert body.volume_mm3 == pytest.approx(hollow.volume, rel=1e-3)
    assert body.height_mm == pytest.approx(10.0)
