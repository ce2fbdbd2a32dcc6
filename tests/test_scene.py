"""Scenes: files, overrides, tables, and the reference and the schema of their keys."""

from __future__ import annotations

import json
import math
import re
import tomllib
import tracemalloc
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import finger3d
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import MeshObject, Plane
from finger3d.scene import load, parse, scene_of, tables_of, tree
from finger3d.scene.schema import schema
from tests.bodies import box, write_stl
from tests.commands import loaded
from tests.given_meshes import cube, vtu_of
from tests.scene_tables import HEIGHT, SMALL, scene_with_object
from tests.scenes import HALF_CYLINDER, written


def test_loading_a_scene_needs_no_cad_and_no_drawing(tmp_path) -> None:
    path = written(tmp_path, parse(SMALL).to_toml())
    heavy = ("OCP", "build123d", "vtk", "vtkmodules", "pyvista", "pytetwild", "matplotlib")
    assert not loaded(f"import finger3d; finger3d.load({str(path)!r}).model()", *heavy)


def test_the_title_of_a_file_with_escapes_in_its_name_is_printable(tmp_path, capsys) -> None:
    from finger3d.cli import main

    path = tmp_path / "a\x1b[31mred\nline.toml"
    path.write_text(parse(SMALL).to_toml().replace('title = "Fig. 9"\n', ""), encoding="utf-8")
    assert load(path).title.isprintable()
    assert main(["plan", str(path), "--set", "mesh.mesher=swept"]) == 0
    assert main(["plan", str(path), "--set", "friction.mu=-1"]) == 2
    out, err = capsys.readouterr()
    assert "\x1b" not in out + err
    assert len(err.splitlines()) == 1


def test_the_least_scene_is_frictionless_on_a_plane_as_a_solid() -> None:
    model = parse(SMALL).model()
    assert model.friction == Coulomb(0.0)
    assert model.object == Plane()
    assert model.domain == "solid"
    assert model.rule == "projection"
    assert model.legs == (Leg(10.0, steps="auto"),)
    assert model.gauges == ()
    assert model.material == Isotropic(1.0, 0.49)
    assert model.design.height_mm == pytest.approx(HEIGHT)


def test_the_contract_example_loads_without_its_effects(tmp_path) -> None:
    contract = """
        title = "Fig. 9 finger, 20 mm wide"
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
        [contact]
        rule = "projection"
        [model]
        domain = "solid"
        [mesh]
        size_mm = 2.0
        base_size_mm = 8.0
        mesher = "ftetwild"
        [[gauge]]
        name = "g36"
        x_mm = 36.0
        y_mm = 40.0
        z_mm = 0.0
        angle_deg = 30.0
        length_mm = 0.0
    """
    scene = load(written(tmp_path, contract))
    model = scene.model()
    assert scene.title == "Fig. 9 finger, 20 mm wide"
    assert model.friction == Coulomb(0.25)
    assert model.mesh == MeshOptions(2.0, 8.0, "ftetwild")
    assert model.gauges[0].angle == pytest.approx(math.pi / 6)


@pytest.mark.parametrize(
    "extra",
    [
        {},
        {"title": 'quotes " and \\ a backslash, \u00b5', "friction": {"mu": 0.3}},
        {"press": {"leg": [{"depth_mm": 1.0, "duration_s": 2.0}, {"depth_mm": 0.0, "steps": "auto"}]}},
        {"object": {"shape": "wedge", "angle_deg": 30.0}, "contact": {"rule": "paper"}},
        {"gauge": [{"name": "a", "x_mm": 0.0, "y_mm": 1.0}, {"name": "b", "x_mm": 1, "y_mm": 2, "angle_deg": 45.0}]},
        {"model": {"domain": "plane-stress"}, "mesh": {"mesher": "swept", "size_mm": 1.0}},
    ],
)
def test_round_trip(extra) -> None:
    scene = parse({**SMALL, "friction": {"mu": 0.2}, **extra})
    for defaults in (True, False):
        again = parse(tomllib.loads(scene.to_toml(defaults)))
        assert again == scene
        assert again.model() == scene.model()
        assert again.as_dict() == scene.as_dict()


