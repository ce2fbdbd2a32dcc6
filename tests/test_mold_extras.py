"""Files beside the mold."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from finger3d.mold.export import export
from finger3d.mold.extras import carrier_scene
from finger3d.mold.options import MoldOptions
from finger3d.scene import load
from tests.mold_cases import scene_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The block on a carrier, with a coupon and a button."""
    out = tmp_path_factory.mktemp("extras")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FINGER3D_RENDERER", "matplotlib")
        patch.setattr("finger3d.mold.page.step_pictures", lambda pictures: None)  # drawn in tests of the page
        done = export(scene_of("block"), out, MoldOptions(carrier=True, coupon=True, button=True))
    (out / "remarks.txt").write_text("\n".join(done.remarks))
    return out


def test_the_buttons_scene_loads_beside_its_body(folder) -> None:
    scene = load(folder / "button.toml")
    assert scene.tables.material.E_MPa == 1.0
    assert scene.design.height_mm == pytest.approx(12.5, abs=1e-3)
    told = (folder / "remarks.txt").read_text()
    assert f"finger3d identify {folder}/button.toml --measured {folder}/button.csv --free material.E_MPa=0.2:5" in told


def test_the_parts_beside_the_mold_are_printed_with_it(folder) -> None:
    names = {path.stem for path in folder.glob("mold_*.stl")}
    assert {"mold_carrier", "mold_coupon_peg", "mold_coupon_holes", "mold_button_ring", "mold_button_floor"} <= names
    assert re.search(r" 0\.05, 0\.1, .*--clearance-mm", (folder / "remarks.txt").read_text())


def test_the_finger_on_its_carrier_has_a_labelled_carrier(folder) -> None:
    from build123d import import_step

    silicone, carrier = import_step(str(folder / "finger_on_carrier.step")).children
    assert (silicone.label, carrier.label) == ("SOLID", "carrier")
    assert carrier.bounding_box().max.Y == pytest.approx(5.0, abs=1e-6)
    assert silicone.bounding_box().max.Y == pytest.approx(25.0, abs=1e-6)


def test_readings_move_up_with_the_silicone(folder) -> None:
    given = {
        "finger": {"geometry": "block"},
        "gauge": [{"name": "g", "x_mm": 1.0, "y_mm": 2.0}],
        "marker": ({"name": "m", "x_mm": 1.0, "y_mm": 9.0},),
        "mesh": {"mesher": "swept", "size_mm": 1.0},
        "parts": {"core": {"E_MPa": 2.0, "nu": 0.4}},
    }
    made = carrier_scene(given, 5.0)
    assert made["finger"] == {"geometry": "finger_on_carrier.step"}
    assert (made["gauge"][0]["y_mm"], made["marker"][0]["y_mm"]) == (7.0, 14.0)
    assert made["parts"] == {"core": {"E_MPa": 2.0, "nu": 0.4}, "carrier": {"rigid": True}}
    assert made["mesh"] == {"size_mm": 1.0}
    assert given["gauge"][0]["y_mm"] == 2.0
    assert "[parts.carrier]" in (folder / "finger_on_carrier.toml").read_text()


def test_the_scene_of_the_finger_on_its_carrier_loads(folder) -> None:
    """The block, 20 mm high, stands on 5 mm of rigid carrier."""
    scene = load(folder / "finger_on_carrier.toml")
    assert scene.design.part_labels == ("carrier",)
    assert scene.design.height_mm == pytest.approx(25.0, abs=1e-3)
    assert scene.model().parts
