"""TOML files and overrides."""

from __future__ import annotations

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.model import Leg
from finger3d.scene import load, parse
from tests.scene_tables import SMALL
from tests.scenes import written


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


def test_an_override_reaches_into_a_list(tmp_path) -> None:
    legs = {"leg": [{"depth_mm": 5.0}, {"depth_mm": 0.0}]}
    path = written(tmp_path, parse({**SMALL, "press": legs}).to_toml())
    assert load(path, ["press.leg.1.depth_mm=2.5"]).legs == (Leg(5.0, steps="auto"), Leg(2.5, steps="auto"))


def test_the_file_is_not_changed_by_an_override(tmp_path) -> None:
    path = written(tmp_path, parse(SMALL).to_toml())
    before = path.read_bytes()
    load(path, ["friction.mu=0.5"])
    assert path.read_bytes() == before


def test_byte_order_mark_and_windows_lines_are_taken(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbf" + parse(SMALL).to_toml().replace("\n", "\r\n").encode())
    assert load(path) == parse(SMALL)