@given(
    nu=st.floats(0.0, 0.5),
    mu=st.floats(0.0, 1e6),
    depth=st.floats(1e-2, 38.0),  # deeper tilted ones reach the base, and are refused
    tilt=st.floats(-20.0, 20.0),  # steeper ones touch an edge first, and are refused
    x=st.floats(-50.0, 50.0),
)
def test_numbers_survive_the_round_trip_to_the_last_bit(nu, mu, depth, tilt, x) -> None:
    scene = parse(
        {
            **SMALL,
            "material": {"E_MPa": 1.0, "nu": nu},
            "friction": {"mu": mu},
            "press": {"depth_mm": depth},
            "object": {"shape": "plane", "tilt_deg": tilt, "x_mm": x},
            "gauge": [{"name": "g", "x_mm": x, "y_mm": 20.0}],
        }
    )
    assert parse(tomllib.loads(scene.to_toml())).model() == scene.model()


def test_as_dict_is_json_with_every_default() -> None:
    scene = parse(SMALL)
    tree = scene.as_dict()
    assert json.loads(json.dumps(tree)) == tree
    assert tree["friction"] == {"mu": 0.0}
    turns = {f"turn_{axis}_deg": 0.0 for axis in "xyz"}
    assert tree["object"] == {"shape": "plane", "x_mm": 0.0, "z_mm": 0.0, "tilt_deg": 0.0, **turns}
    assert tree["press"]["steps"] == "auto"
    assert tree["mesh"]["mesher"] == "ftetwild"
    assert tree["effects"] == {"auto": False}


def test_a_path_a_dict_and_a_scene_are_the_same_scene(tmp_path: Path) -> None:
    path = written(tmp_path, HALF_CYLINDER)
    loaded = finger3d.load(path)
    assert scene_of(loaded) is loaded
    assert scene_of(path).as_dict() == scene_of(str(path)).as_dict() == loaded.as_dict()
    assert scene_of(dict(loaded.given)).as_dict() == loaded.as_dict()
    for source in (path, loaded, dict(loaded.given)):
        given, _ = tables_of(source, ["friction.mu=0.7"])
        assert given["friction"]["mu"] == 0.7
        assert scene_of(source, ["friction.mu=0.7"]).tables.friction.mu == 0.7
    assert loaded.given["friction"]["mu"] == 0.25


def test_a_model_is_told_what_takes_it(tmp_path: Path) -> None:
    model = finger3d.load(written(tmp_path, HALF_CYLINDER)).model()
    for source in (model, 7, None):
        with pytest.raises(Finger3dError, match=f"a {type(source).__name__} is no scene: .*finger3d.load"):
            finger3d.press(source)


def test_a_dict_is_a_scene(tmp_path: Path) -> None:
    given = dict(finger3d.load(written(tmp_path, HALF_CYLINDER)).given)
    assert finger3d.press(given, error=False).last.normal_force_N > 0.0
    assert finger3d.plan(given).dofs > 0
    with pytest.raises(Finger3dError, match=r"friction.mu = -1"):
        finger3d.press(given | {"friction": {"mu": -1}})


def test_overrides_are_applied_before_checking(tmp_path) -> None:
    # nu is missing in the file: only the override makes it a scene.
    path = written(tmp_path, parse(SMALL).to_toml(defaults=False).replace("nu = 0.49\n", ""))
    overrides = [
        "material.nu=0.3",
        "friction.mu=0.5",
        "model.domain=plane-strain",
        'title="as text = quoted"',
        "press.steps=auto",
        "finger.geometry = block",
        "finger={geometry='block', half_length_mm=10, height_mm=20, width_mm=5}",
    ]
    scene = load(path, overrides)
    assert scene.model().material.nu == 0.3
    assert scene.model().friction == Coulomb(0.5)
    assert scene.domain == "plane-strain"
    assert scene.title == "as text = quoted"
    assert scene.legs[0].steps == "auto"
    assert scene.design.name == "block"


