"""Checks of a scene, and their messages."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
from finger3d.scene import parse
from tests.commands import refused
from tests.scene_tables import FINGER, SMALL

SCENE = """\
title = "test"

[finger]
geometry = "clipped_cylinder"
radius_mm = 100.0
half_length_mm = 50.0
edge_height_mm = 36.6
width_mm = 20.0

[material]
E_MPa = 1.0
nu = 0.49

[object]
shape = "plane"

[friction]
mu = 0.25

[press]
depth_mm = 10.0
steps = 10

[mesh]
size_mm = 2.0

[[gauge]]
name = "g36"
x_mm = 36.0
y_mm = 40.0
"""
PRESS = "[press]\ndepth_mm = 10.0\nsteps = 10\n"

# what is replaced, by what, and what the line must say
MISTAKES = {
    "misspelt key": ("nu = 0.49", "nuu = 0.49", ["material.nuu = 0.49", '"nu"']),
    "forgotten unit": ("radius_mm", "radius", ["finger.radius", '"radius_mm"']),
    "unknown key": ("mu = 0.25", "mu = 0.25\ncolour = 3", ["friction.colour = 3", "[friction]"]),
    "misspelt table": ("[friction]", "[frction]", ["frction", '"friction"']),
    "missing nu": ("nu = 0.49\n", "", ["material.nu is missing", "from 0 to 0.5"]),
    "missing table": ("[material]\nE_MPa = 1.0\nnu = 0.49\n", "", ["material is missing", "E_MPa, nu"]),
    "missing depth": ("depth_mm = 10.0\n", "", ["press.depth_mm is missing"]),
    "missing geometry": ('geometry = "clipped_cylinder"\n', "", ["finger.geometry is missing", '"half_cylinder"']),
    "nu above 0.5": ("nu = 0.49", "nu = 0.6", ["material.nu = 0.6", "from 0 to 0.5"]),
    "E of 0": ("E_MPa = 1.0", "E_MPa = 0", ["material.E_MPa = 0", "from 1e-9 to 1e9"]),
    "edge too high": ("36.6", "120.0", ["edge_height_mm = 120", "radius_mm = 100"]),
    "misspelt geometry": ("clipped_cylinder", "clipped_cilinder", ['"clipped_cylinder"']),
    "geometry from a file that is not there": (
        "clipped_cylinder",
        "finger.STEP",
        ["finger.geometry: ", "finger.STEP: there is no such file; give its path from the scene's folder", '"block"'],
    ),
    "geometry of another kind": (
        "clipped_cylinder",
        "finger.obj",
        ['finger.geometry = "finger.obj"', '".stl", ".step", ".stp", ".msh" or ".vtu"'],
    ),
    "depth 0": ("depth_mm = 10.0", "depth_mm = 0.0", ["press.depth_mm = 0.0", "from 1e-6 to 1e6"]),
    "too deep": (
        "depth_mm = 10.0",
        "depth_mm = 50.0",
        ["press.depth_mm = 50.0", "49.9974 mm"],
    ),
    "steps 0": ("steps = 10", "steps = 0", ["press.steps = 0", 'from 1 to 10000 or "auto"']),
    "text for a number": ("mu = 0.25", 'mu = "rough"', ['friction.mu = "rough"', "0 to 1e6"]),
    "NaN": ("mu = 0.25", "mu = nan", ["friction.mu = nan", "finite"]),
    "too large for a float": ("mu = 0.25", f"mu = 1{'0' * 400}", ["friction.mu = ", "0 to 1e6"]),
    "negative mu": ("mu = 0.25", "mu = -0.25", ["friction.mu = -0.25", "from 0 to 1e6"]),
    "number for a table": ('title = "test"', 'title = "test"\nmodel = 2', ["model = 2", "a table"]),
    "one gauge in single brackets": ("[[gauge]]", "[gauge]", ["gauge = a table", "under double brackets\n"]),
    "mesh larger than the finger": ("size_mm = 2.0", "size_mm = 21.0", ["mesh.size_mm = 21.0", " 20"]),
    "base finer than contact": (
        "size_mm = 2.0",
        "size_mm = 2.0\nbase_size_mm = 1.0",
        ["mesh.base_size_mm = 1.0", "size_mm"],
    ),
    "tolerance beside a size": (
        "size_mm = 2.0",
        "size_mm = 2.0\ntolerance = 0.01",
        ["mesh.tolerance = 0.01", "mesh.size_mm = 2.0", "either sizes or a tolerance"],
    ),
    "tolerance of 100 %": ("size_mm = 2.0", "tolerance = 1.0", ["mesh.tolerance = 1.0", "and below 1"]),
    "mesh time": ("size_mm = 2.0", "max_seconds = 9", ["mesh.max_seconds = 9", "only with mesh.tolerance"]),
    "domain": ("[mesh]", '[model]\ndomain = "planestrain"\n[mesh]', ['model.domain = "planestrain"', '"plane-strain"']),
    "unknown shape": ('"plane"', '"spher"', ['object.shape = "spher"', '"sphere"']),
    "mesh that is not there": ('"plane"', '"mesh"\npath = "gear.stl"', ["gear.stl: there is no such file"]),
    "mesh as a shape": ('"plane"', '"gear.stl"', ['object.shape = "gear.stl"', '"mesh", and the file its path']),
    "escape in the title": ('title = "test"', 'title = "\\u001b[31mred"', ["title = ", "text"]),
    "escape in a key": ("mu = 0.25", '"\\u001b[31mmu" = 0.25', ["no such key"]),
    "gauge beside": ("x_mm = 36.0", "x_mm = 51.0", ["gauge.0.x_mm = 51.0", "from -50 to 50"]),
    "gauge above the dome": ("y_mm = 40.0", "y_mm = 45.0", ["gauge.0.y_mm = 45.0", "from 0 to 43.2926"]),
    "gauge too long": ("y_mm = 40.0", "y_mm = 40.0\nlength_mm = 40.0", ["gauge.0.length_mm = 40.0", "shorter"]),
    "gauge twice": (
        "[[gauge]]",
        '[[gauge]]\nname = "g36"\nx_mm = 0.0\ny_mm = 1.0\n[[gauge]]',
        ['gauge.name = "g36"', "more than once"],
    ),
    "press twice": (
        PRESS,
        PRESS + "[[press.leg]]\ndepth_mm = 1.0\n",
        ["press.depth_mm = 10.0", "beside [[press.leg]]"],
    ),
    "leg too deep": (
        PRESS,
        "[[press.leg]]\ndepth_mm = 1.0\n[[press.leg]]\ndepth_mm = 60.0\n",
        ["press.leg.1.depth_mm = 60.0"],
    ),
    "leg that starts at 0": (PRESS, "[[press.leg]]\ndepth_mm = 0.0\n", ["press.leg.0.depth_mm = 0.0", "above 0"]),
    "slide in z of a section": (
        PRESS,
        PRESS + 'slide_z_mm = 1.0\n[model]\ndomain = "plane-strain"\n',
        ["press.slide_z_mm = 1.0", "0.0 in a 2D domain"],
    ),
    "unknown effect": (PRESS, PRESS + "[effects.telepathy]\n", ["effects.telepathy", "no such effect"]),
    "effects are numbers": (
        PRESS,
        PRESS + "[effects]\nviscosity = 1\n",
        ["effects.viscosity = 1", "a table, [effects.viscosity], true or false"],
    ),
    "not TOML": ("mu = 0.25", "mu is 0.25", ["not TOML", "at line 18, column 4"]),
    "open end": ("y_mm = 40.0\n", "y_mm = [", ["not TOML", "at line 30, column 9, the end of the file"]),
    "a number without end": ("mu = 0.25", f"mu = {'9' * 5000}", ["not TOML", "too long"]),
}


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "test.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", MISTAKES)
def test_one_line_for_a_mistake(name, scene, capsys) -> None:
    old, new, expected = MISTAKES[name]
    assert old in SCENE
    scene.write_text(SCENE.replace(old, new, 1), encoding="utf-8")
    out = scene.parent / "out"
    err = refused(capsys, "press", scene, "--out", out)
    assert err.startswith(f"finger3d: {scene}: ")
    for text in expected:
        assert text in err
    assert not out.exists()


def test_the_first_of_several_mistakes_is_told_and_the_others_counted(scene, capsys) -> None:
    bad = SCENE.replace("nu = 0.49", "nu = 0.6").replace("mu = 0.25", "mu = -1").replace("steps = 10", "steps = 0")
    scene.write_text(bad, encoding="utf-8")
    err = refused(capsys, "plan", scene)
    assert "material.nu = 0.6" in err
    assert "2 more" in err


def test_a_misspelt_required_key_is_one_mistake(scene, capsys) -> None:
    scene.write_text(SCENE.replace("nu = 0.49", "nuu = 0.49"), encoding="utf-8")
    assert "more" not in refused(capsys, "plan", scene)


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("friction.mu=-1", ["--set friction.mu: friction.mu = -1", "from 0 to 1e6"]),
        ("frction.mu=1", ["frction", '"friction"']),
        ("friction.mu", ["--set", "KEY=VALUE"]),
        ("gauge.1.x_mm=3", ["--set gauge.1.x_mm", "0 to 0", "gauge.0"]),
        ("press.leg.0.depth_mm=3", ["press.depth_mm = 10.0", "beside [[press.leg]]"]),
        ("title.first=3", ["--set title.first", 'title = "test"']),
    ],
)
def test_a_mistake_in_an_override(override, expected, scene, capsys) -> None:
    err = refused(capsys, "plan", scene, "--set", override)
    for text in expected:
        assert text in err


@pytest.mark.parametrize(("content", "told"), [(None, ""), (b"mu = \xff\xfe", "byte 5 "), (b"", "finger ")])
def test_a_file_that_holds_no_scene_is_named(content: bytes | None, told: str, tmp_path, capsys) -> None:
    path = tmp_path / "scene.toml"
    if content is not None:
        path.write_bytes(content)
    err = refused(capsys, "plan", path)
    assert f"{path}: " in err
    assert told in err
    assert f"{tmp_path}: " in refused(capsys, "plan", tmp_path)  # a folder


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("model.domain=plane-strain", ['model.domain = "plane-strain"', '"solid"']),
        ("mesh.mesher=swept", ['mesh.mesher = "swept"', '"ftetwild"']),
        ("gauge=[{name='a', x_mm=7.0, y_mm=9.0}]", ["gauge.0.y_mm = 9.0", "from 0 to 7.14142"]),
    ],
)
def test_a_hemisphere_is_a_solid_without_a_section(override, expected, tmp_path, capsys) -> None:
    path = tmp_path / "ball.toml"
    path.write_text(
        '[finger]\ngeometry = "hemisphere"\nradius_mm = 10.0\n'
        "[material]\nE_MPa = 1.0\nnu = 0.4\n[press]\ndepth_mm = 1.0\n"
    )
    err = refused(capsys, "plan", path, "--set", override)
    for text in expected:
        assert text in err


@pytest.mark.parametrize(
    ("legs", "text"),
    [
        ([{"depth_mm": 0.0, "slide_x_mm": 1.0}], "press.leg.0: .*depth_mm"),
        ([{"depth_mm": 1.0}, {"depth_mm": 1.0}], "press\\.leg\\.1: "),
    ],
)
def test_a_leg_that_does_nothing_is_refused(legs, text) -> None:
    tables = {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"leg": legs},
    }
    with pytest.raises(Finger3dError, match=text) as refused:
        parse(tables)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, []),
        ({"material": {"E_MPa": 1000.0, "nu": 0.4}}, ["1000, not from 0.001 to 100", "1 MPa = 1000 kPa"]),
        (
            {"finger": {**FINGER, "radius_mm": 2e3, "half_length_mm": 50.0, "edge_height_mm": 1200.0}},
            ["height 1200.63"],
        ),
        ({"friction": None}, ["no [friction]", "mu = 0"]),
        ({"friction": {"mu": 0.0}}, []),
    ],
)
def test_values_that_are_seldom_meant_are_warned_of(changes, words) -> None:
    tables = {**SMALL, "friction": {"mu": 0.25}, **changes}
    warnings = parse({key: table for key, table in tables.items() if table is not None}).model().warnings
    assert len(warnings) == bool(words)
    assert all(word in warnings[0] for word in words)


TABLES = {
    "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.3},
    "friction": {"mu": 0.3},
    "object": {"shape": "sphere", "radius_mm": 4.0},
    "press": {"depth_mm": 0.3, "steps": 2},
    "mesh": {"size_mm": 0.8, "base_size_mm": 1.2, "mesher": "swept"},
}
MARKER = {"name": "m1", "x_mm": 1.0, "y_mm": 2.0}
TAXEL = {"name": "t1", "x_mm": 0.0, "z_mm": 0.0, "length_mm": 2.0, "width_mm": 2.0}


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"marker": [{**MARKER, "y_mm": 3.5}]}, 'marker.0.y_mm = 3.5: marker "m1" '),
        ({"marker": [MARKER, MARKER]}, 'marker.name = "m1": '),
        ({"marker": [MARKER], "taxel": [{**TAXEL, "name": "m1"}]}, '.name = "m1": '),
        ({"marker": [MARKER], "taxel": [{**TAXEL, "name": "m1.x"}]}, 'taxel.name = "m1.x": '),
        ({"taxel": [{**TAXEL, "x_mm": 3.5}]}, 'taxel.0.x_mm = 3.5: taxel "t1" .* -3 to 3'),
        ({"taxel": [{**TAXEL, "width_mm": 5.0}]}, 'taxel.0.z_mm = 0.0: taxel "t1" '),
        ({"taxel": [{**TAXEL, "width_mm": None}]}, "taxel.0.width_mm is missing: .* required of a solid"),
        ({"marker_grid": {"spacing_mm": 1e-3}}, "marker_grid.spacing_mm = 0.001: .* 0.04 to 8"),
    ],
)
def test_a_mistake_is_named(tables: dict, said: str) -> None:
    with pytest.raises(Finger3dError) as error:
        parse(TABLES | tables)
    assert re.search(said, str(error.value))


def test_a_taxel_must_stay_on_a_round_base() -> None:
    dome = TABLES | {"finger": {"geometry": "hemisphere", "radius_mm": 4.0}, "mesh": {"size_mm": 0.8}}
    parse(dome | {"taxel": [TAXEL]})
    with pytest.raises(Finger3dError, match="taxel"):
        parse(dome | {"taxel": [{**TAXEL, "x_mm": 2.9, "z_mm": 2.9}]})


def test_a_taxel_of_a_section_needs_no_width() -> None:
    narrow = {key: value for key, value in TAXEL.items() if key != "width_mm"}
    (taxel,) = parse(TABLES | {"model": {"domain": "plane-strain"}, "taxel": [narrow]}).model().taxels
    assert taxel.width_mm is None
    with pytest.raises(Finger3dError, match="width_mm is missing"):
        parse(TABLES | {"taxel": [narrow]})


def test_a_file_has_no_section_to_sweep(tmp_path: Path) -> None:
    from tests.bodies import box, write_stl

    finger = {"geometry": str(write_stl(tmp_path / "box.stl", box(4.0, 3.0, 4.0)))}
    with pytest.raises(Finger3dError, match=r"is a file, of which no section is known .* must be \"ftetwild\""):
        parse(TABLES | {"finger": finger})


@pytest.mark.parametrize("domain", ["solid", "plane-strain"])
def test_a_press_writes_every_reading(tmp_path: Path, domain: str) -> None:
    given = TABLES | {
        "marker": [MARKER],
        "taxel": [TAXEL],
        "marker_grid": {"spacing_mm": 2.0},
        "model": {"domain": domain},
    }
    scene = tmp_path / "scene.toml"
    scene.write_text(parse(given).to_toml(), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    step = summary["steps"][-1]
    assert len(step["markers"]["m1"]) == 3
    assert step["taxels"]["t1"] > 0.0
    names = {"marker_m1_x_mm", "marker_m1_y_mm", "taxel_t1_MPa"}
    assert names <= set(summary["error_estimate"]["discretisation"])
    assert ("marker_m1_z_mm" in summary["error_estimate"]["discretisation"]) == (domain == "solid")
    with (tmp_path / "out" / "history.csv").open() as stream:
        last = list(csv.DictReader(stream))[-1]
    assert float(last["marker_m1_y_mm"]) == pytest.approx(step["markers"]["m1"][1], rel=1e-12)
    assert float(last["taxel_t1_MPa"]) == pytest.approx(step["taxels"]["t1"], rel=1e-12)
    with (tmp_path / "out" / "markers.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    # every 2 mm from -4 to 4 mm along x, and from -2 to 2 mm along z
    assert len(rows) == 2 * (1 + 5 * (3 if domain == "solid" else 1))
    assert float(rows[-1]["y_mm"]) == pytest.approx(3.0)
    under = next(r for r in rows if r["step"] == "2" and r["marker"] != "m1" and abs(float(r["x_mm"])) < 1.0
                 and abs(float(r["z_mm"])) < 1.0)  # fmt: skip
    # the marker under the lowest point of the ball goes down with it, but for the ball's sag over an edge of 0.8 mm
    assert float(under["displacement_y_mm"]) == pytest.approx(-0.3, abs=0.8**2 / (2.0 * 4.0))
    # the bar of the scene's marker is that of the summary, and the grid has its own
    bars = [float(r["error_y_mm"]) for r in rows]
    parts = [summary["error_estimate"][part]["marker_m1_y_mm"] for part in ("discretisation", "steps")]
    assert bars[len(rows) // 2] == pytest.approx(sum(parts), rel=1e-12)
    assert np.isnan(bars[: len(rows) // 2]).all()
    assert min(bars[len(rows) // 2 :]) > 0.0
    assert (tmp_path / "out" / "markers.png").stat().st_size > 10_000
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "taxel t1" in page
    assert "marker m1" in page


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        ({"shape": "plane", "tilt_deg": 3.0, "x_mm": 1.0}, Plane(1.0, 0.0, tilt=math.radians(3.0))),
        ({"shape": "cylinder", "radius_mm": 5.0, "axis": "x"}, Cylinder(0.0, 0.0, radius_mm=5.0, axis="x")),
        ({"shape": "sphere", "radius_mm": 5.0, "z_mm": 2.0}, Sphere(0.0, 2.0, radius_mm=5.0)),
        (
            {"shape": "wedge", "angle_deg": 30.0, "tip_radius_mm": 1.0},
            Wedge(0.0, 0.0, angle=math.radians(30.0), tip_radius_mm=1.0),
        ),
        (
            {"shape": "wave", "wavelength_mm": 5.0, "amplitude_mm": 0.2},
            Wave(0.0, 0.0, wavelength_mm=5.0, amplitude_mm=0.2),
        ),
    ],
)
def test_objects_arrive_with_angles_in_radians(table, expected) -> None:
    assert parse({**SMALL, "object": table}).model().object == expected


def test_whole_numbers_serve_as_numbers() -> None:
    assert parse({**SMALL, "friction": {"mu": 1}}) == parse({**SMALL, "friction": {"mu": 1.0}})
