"""Scenes: defaults, models, and their tables as TOML."""

from __future__ import annotations

import json
import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.model import Leg, MeshOptions
from finger3d.objects import Plane
from finger3d.scene import load, parse
from tests.scene_tables import HEIGHT, SMALL
from tests.scenes import written


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
    "finger",
    [
        {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 10.0},
        {"geometry": "block", "half_length_mm": 10.0, "height_mm": 5.0, "width_mm": 10.0, "skin_mm": 0.5},
    ],
)
def test_every_design_loads(finger) -> None:
    scene = parse({**SMALL, "finger": finger, "press": {"depth_mm": 0.5}})
    assert scene.design.height_mm == 5.0
    assert scene.as_dict()["finger"] == finger


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
    scene = parse({**SMALL, "friction": {"mu": 0.2}, **extra})
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


def test_scenes_that_differ_are_not_equal() -> None:
    assert parse(SMALL) != parse({**SMALL, "friction": {"mu": 0.1}})


def test_an_object_without_a_shape_is_a_plane() -> None:
    placed = parse({**SMALL, "object": {"x_mm": 1.0, "tilt_deg": 2.0}})
    assert placed == parse({**SMALL, "object": {"shape": "plane", "x_mm": 1.0, "tilt_deg": 2.0}})
    assert parse({**SMALL, "object": {}}) == parse(SMALL)
