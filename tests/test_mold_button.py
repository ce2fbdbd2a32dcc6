"""The test button: its mold, its scene, and what its press tells."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import pytest

from finger3d.cli import main
from finger3d.mold.button import SIZES, Button, button_for, button_parts, button_scene, button_solid, identify_command
from finger3d.mold.options import MoldOptions
from finger3d.mold.shell import shell, write_step
from finger3d.mold.slicer import check_print
from finger3d.scene import parse, tree


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
