"""Settings of embedded gauges: what is refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Foils
from finger3d.scene import parse
from tests.foil_cases import FOIL, FOIL_TABLE, GOOD, MIDDLE, block, scene_of


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
