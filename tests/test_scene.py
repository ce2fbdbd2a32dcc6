"""Scenes that load: defaults, overrides, the model they give, and the way back to TOML."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import finger3d.effects
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.fem.material import Isotropic
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
from finger3d.scene import load, parse

FINGER = {
    "geometry": "clipped_cylinder",
    "radius_mm": 100.0,
    "half_length_mm": 50.0,
    "edge_height_mm": 36.6,
    "width_mm": 20.0,
}
SMALL = {"finger": FINGER, "material": {"E_MPa": 1.0, "nu": 0.49}, "press": {"depth_mm": 10.0}}
HEIGHT = 36.6 + 100.0 - math.sqrt(100.0**2 - 50.0**2)


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


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
    scene = load(write(tmp_path, contract))
    model = scene.model()
    assert scene.title == "Fig. 9 finger, 20 mm wide"
    assert model.friction == Coulomb(0.25)
    assert model.mesh == MeshOptions(2.0, 8.0, "ftetwild")
    assert model.gauges[0].angle == pytest.approx(math.pi / 6)


@pytest.mark.parametrize(("domain", "share"), [("solid", 1.0), ("plane-strain", 0.25), ("plane-stress", 0.25)])
def test_absent_mesh_sizes_are_chosen_from_the_height(domain, share) -> None:
    mesh = parse({**SMALL, "model": {"domain": domain}}).model().mesh
    assert mesh.size_mm == pytest.approx(share * HEIGHT / 25, rel=1e-3)
    assert mesh.base_size_mm == pytest.approx(share * HEIGHT / 6.25, rel=1e-3)


@pytest.mark.parametrize("given_size", [{"size_mm": 10.0}, {"base_size_mm": 1.0}])
def test_a_chosen_size_never_contradicts_a_given_one(given_size) -> None:
    mesh = parse({**SMALL, "mesh": given_size}).model().mesh
    assert mesh.size_mm <= mesh.base_size_mm
    assert {k: getattr(mesh, k) for k in given_size} == given_size


def test_a_thin_finger_gets_two_elements_across() -> None:
    thin = parse({**SMALL, "finger": {**FINGER, "width_mm": 1.0}})
    assert thin.model().mesh.size_mm == pytest.approx(0.5)


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


@pytest.mark.parametrize(
    "finger",
    [
        {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 10.0},
        {"geometry": "block", "half_length_mm": 10.0, "height_mm": 5.0, "width_mm": 10.0},
    ],
)
def test_every_design_loads(finger) -> None:
    scene = parse({**SMALL, "finger": finger, "press": {"depth_mm": 0.5}})
    assert scene.design.height_mm == 5.0
    assert scene.as_dict()["finger"] == finger


def test_legs_press_slide_and_release() -> None:
    legs = [{"depth_mm": 10.0}, {"depth_mm": 10.0, "slide_x_mm": 2.0, "steps": "auto"}, {"depth_mm": 0.0, "steps": 5}]
    model = parse({**SMALL, "press": {"leg": legs}}).model()
    assert model.legs == (Leg(10.0, steps="auto"), Leg(10.0, slide_x_mm=2.0, steps="auto"), Leg(0.0, steps=5))


def test_whole_numbers_serve_as_numbers() -> None:
    assert parse({**SMALL, "friction": {"mu": 1}}) == parse({**SMALL, "friction": {"mu": 1.0}})


def test_overrides_are_applied_before_checking(tmp_path) -> None:
    # nu is missing in the file: only the override makes it a scene.
    path = write(tmp_path, parse(SMALL).to_toml(defaults=False).replace("nu = 0.49\n", ""))
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


def test_an_override_reaches_into_a_list(tmp_path) -> None:
    legs = {"leg": [{"depth_mm": 5.0}, {"depth_mm": 0.0}]}
    path = write(tmp_path, parse({**SMALL, "press": legs}).to_toml())
    assert load(path, ["press.leg.1.depth_mm=2.5"]).legs == (Leg(5.0, steps="auto"), Leg(2.5, steps="auto"))


def test_the_file_is_not_changed_by_an_override(tmp_path) -> None:
    path = write(tmp_path, parse(SMALL).to_toml())
    before = path.read_bytes()
    load(path, ["friction.mu=0.5"])
    assert path.read_bytes() == before


@pytest.mark.parametrize("defaults", [True, False])
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
def test_round_trip(extra, defaults) -> None:
    scene = parse({**SMALL, **extra})
    again = parse(tomllib.loads(scene.to_toml(defaults)))
    assert again == scene
    assert again.model() == scene.model()
    assert again.as_dict() == scene.as_dict()


@given(
    nu=st.floats(0.0, 0.5),
    mu=st.floats(0.0, 1e6),
    depth=st.floats(1e-2, 49.0),
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
    assert tree["effects"] == {}


def test_scenes_that_differ_are_not_equal() -> None:
    assert parse(SMALL) != parse({**SMALL, "friction": {"mu": 0.1}})


def test_byte_order_mark_and_windows_lines_are_taken(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + parse(SMALL).to_toml().replace("\n", "\r\n").encode())
    assert load(path) == parse(SMALL)


STIFFER = """
from dataclasses import dataclass, replace
from typing import Annotated
from annotated_types import Gt
from finger3d.errors import Finger3dError

