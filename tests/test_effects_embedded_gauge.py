"""Settings of embedded gauges: what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.contact.friction import Coulomb
from finger3d.effects.embedded_gauge import Effect
from finger3d.errors import Finger3dError
from finger3d.fem.solids.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Foils, Gauge, Leg, MeshOptions, Model
from finger3d.objects import Sphere
from finger3d.scene import parse

FOIL = Effect(3000.0, 0.02, 1.0)

LEGS = (Leg(0.3, steps=3, duration_s=1.0), Leg(0.3, slide_x_mm=0.1, steps=2, duration_s=1.0))

MIDDLE = Gauge("g", 0.0, 1.6, 0.0, 0.0, 2.0)


def block(**changes: object) -> Model:
    body = designs()["block"](half_length_mm=4.0, height_mm=3.0, width_mm=4.0)
    model = Model(
        body, Isotropic(1.0, 0.3), MeshOptions(0.8, 1.2, "swept"), LEGS[:1], object=Sphere(radius_mm=4.0),
        friction=Coulomb(0.25), gauges=(MIDDLE,),
    )  # fmt: skip
    return replace(model, **changes)


def scene_of(effect: dict, *gauges: dict, **more: object) -> dict:
    return {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
        "material": {"E_MPa": 1.0, "nu": 0.3}, "press": {"depth_mm": 0.5}, "gauge": gauges,
        "effects": {"embedded_gauge": effect}, **more,
    }  # fmt: skip


FOIL_TABLE = {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0}

GOOD = {"name": "g", "x_mm": 0.0, "y_mm": 3.0, "length_mm": 2.0}


@pytest.mark.parametrize(
    ("effect", "gauges", "says"),
    [
        (FOIL_TABLE, (), r"effects\.embedded_gauge: .*\[\[gauge\]\]"),
        (FOIL_TABLE, ({**GOOD, "length_mm": 0.0},), r"gauge\.0\.length_mm = 0\.0: .* 0 "),
        (FOIL_TABLE, ({**GOOD, "y_mm": 6.0},), r"gauge\.0\.y_mm = 6\.0: "),
        (FOIL_TABLE, ({**GOOD, "length_mm": 9.0},), r"gauge\.0\.length_mm = 9\.0: "),
        ({**FOIL_TABLE, "thickness_mm": 1.0}, (GOOD,), r"thickness_mm = 1\.0: "),
        ({**FOIL_TABLE, "width_mm": 4.5}, (GOOD,), r"width_mm = 4\.5: gauge \"g\" .* 4 "),
        (FOIL_TABLE, ({**GOOD, "z_mm": 1.0},), r"width_mm = 3\.0: gauge \"g\" .* 2 "),
        (
            {**FOIL_TABLE, "E_MPa": 0.0},
            (GOOD,),
            r"effects\.embedded_gauge\.E_MPa = 0\.0: ",
        ),
        ({"E_MPa": 1.0, "width_mm": 1.0}, (GOOD,), r"effects\.embedded_gauge\.thickness_mm "),
        (FOIL_TABLE, (GOOD, {**GOOD, "name": "g_free"}), r"gauge\.name = \"g_free\": "),
    ],
)
def test_mistakes_are_one_line(effect: dict, gauges: tuple, says: str) -> None:
    with pytest.raises(Finger3dError, match=says) as caught:
        parse(scene_of(effect, *gauges))
    assert "\n" not in str(caught.value)


def test_python_users_are_told_too_that_a_gauge_lies_outside() -> None:
    with pytest.raises(Finger3dError, match="outside"):
        build(FOIL.apply(block(gauges=(replace(MIDDLE, y_mm=3.5),))))
    assert Foils(1.0, 2.0, 3.0) == Foils(1.0, 2.0, 3.0)