READINGS = {
    "gauge": [{"name": "a", "x_mm": 1.0, "y_mm": 2.0}, {"name": "b.c", "x_mm": 2.0, "y_mm": 2.0}],
    "marker": [{"name": "m", "x_mm": 0.0, "y_mm": 1.0}],
    "taxel": [{"name": "t", "x_mm": 0.0, "z_mm": 0.0, "length_mm": 1.0, "width_mm": 1.0}],
}


def test_readings_are_overridden_by_name(tmp_path) -> None:
    path = written(tmp_path, parse({**SMALL, **READINGS}).to_toml())
    set_ = ["gauge.a.x_mm=3.0", "gauge.1.x_mm=4.0", "gauge.a.name=z", "gauge.z.y_mm=1.0", "marker.m.x_mm=0.5"]
    tables = load(path, [*set_, "taxel.t.width_mm=2.0"]).tables
    assert [(g.name, g.x_mm, g.y_mm) for g in tables.gauge] == [("z", 3.0, 1.0), ("b.c", 4.0, 2.0)]
    assert tables.marker[0].x_mm == 0.5
    assert tables.taxel[0].width_mm == 2.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gauge.q.x_mm=1", 'no gauge "q"; must be "a" or "b.c", or its number from 0'),
        ("gauge.a.x_mm=far", "with --set gauge.0.x_mm: gauge.0.x_mm"),
    ],
)
def test_an_override_of_no_reading_is_refused(tmp_path, text: str, said: str) -> None:
    path = written(tmp_path, parse({**SMALL, **READINGS}).to_toml())
    with pytest.raises(Finger3dError, match=re.escape(said)):
        load(path, [text])


@pytest.mark.parametrize(
    ("table", "given", "text", "left"),
    [
        ("mesh", {"tolerance": 0.1, "goal": "normal_force_N"}, "mesh.size_mm=2.0", {"size_mm"}),
        ("mesh", {"size_mm": 2.0, "base_size_mm": 4.0}, "mesh.tolerance=0.1", {"tolerance"}),
        ("mesh", {"size_mm": 2.0, "mesher": "swept"}, "mesh.base_size_mm=4.0", {"size_mm", "base_size_mm", "mesher"}),
        ("press", {"depth_mm": 1.0, "steps": 2}, "press.force_N=3.0", {"force_N", "steps"}),
        ("press", {"force_N": 1.0}, "press.depth_mm=3.0", {"depth_mm"}),
    ],
)
def test_a_key_that_is_set_takes_the_place_of_those_that_it_excludes(table, given, text, left) -> None:
    scene = scene_of({**SMALL, table: given}, [text])
    assert set(scene.given[table]) == left
    with pytest.raises(Finger3dError, match="beside|either"):
        scene_of({**SMALL, "mesh": {}}, ["mesh.size_mm=2.0", "mesh.tolerance=0.1"])


def test_true_and_false_switch_effects(tmp_path) -> None:
    path = written(
        tmp_path,
        parse({**SMALL, "effects": {"large_deformation": {"law": "mooney-rivlin", "c01_share": 0.2}}}).to_toml(),
    )
    law = load(path, ["effects.large_deformation=true"]).effects["large_deformation"].law
    assert law == "mooney-rivlin"
    assert not load(path, ["effects.large_deformation=false"]).effects
    off = ["effects.large_deformation=false", "effects.large_deformation=true"]
    assert load(path, off).effects["large_deformation"].law == "neo-hookean"
    on = ["effects.kinetic_friction=true", "effects.kinetic_friction.ratio=0.5"]
    assert load(path, on).effects["kinetic_friction"].ratio == 0.5


def test_byte_order_mark_and_windows_lines_are_taken(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + parse(SMALL).to_toml().replace("\n", "\r\n").encode())
    assert load(path) == parse(SMALL)


@pytest.fixture
def memory() -> Iterator[None]:
    """No more than 20 MB, about 30 times what these scenes need, may be taken."""
    tracemalloc.start()
    yield
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


LONG = ".".join("a" * 20_000)


