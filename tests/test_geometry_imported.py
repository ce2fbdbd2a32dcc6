"""Bodies from files: STL and STEP read, checked, put on their base, meshed, snapped, cached by content; in scenes."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.geometry.cad import labelled_faces
from finger3d.geometry.faceted import body as faceted_body
from finger3d.geometry.faceted import coarser
from finger3d.geometry.files import read_solid, read_surface, welded
from finger3d.geometry.imported import imported, of_surface
from finger3d.geometry.registry import designs
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from finger3d.meshing import cache
from finger3d.meshing.generate import mesh_solid
from finger3d.objects import MeshObject
from finger3d.scene import load, parse
from tests.bodies import ball, box, channel, step_of, write_stl

SMALL = designs()["clipped_cylinder"](20.0, 10.0, 5.0, 8.0)
BOTH = ("x", "z")


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files: one finger as STEP, in inches too, and STL, drawn away from the origin; other things."""
    from build123d import Axis, Box, Compound, Face, Pos, Sphere, Unit, export_stl, fillet

    folder = tmp_path_factory.mktemp("drawn")
    finger = Pos(12.0, -7.0, 33.0) * SMALL.solid()
    step_of(folder / "finger.step", finger)
    step_of(folder / "inches.step", finger, unit=Unit.IN)
    export_stl(finger, folder / "finger.stl", tolerance=1e-4, angular_tolerance=0.05)
    step_of(folder / "two.step", Compound([Box(5, 5, 5), Pos(10, 0, 0) * Box(5, 5, 5)]))
    step_of(folder / "face.step", Face.make_rect(5, 5))
    step_of(folder / "ball.step", Sphere(10.0))
    pad = Pos(0.0, 2.5, 0.0) * Box(12.0, 5.0, 8.0)
    step_of(folder / "rounded.step", fillet(pad.faces().sort_by(Axis.Y)[-1].edges(), 1.5))
    return folder


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


@pytest.mark.parametrize("turn", [(90.0, 0.0, 0.0), (0.0, 0.0, 90.0), (0.0, 0.0, 180.0), (31.0, 0.0, 17.0), (0, 0, 0)])
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


def test_a_face_named_base_that_is_none_is_refused(tmp_path: Path) -> None:
    from build123d import Axis, Box, Pos

    solid = (Box(8.0, 8.0, 4.0) + Pos(4.0, 0.0, 0.0) * Box(4.0, 2.0, 4.0)).solids()[0]  # a ledge on one side
    side = next(f for f in solid.faces() if f.normal_at(f.center()).X > 0.99 and abs(f.center().X - 4.0) < 1e-6)
    with pytest.raises(Finger3dError, match="reaches 2 mm beyond the face named 'base'"):
        imported(step_with_base(tmp_path / "ledge.step", solid, side))
    both = [solid.faces().sort_by(axis)[0] for axis in (Axis.X, Axis.Y)]
    with pytest.raises(Finger3dError, match="2 faces named 'base' are not one plane"):
        imported(step_with_base(tmp_path / "two.step", solid, *both))
    dome = next(f for f in SMALL.solid().faces() if not f.is_planar)
    with pytest.raises(Finger3dError, match="are not one plane"):
        imported(step_with_base(tmp_path / "round.step", SMALL.solid(), dome))


def options(size: float, base: float) -> Any:
    return SimpleNamespace(size_mm=size, base_size_mm=base, mesher="ftetwild")


def test_a_step_finger_is_meshed_on_its_cad_faces(drawn: Path) -> None:
    body = imported(drawn / "finger.step")
    mesh, report = mesh_solid(body, options(1.2, 3.0), (-6.0, 6.0, -4.0, 4.0), BOTH)
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    planes = {"base": (1, 0.0), "ends": (2, 4.0), "walls": (0, 10.0), "symmetry_x": (0, 0.0), "symmetry_z": (2, 0.0)}
    for label, (axis, value) in planes.items():
        assert np.abs(at[label][:, axis] - value).max() < 1e-12
    assert (at["base"][:, 1] == 0.0).all()
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - SMALL.height_mm + 20.0) - 20.0
    assert np.abs(off).max() < 1e-9
    assert report.volume_mm3 == pytest.approx(SMALL.volume_mm3, rel=1e-4)


