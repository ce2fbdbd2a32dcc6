"""Settings of elastic objects: what is refused."""

from __future__ import annotations

import pytest

from finger3d.effects.elastic_object import Effect
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import ElasticObject, Leg
from finger3d.objects import Cylinder, MeshObject, Sphere
from finger3d.scene import parse
from tests.soft_object_cases import half_ball, pad


def test_what_the_settings_refuse() -> None:
    for obj in (Sphere(radius_mm=4.0), Cylinder(radius_mm=4.0), MeshObject(surface=half_ball(4.0))):
        with pytest.raises(Finger3dError, match=r"effects\.elastic_object\.height_mm: "):
            Effect(1.0, 0.3, 5.0).apply(pad(object=obj))
    with pytest.raises(Finger3dError, match='model.domain = "solid"'):
        Effect(1.0, 0.3).apply(pad(object=MeshObject(surface=half_ball(4.0)), domain="plane-strain"))
    slid = Effect(1.0, 0.3).apply(pad(legs=(Leg(0.3, slide_x_mm=1.0),)))
    assert any("compliance" in w for w in slid.warnings)


def test_a_scene_names_the_effect() -> None:
    tables = {
        "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 6.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": 0.3},
        "effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4}},
    }
    model = parse(tables).model()
    assert model.object_compliance == ElasticObject(10.0, 0.4, None)
    for key, value, text in (
        ("nu", 0.6, "from 0 to 0.5"),
        ("E_MPa", 0.0, "from 1e-9 to 1e9"),
        ("height_mm", -1.0, "from 1e-6 to 1e6"),
    ):
        bad = {**tables, "effects": {"elastic_object": {"E_MPa": 10.0, "nu": 0.4, key: value}}}
        with pytest.raises(Finger3dError, match=text):
            parse(bad)