@pytest.mark.usefixtures("memory")
@pytest.mark.parametrize(
    "text",
    [f"{LONG}=1", f"press.leg.{'9' * 20_000}=1", f"friction={'{a=' * 60}1{'}' * 60}"], ids=["key", "number", "tables"],
)  # fmt: skip
def test_a_key_of_many_parts_is_refused_in_little_memory(text: str) -> None:
    with pytest.raises(Finger3dError) as told:
        parse(tree.override({**SMALL, "press": {"leg": [{"depth_mm": 0.1}]}}, [text]))
    assert "\n" not in str(told.value)


@pytest.mark.usefixtures("memory")
@pytest.mark.parametrize("line", [f"{LONG} = 1", f"[{LONG}]"])
def test_a_file_with_a_key_of_many_parts_is_refused_in_little_memory(line: str, tmp_path) -> None:
    with pytest.raises(Finger3dError, match="a key is too long"):
        load(written(tmp_path, f"{line}\n"))


def test_paths_are_relative_to_the_scene_and_survive_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    write_stl(tmp_path / "parts" / "plate.stl", box(6.0, 1.0, 6.0))
    text = parse(scene_with_object(tmp_path / "parts" / "plate.stl")).to_toml()
    (tmp_path / "a.toml").write_text(text.replace(str(tmp_path / "parts"), "parts"), encoding="utf-8")
    monkeypatch.chdir("/")
    scene = load(tmp_path / "a.toml")
    assert isinstance(scene.object, MeshObject)
    elsewhere = tmp_path / "results"
    elsewhere.mkdir()
    (elsewhere / "scene.toml").write_text(scene.to_toml(), encoding="utf-8")
    assert load(elsewhere / "scene.toml") == scene


def test_a_finger_with_z_up_stays_so_in_the_scene_as_run(tmp_path: Path) -> None:
    scene = scene_with_object(write_stl(tmp_path / "plate.stl", box(6.0, 1.0, 6.0)))
    scene["finger"] = {"geometry": str(write_stl(tmp_path / "finger.stl", box(30.0, 12.0, 16.0)))}
    lying = parse(scene)
    scene["finger"]["up"] = "z"
    upright = parse(scene)
    assert (lying.design.height_mm, upright.design.height_mm) == (12.0, 16.0)
    assert upright != lying
    again = tmp_path / "again.toml"
    again.write_text(upright.to_toml(), encoding="utf-8")
    assert load(again) == upright
    scene["finger"]["up"] = "x"
    with pytest.raises(Finger3dError, match='finger.up = "x": must be "y" or "z"'):
        parse(scene)


def test_a_finger_that_was_drawn_in_another_unit_has_a_scale(tmp_path: Path) -> None:
    scene = scene_with_object(write_stl(tmp_path / "plate.stl", box(6.0, 1.0, 6.0)))
    inches = write_stl(tmp_path / "inches.stl", box(2.0, 1.0, 0.5))
    metres = vtu_of(tmp_path / "metres.vtu", cube(2, edge_mm=4e-3))
    for path, scale, size in ((inches, 25.4, (25.4, 12.7)), (metres, 1e3, (4.0, 4.0))):
        scene["finger"] = {"geometry": str(path), "scale": scale}
        found = parse(scene)
        assert (found.design.height_mm, found.design.width_mm) == pytest.approx(size, rel=1e-9)
        (tmp_path / "again.toml").write_text(found.to_toml(), encoding="utf-8")
        assert load(tmp_path / "again.toml") == found
        other = parse({**scene, "finger": {"geometry": str(path), "scale": 1.01 * scale}})
        assert other.design.cache_fields != found.design.cache_fields
    with pytest.raises(Finger3dError, match=r"give its scale in \[finger\], such as 1000 for metres"):
        parse({**scene, "finger": {"geometry": str(metres)}})


def test_a_file_that_is_a_circle_of_links_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.step").symlink_to("a.step")
    for table in ({"geometry": "a.step"}, None):
        scene = scene_with_object(tmp_path / "a.step")
        with pytest.raises(Finger3dError, match=r"a\.step"):
            parse(scene | ({"finger": table} if table else {}), tmp_path / "scene.toml")


