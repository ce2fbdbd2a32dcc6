"""Checks of a scene beyond single keys."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.scene import parse
from tests.commands import refused
from tests.scene_tables import FINGER, SMALL


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("model.domain=plane-strain", ['model.domain = "plane-strain"', '"solid"']),
        ("mesh.mesher=swept", ['mesh.mesher = "swept"', '"ftetwild"']),
        ("gauge=[{name='a', x_mm=9.0, y_mm=1.0, z_mm=9.0}]", ["gauge.0.z_mm = 9.0"]),
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
        ({"material": {"E_MPa": 100.0, "nu": 0.4}}, []),
        ({"material": {"E_MPa": 5e-4, "nu": 0.4}}, ["0.0005, not from 0.001 to 100"]),
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