def test_fillets_are_contact_and_hold_their_nodes(drawn: Path) -> None:
    from build123d import Compound, Vertex

    body = imported(drawn / "rounded.step")
    mesh, _ = mesh_solid(body, options(0.9, 2.0), (-5.0, 5.0, -3.0, 3.0), BOTH)
    assert set(mesh.facets) == {"contact", "base", "ends", "walls", "symmetry_x", "symmetry_z"}
    nodes = np.unique(mesh.facets["contact"])
    contact = mesh.points[nodes]
    off = [np.hypot(contact[:, i] - middle, contact[:, 1] - 3.5) - 1.5 for i, middle in ((0, 4.5), (2, 2.5))]
    off = np.abs(off).min(axis=0)[contact[:, 1] < 5.0 - 1e-9]
    assert np.quantile(off, 0.9) < 1e-9
    # The rest are nodes of the same facets on the walls, which the fillets run into smoothly.
    skin = Compound(body.solid().faces())
    away = np.array([skin.distance_to(Vertex(*map(float, p))) for p in contact])
    assert np.quantile(away, 0.95) < 1e-9
    assert away[np.isin(nodes, mesh.vertices)].max() < 1e-4
    # In some meshes an edge is left straight, where a curved one would turn a cell inside out: its chord's sagitta.
    assert away.max() < 1.5 * 0.9**2 / (8.0 * 1.5)  # of an edge somewhat longer than asked for, on a fillet of 1.5 mm


def test_an_stl_finger_is_meshed_on_its_triangles(drawn: Path) -> None:
    body = imported(drawn / "finger.stl")
    patches = faceted_body(body.surface)
    assert sorted(f.label for f in patches.faces) == ["base", "contact", "ends", "ends", "walls", "walls"]
    mesh, report = mesh_solid(body, options(1.5, 3.0), (-6.0, 6.0, -4.0, 4.0))
    assert set(mesh.facets) == {"contact", "base", "ends", "walls"}
    assert (mesh.points[np.unique(mesh.facets["base"]), 1] == 0.0).all()
    contact = mesh.points[np.unique(mesh.facets["contact"])]
    assert np.abs(body.surface.signed_distance(contact)[0]).max() < 1e-6
    assert report.volume_mm3 == pytest.approx(body.volume_mm3, rel=1e-3)


def test_texture_is_taken_together_by_label() -> None:
    x, z = np.meshgrid(np.linspace(-5, 5, 61), np.linspace(-5, 5, 61), indexing="ij")
    bumps = 3.0 + 0.8 * np.maximum(0.0, np.sin(8.0 * x) * np.sin(8.0 * z))
    surface = height_field(x, z, bumps)
    assert mistake(surface) == ""
    body = faceted_body(of_surface(surface, "texture").surface)
    assert {f.label for f in body.faces} <= {"base", "contact", "ends", "walls"}
    assert len(body.faces) <= 150