def test_the_reference_names_every_key_with_its_meaning(root: Path) -> None:
    table = (root / "docs" / "scenes.md").read_text(encoding="utf-8").split("<!-- from the tables")[1]
    lines = [line for line in table.splitlines() if line.startswith("| ") and not line.startswith("| key |")]
    rows = [line.strip("| ").split(" | ") for line in lines]
    assert len(rows) > 50
    assert all(row[-1].strip() for row in rows)
    keys = {key.strip("`") for row in rows for key in row[0].split(", ")}
    assert {
        "geometry",
        "edge_height_mm",
        "nu",
        "shape",
        "tilt_deg",
        "mu",
        "rule",
        "domain",
        "angle_deg",
        "prony",
    } <= keys


SCENE = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0},
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "press": {"depth_mm": 0.5},
}
LEGS = {"leg": [{"depth_mm": 0.5}, {"force_N": 2.0, "slide_x_mm": 1.0}, {"depth_mm": 0.0}]}


@pytest.fixture(scope="module")
def valid() -> Callable[[dict[str, Any]], bool]:
    from jsonschema import Draft202012Validator

    Draft202012Validator.check_schema(schema())
    return Draft202012Validator(schema()).is_valid


def test_every_shipped_scene_and_the_template_are_valid(valid: Callable[[dict[str, Any]], bool], root: Path) -> None:
    scenes = [path.read_text(encoding="utf-8") for path in root.glob("geometries/*.toml")]
    scenes.append(resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8"))
    assert len(scenes) > 5
    assert all(valid(tomllib.loads(text)) for text in scenes)


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"finger": {"geometry": "thumb.STEP"}},
        {"finger": {"geometry": "thumb.msh"}},
        {"material": {"shore_A": 20.0}},
        {"object": {"tilt_deg": 3.0}},
        {"object": {"shape": "sphere", "radius_mm": 4}},
        {"press": {"force_N": 3.0, "steps": "auto"}},
        {"press": LEGS},
        {"parts": {"skin": {"rigid": True}}},
        {"effects": {"viscosity": {"prony": [[0.3, 0.5]]}, "large_deformation": {}}},
        {"effects": {"viscosity": False, "large_deformation": True}},
    ],
)
def test_what_a_scene_takes_is_valid(valid: Callable[[dict[str, Any]], bool], change: dict[str, Any]) -> None:
    assert valid(SCENE | change)


@pytest.mark.parametrize(
    "change",
    [
        {"fingr": {}},
        {"finger": {"geometry": "half_cylinder", "radius_mm": 5.0}},  # no width
        {"finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 2.0, "height_mm": 3.0}},
        {"finger": {"geometry": "thumb.obj"}},
        {"material": {"E_MPa": 1.0, "nu": 0.6}},
        {"material": {"E_MPa": 1.0}},
        {"material": {"E_MPa": 1.0, "nu": 0.49, "shore_A": 20.0}},
        {"object": {"shape": "plane", "radius_mm": 4.0}},
        {"object": {"shape": "sphere"}},
        {"press": {"depth_mm": 0.5, "force_N": 3.0}},
        {"press": {"steps": 5}},
        {"press": LEGS | {"depth_mm": 0.5}},
        {"effects": {"warmth": {}}},
        {"effects": {"large_deformation": 1}},
        {"effects": {"viscosity": {"prony": [[0.3, 0.5, 0.1]]}}},
        {"gauge": [{"name": "a", "x_mm": 1.0}]},
    ],
)
def test_what_a_scene_refuses_is_not_valid(valid: Callable[[dict[str, Any]], bool], change: dict[str, Any]) -> None:
    assert not valid(SCENE | change)


def test_every_key_has_its_meaning() -> None:
    def keys(node: Any) -> list[dict[str, Any]]:
        inner = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
        own = list(node["properties"].values()) if isinstance(node, dict) and "properties" in node else []
        return own + [key for child in inner for key in keys(child)]

    leaves = [key for key in keys(schema()) if "properties" not in key and "oneOf" not in key and "const" not in key]
    leaves = [key for key in leaves if "items" not in key and "additionalProperties" not in key]
    assert len(leaves) > 100
    assert not [key for key in leaves if not key.get("description")]