@dataclass(frozen=True)
class Effect:
    factor: Annotated[float, Gt(0)]
    prony: tuple[tuple[float, float], ...] = ()

    def __post_init__(self):
        if self.factor > 100:
            raise Finger3dError(f"factor = {self.factor:g} is too large; allowed: at most 100")

    def apply(self, model):
        return replace(model, material=replace(model.material, E_MPa=model.material.E_MPa * self.factor))
"""


@pytest.fixture
def stiffer(tmp_path, monkeypatch):
    """An effect that only this test knows, as a file beside the real ones."""
    (tmp_path / "stiffer.py").write_text(STIFFER, encoding="utf-8")
    monkeypatch.setattr(finger3d.effects, "__path__", [*finger3d.effects.__path__, str(tmp_path)])
    yield "finger3d.effects.stiffer"
    sys.modules.pop("finger3d.effects.stiffer", None)


def test_a_present_effect_fills_its_slot_and_an_absent_one_is_not_imported(stiffer) -> None:
    assert parse(SMALL).model().material.E_MPa == 1.0
    assert stiffer not in sys.modules
    scene = parse({**SMALL, "effects": {"stiffer": {"factor": 3.0, "prony": [[0.3, 0.5]]}}})
    assert scene.model().material.E_MPa == 3.0
    assert scene.as_dict()["effects"] == {"stiffer": {"factor": 3.0, "prony": [[0.3, 0.5]]}}
    assert parse(tomllib.loads(scene.to_toml())) == scene


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"stifer": {}}, r'effects\.stifer: no such effect; did you mean "stiffer"\?'),
        ({"stiffer": {}}, r"effects\.stiffer\.factor is missing: a number above 0 and at most 1e12 is required"),
        ({"stiffer": {"factor": -1.0}}, r"effects\.stiffer\.factor = -1\.0: must be a number above 0"),
        (
            {"stiffer": {"factor": 1.0, "facter": 1}},
            r'effects\.stiffer\.facter = 1: no such key; did you mean "factor"',
        ),
        (
            {"stiffer": {"factor": 1.0, "prony": [[0.3]]}},
            r"prony = \[\[0\.3\]\]: must be a list, each item \[a number, a n",
        ),
        ({"stiffer": {"factor": 101.0}}, r"effects\.stiffer: factor = 101 is too large"),
        ({"stiffer": True}, r"effects\.stiffer = true: must be a table, \[effects\.stiffer\]"),
        ({"base": {}}, r"effects\.base: no such effect"),
    ],
)
def test_mistakes_in_an_effect(stiffer, effects, message) -> None:
    with pytest.raises(Finger3dError, match=message):
        parse({**SMALL, "effects": effects})


def test_loading_a_scene_needs_no_cad_and_no_drawing(tmp_path) -> None:
    path = write(tmp_path, parse(SMALL).to_toml())
    heavy = "{'OCP', 'build123d', 'vtk', 'vtkmodules', 'pyvista', 'pytetwild', 'matplotlib'}"
    code = f"import sys, finger3d; finger3d.load({str(path)!r}).model(); print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert re.fullmatch(r"set\(\)\n", done.stdout)


def test_the_reference_names_every_key_with_its_meaning() -> None:
    from finger3d.scene.reference import reference

    rows = [line.strip("| ").split(" | ") for line in reference().splitlines()[2:] if "**" not in line]
    assert len(rows) > 50
    assert all(row[-1].strip() for row in rows)
    keys = {row[0].strip("`") for row in rows}
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


def test_an_object_without_a_shape_is_a_plane() -> None:
    placed = parse({**SMALL, "object": {"x_mm": 1.0, "tilt_deg": 2.0}})
    assert placed == parse({**SMALL, "object": {"shape": "plane", "x_mm": 1.0, "tilt_deg": 2.0}})
    assert parse({**SMALL, "object": {}}) == parse(SMALL)


def test_the_template_names_every_design_shape_and_key_of_an_object() -> None:
    from importlib import resources

    from finger3d.geometry.registry import designs
    from finger3d.objects import OBJECTS
    from finger3d.scene.tables import table_of

    text = resources.files("finger3d").joinpath("new_scene.toml").read_text(encoding="utf-8")
    words = set(re.findall(r"\w+", text))
    assert {*designs(), *OBJECTS} <= words
    assert {key for record in OBJECTS.values() for key in table_of(record).model_fields} <= words
    assert {key for design in designs().values() for key in table_of(design).model_fields} <= words


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