def height_field(x: np.ndarray, z: np.ndarray, y: np.ndarray) -> Triangles:
    """A closed body under a height field (n, m)."""
    n, m = x.shape
    top = np.stack([x, y, z], axis=2).reshape(-1, 3)
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (number[i : n - 1 + i, j : m - 1 + j].ravel() for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)))
    up = np.vstack([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    after = np.roll(rim, -1)
    skirt = np.vstack(
        [np.stack([rim, after, after + n * m], axis=1), np.stack([rim, after + n * m, rim + n * m], axis=1)]
    )
    return Triangles(np.vstack([top, top * [1.0, 0.0, 1.0]]), np.vstack([up, up[:, ::-1] + n * m, skirt]))


def test_fine_triangles_are_coarsened_for_the_mesher_only() -> None:
    half = ball(8.0, 80, 160)
    keep = half.corners[:, :, 1].max(axis=1) <= 1e-9
    rim = np.flatnonzero(np.abs(half.points[:, 1]) < 1e-9)
    rim = rim[np.argsort(np.arctan2(half.points[rim, 2], half.points[rim, 0]))]
    points = np.vstack([half.points, [[0.0, 0.0, 0.0]]])
    lid = np.stack([np.full(len(rim), len(half.points)), np.roll(rim, -1), rim], axis=1)
    bowl = of_surface(Triangles(points, np.vstack([half.faces[keep], lid])), "bowl", upside_down=True)
    body = faceted_body(bowl.surface)
    less = coarser(body, 2e-4)
    assert len(less.triangles) < 0.6 * len(body.triangles)
    found = Triangles(less.points, less.triangles)
    assert mistake(found) == ""
    assert np.abs(bowl.surface.signed_distance(found.corners.mean(axis=1))[0]).max() < 0.02
    assert less.faces is body.faces
    assert set(less.labels) == {"base", "contact"}


def test_meshes_are_kept_by_the_files_content(drawn: Path, tmp_path: Path) -> None:
    renamed = shutil.copy(drawn / "finger.stl", tmp_path / "another.stl")
    where = (options(1.0, 2.0), (-1.0, 1.0, -1.0, 1.0), ())
    first, again = (cache.key(imported(p), *where) for p in (drawn / "finger.stl", renamed))
    assert first == again
    assert first != cache.key(imported(drawn / "finger.step"), *where)
    assert first != cache.key(imported(drawn / "finger.stl", scale=2.0), *where)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: (p / "a.stl").write_text("hello"), "a.stl: this is no STL mesh, or an empty one"),
        (lambda p: (p / "a.stl").write_text(""), "this is no STL mesh"),
        (lambda p: (p / "a.stl").write_bytes(bytes(range(256)) * 10), "this is no STL mesh"),
        (lambda p: (p / "a.stl").write_bytes(b"\0" * 80 + (2**31).to_bytes(4, "little")), "this is no STL mesh"),
        (lambda p: (p / "a.step").write_text("hello"), "a.step: this is no STEP file that can be read"),
        (lambda p: (p / "a.step").write_text(""), "this is no STEP file"),
        (lambda p: shutil.copy(DRAWN[0] / "two.step", p / "a.step"), "a.step: the file has 2 solids; give one"),
        (lambda p: shutil.copy(DRAWN[0] / "face.step", p / "a.step"), "the file has no solid, only faces or curves"),
        (lambda p: (p / "a.obj").write_text("v 0 0 0"), "must be a file named .stl, .step or .stp"),
        (lambda p: (p / "a.stl").mkdir(), "cannot be read"),
        (lambda p: None, "there is no such file"),
    ],
    ids=["text", "empty", "bytes", "header", "step text", "step empty", "two solids", "face", "obj", "folder", "none"],
)
def test_files_that_hold_no_body(drawn: Path, tmp_path: Path, make, text: str) -> None:
    DRAWN[:] = [drawn]
    make(tmp_path)
    path = next(tmp_path.iterdir(), tmp_path / "a.stl")
    for read in (read_surface, imported):
        with pytest.raises(Finger3dError, match=text) as refused:
            read(path)
        assert "\n" not in str(refused.value)


DRAWN: list[Path] = []


@pytest.mark.parametrize(
    ("surface", "text"),
    [
        (ball(5.0), "no base: the lowest point of the body lies on no level plane"),
        (box(4e-2, 4e-2, 4e-2), "was it drawn in another unit"),
        (box(4e4, 4e4, 4e4), "was it drawn in another unit"),
        (replace(box(4, 4, 4), faces=box(4, 4, 4).faces[1:]), "not closed"),
        (replace(box(4, 4, 4), faces=box(4, 4, 4).faces[:, ::-1]), "inside out"),
        (replace(channel(6, 4, 2, 5), points=channel(6, 4, 2, 5).points[:, [1, 0, 2]] * [1, -1, 1]), ""),
    ],
    ids=["ball", "metres", "micrometres", "hole", "inward", "a channel on its side is fine"],
)
def test_bodies_that_are_no_finger(tmp_path: Path, surface: Triangles, text: str) -> None:
    path = write_stl(tmp_path / "body.stl", surface)
    if not text:
        assert imported(path).volume_mm3 == pytest.approx(surface.volume)
        return
    with pytest.raises(Finger3dError, match=text) as refused:
        imported(path)
    assert "\n" not in str(refused.value)


def test_a_body_that_runs_through_itself_is_refused(tmp_path: Path) -> None:
    good = box(4.0, 4.0, 4.0)
    corner = [[-6.0, 5.0, 1.0]]  # a top corner pulled out through the far side
    bad = replace(good, points=np.vstack([good.points[:6], corner, good.points[7:]]))
    with pytest.raises(Finger3dError, match="runs through itself at"):
        imported(write_stl(tmp_path / "body.stl", bad))


def test_gaps_of_single_precision_are_closed() -> None:
    soup = box(20.0, 10.0, 6.0)
    loose = soup.corners.reshape(-1, 3) + np.random.default_rng(0).uniform(-1e-6, 1e-6, (36, 3))
    joined = welded(loose, np.arange(36).reshape(-1, 3))
    assert len(joined.points) == 8
    assert mistake(joined) == ""


