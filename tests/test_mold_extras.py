"""Files beside the mold; the test button: its mold, its scene, and what its press tells."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import pytest

from finger3d.cli import main
from finger3d.mold.body import shell, write_step
from finger3d.mold.export import export
from finger3d.mold.extras import (
    SIZES,
    Button,
    button_for,
    button_parts,
    button_scene,
    button_solid,
    carrier_scene,
    identify_command,
)
from finger3d.mold.options import MoldOptions
from finger3d.mold.printing import check_print
from finger3d.scene import load, parse, tree
from tests.mold_cases import scene_of


def test_the_button_needs_no_more_silicone_than_the_fingers() -> None:
    assert button_for(91e3) == Button(29.0, 12.5)
    assert button_for(393.0) == Button(13.0, 6.3)
    assert Button(29.0, 12.5).volume_mm3 == pytest.approx(math.pi / 4.0 * 29.0**2 * 12.5)


@pytest.mark.parametrize("printer", ["fdm-0.4", "sla"])
@pytest.mark.parametrize("size", SIZES)
def test_the_ring_on_its_floor_casts_the_button(printer, size) -> None:
    """Between the step of the floor and the rim of the ring: the button, enlarged by the shrinkage."""
    from build123d import Pos

    o, button = MoldOptions(printer=printer, shrinkage=0.01), Button(*size)
    ring, floor = button_parts(button, o).values()
    plate = floor.bounding_box().max.Z - 1.5
    stands = Pos(0, 0, plate) * ring
    shared = stands & floor
    assert shared is None or sum(s.volume for s in shared.solids()) == pytest.approx(0.0, abs=1e-9)
    height = stands.bounding_box().max.Z - floor.bounding_box().max.Z
    assert height == pytest.approx(button.height_mm / 0.99)
    bore = min(face.radius for face in ring.faces() if face.radius)
    assert bore == pytest.approx(button.diameter_mm / 2.0 / 0.99)
    for name, part in (("ring", ring), ("floor", floor)):
        seen = check_print(shell(part, 0.05, name).surface, 0.5)
        assert (seen.defect, len(seen.islands)) == ("", 0)
        assert seen.wall_mm >= 0.97 * o.machine.thinnest_mm


@pytest.mark.slow
def test_identify_finds_the_modulus_of_the_batch(tmp_path: Path, capsys) -> None:
    """Young's modulus of a press with another one, through the files and the command that export names."""
    button = Button(13.0, 6.3)
    write_step(tmp_path / "button.step", button_solid(button))
    (tmp_path / "button.toml").write_text(tree.written(button_scene(button, "batch", 0.4, 0.45)))
    stiffer = ["press", str(tmp_path / "button.toml"), "--set", "material.E_MPa=0.52", "--out", str(tmp_path / "made")]
    assert main([*stiffer, "--no-error"]) == 0
    steps = json.loads((tmp_path / "made" / "summary.json").read_text())["steps"]
    with open(tmp_path / "button.csv", "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["depth_mm", "normal_force_N"])
        rows.writerows((step["depth_mm"], step["normal_force_N"]) for step in steps)
    assert main(identify_command(str(tmp_path), 0.4).split()[1:]) == 0
    found = json.loads((tmp_path / "button" / "identify.json").read_text())["values"]["material.E_MPa"]["value"]
    # force is proportional to E; meshes of fTetWild differ from run to run by less than 1 %
    assert found == pytest.approx(0.52, rel=0.01)


def test_the_scene_is_one(tmp_path: Path) -> None:
    button = Button(13.0, 6.3)
    write_step(tmp_path / "button.step", button_solid(button))
    given = button_scene(button, "batch", 0.4, 0.45)
    scene = parse({**given, "finger": {"geometry": str(tmp_path / "button.step")}})
    assert scene.design.height_mm == pytest.approx(6.3, abs=1e-3)
    assert scene.design.volume_mm3 == pytest.approx(button.volume_mm3, rel=5e-3)
    assert scene.legs[-1].depth_mm == pytest.approx(0.63)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The block on a carrier, with a coupon and a button."""
    out = tmp_path_factory.mktemp("extras")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FINGER3D_RENDERER", "matplotlib")
        patch.setattr("finger3d.mold.output.step_pictures", lambda pictures: None)  # drawn in tests of the page
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