FINGER = {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0}
SCENE: dict[str, Any] = {"finger": FINGER, "material": {"E_MPa": 1.0, "nu": 0.3}, "press": {"depth_mm": 0.5}}


def scene_with(path: Path, **table: Any) -> dict[str, Any]:
    return {**SCENE, "object": {"shape": "mesh", "path": str(path), **table}}


@pytest.mark.parametrize(
    ("surface", "table", "text"),
    [
        (box(2, 2, 2), {"x_mm": 50.0}, "never touches"),
        (channel(12.0, 4.9), {}, "touches the base first"),
        (box(2e3, 2e3, 2e3), {}, "200 times as large as the finger of 10 mm; is its unit right"),
        (box(2e-3, 2e-3, 2e-3), {}, r"times smaller than the finger of 10 mm; .* 1000 if it was drawn in metres"),
        (box(2, 2, 2), {"scale": 0.0}, "object.scale = 0.0: must be a number from 1e-6 to 1e6"),
        (box(2, 2, 2), {"scael": 2.0}, 'did you mean "scale"'),
        (Triangles(box(2, 2, 2).points, box(2, 2, 2).faces[2:]), {}, "not closed"),
    ],
    ids=["beside", "base", "huge", "tiny", "scale", "misspelt", "hole"],
)
def test_objects_that_a_scene_refuses(tmp_path: Path, surface: Triangles, table: dict[str, Any], text: str) -> None:
    surface = replace(surface, points=surface.points * 1.0001)
    with pytest.raises(Finger3dError, match=text) as refused:
        parse(scene_with(write_stl(tmp_path / "object.stl", surface), **table))
    assert "\n" not in str(refused.value)


def test_paths_are_relative_to_the_scene_and_survive_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    write_stl(tmp_path / "parts" / "plate.stl", box(6.0, 1.0, 6.0))
    text = parse(scene_with(tmp_path / "parts" / "plate.stl")).to_toml()
    (tmp_path / "a.toml").write_text(text.replace(str(tmp_path / "parts"), "parts"), encoding="utf-8")
    monkeypatch.chdir("/")
    scene = load(tmp_path / "a.toml")
    assert isinstance(scene.object, MeshObject)
    elsewhere = tmp_path / "results"
    elsewhere.mkdir()
    (elsewhere / "scene.toml").write_text(scene.to_toml(), encoding="utf-8")
    assert load(elsewhere / "scene.toml") == scene


def test_object_scale_changes_the_object(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "inches.stl", box(0.2, 0.1, 0.2))
    obj = parse(scene_with(path, scale=25.4)).object
    assert isinstance(obj, MeshObject)
    assert obj.surface.volume == pytest.approx(0.004 * 25.4**3)


def test_press_takes_a_finger_and_an_object_from_files(drawn: Path, tmp_path: Path, capsys: Any) -> None:
    write_stl(tmp_path / "plate.stl", box(30.0, 1.0, 20.0))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'[finger]\ngeometry = "{drawn}/finger.step"\n[material]\nE_MPa = 1.0\nnu = 0.3\n[press]\ndepth_mm = 0.6\n'
        'steps = 2\n[object]\nshape = "mesh"\npath = "plate.stl"\n[mesh]\nsize_mm = 1.2\nbase_size_mm = 3.0\n',
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
            **SCENE,
            "finger": design,
            "press": {"depth_mm": 0.6, "steps": 2},
            "mesh": {"size_mm": 1.2, "base_size_mm": 3.0, "mesher": "swept"},
        }
    )
    from finger3d.mechanics.build import build
    from finger3d.mechanics.history import measure
    from finger3d.mechanics.solve import march

    problem = build(same.model())
    wanted = measure(problem.points, list(march(problem))[-1])["normal_force_N"]
    assert got["steps"][-1]["normal_force_N"] == pytest.approx(wanted, rel=0.02)


def test_a_bad_file_ends_the_command_with_one_line_and_code_2(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "object.stl").write_text("no mesh")
    scene = tmp_path / "scene.toml"
    import tomli_w

    scene.write_text(tomli_w.dumps(scene_with(Path("object.stl"))), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"{scene}: object.path: " in said
    assert "this is no STL mesh" in said
    assert not (tmp_path / "out").exists()
