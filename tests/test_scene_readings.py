"""Markers and taxels in a scene: what is refused, and what a press writes about them."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.scene import parse

SCENE = {
    "finger": {"geometry": "block", "half_length_mm": 4.0, "height_mm": 3.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.3},
    "friction": {"mu": 0.3},
    "object": {"shape": "sphere", "radius_mm": 4.0},
    "press": {"depth_mm": 0.3, "steps": 2},
    "mesh": {"size_mm": 0.8, "base_size_mm": 1.2, "mesher": "swept"},
}
MARKER = {"name": "m1", "x_mm": 1.0, "y_mm": 2.0}
TAXEL = {"name": "t1", "x_mm": 0.0, "z_mm": 0.0, "length_mm": 2.0, "width_mm": 2.0}


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"marker": [{**MARKER, "y_mm": 3.5}]}, 'marker.0.y_mm = 3.5: marker "m1" '),
        ({"marker": [{**MARKER, "z_mm": 2.5}]}, 'marker.0.z_mm = 2.5: marker "m1" '),
        ({"marker": [{**MARKER, "angle_deg": 3.0}]}, "marker.0.angle_deg"),
        ({"marker": [MARKER, MARKER]}, 'marker.name = "m1": '),
        ({"marker": [MARKER], "taxel": [{**TAXEL, "name": "m1"}]}, '.name = "m1": '),
        ({"marker": [MARKER], "taxel": [{**TAXEL, "name": "m1.x"}]}, 'taxel.name = "m1.x": '),
        ({"taxel": [{**TAXEL, "x_mm": 3.5}]}, 'taxel.0.x_mm = 3.5: taxel "t1" .* -3 to 3'),
        ({"taxel": [{**TAXEL, "width_mm": 5.0}]}, 'taxel.0.z_mm = 0.0: taxel "t1" '),
        ({"taxel": [{**TAXEL, "length_mm": 0.0}]}, "taxel.0.length_mm = 0.0: "),
        ({"taxel": [{**TAXEL, "width_mm": None}]}, "taxel.0.width_mm is missing: .* required of a solid"),
        ({"marker_grid": {"spacing_mm": 1e-3}}, "marker_grid.spacing_mm = 0.001: .* 0.04 to 8"),
        ({"marker_grid": {}}, "marker_grid.spacing_mm "),
    ],
)
def test_a_mistake_is_named(tables: dict, said: str) -> None:
    with pytest.raises(Finger3dError) as error:
        parse(SCENE | tables)
    assert re.search(said, str(error.value))


def test_a_taxel_must_stay_on_a_round_base() -> None:
    dome = SCENE | {"finger": {"geometry": "hemisphere", "radius_mm": 4.0}, "mesh": {"size_mm": 0.8}}
    parse(dome | {"taxel": [TAXEL]})
    with pytest.raises(Finger3dError, match="taxel"):
        parse(dome | {"taxel": [{**TAXEL, "x_mm": 2.9, "z_mm": 2.9}]})


def test_a_taxel_of_a_section_needs_no_width() -> None:
    narrow = {key: value for key, value in TAXEL.items() if key != "width_mm"}
    (taxel,) = parse(SCENE | {"model": {"domain": "plane-strain"}, "taxel": [narrow]}).model().taxels
    assert taxel.width_mm is None
    with pytest.raises(Finger3dError, match="width_mm is missing"):
        parse(SCENE | {"taxel": [narrow]})


def test_a_file_has_no_section_to_sweep(tmp_path: Path) -> None:
    from tests.bodies import box, write_stl

    finger = {"geometry": str(write_stl(tmp_path / "box.stl", box(4.0, 3.0, 4.0)))}
    with pytest.raises(Finger3dError, match=r"is a file, of which no section is known .* must be \"ftetwild\""):
        parse(SCENE | {"finger": finger})


@pytest.mark.parametrize("domain", ["solid", "plane-strain"])
def test_a_press_writes_every_reading(tmp_path: Path, domain: str) -> None:
    given = SCENE | {
        "marker": [MARKER],
        "taxel": [TAXEL],
        "marker_grid": {"spacing_mm": 2.0},
        "model": {"domain": domain},
    }
    scene = tmp_path / "scene.toml"
    scene.write_text(parse(given).to_toml(), encoding="utf-8")
    assert main(["press", str(scene), "--out", str(tmp_path / "out")]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    step = summary["steps"][-1]
    assert len(step["markers"]["m1"]) == 3
    assert step["taxels"]["t1"] > 0.0
    names = {"marker_m1_x_mm", "marker_m1_y_mm", "taxel_t1_MPa"}
    assert names <= set(summary["error_estimate"]["discretisation"])
    assert ("marker_m1_z_mm" in summary["error_estimate"]["discretisation"]) == (domain == "solid")
    with (tmp_path / "out" / "history.csv").open() as stream:
        last = list(csv.DictReader(stream))[-1]
    assert float(last["marker_m1_y_mm"]) == pytest.approx(step["markers"]["m1"][1], rel=1e-12)
    assert float(last["taxel_t1_MPa"]) == pytest.approx(step["taxels"]["t1"], rel=1e-12)
    with (tmp_path / "out" / "markers.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    # every 2 mm from -4 to 4 mm along x, and from -2 to 2 mm along z
    assert len(rows) == 2 * (1 + 5 * (3 if domain == "solid" else 1))
    assert float(rows[-1]["y_mm"]) == pytest.approx(3.0)
    under = next(r for r in rows if r["step"] == "2" and r["marker"] != "m1" and abs(float(r["x_mm"])) < 1.0
                 and abs(float(r["z_mm"])) < 1.0)  # fmt: skip
    # the marker under the lowest point of the ball goes down with it, but for the ball's sag over an edge of 0.8 mm
    assert float(under["displacement_y_mm"]) == pytest.approx(-0.3, abs=0.8**2 / (2.0 * 4.0))
    # the bar of the scene's marker is that of the summary, and the grid has its own
    bars = [float(r["error_y_mm"]) for r in rows]
    parts = [summary["error_estimate"][part]["marker_m1_y_mm"] for part in ("discretisation", "steps")]
    assert bars[len(rows) // 2] == pytest.approx(sum(parts), rel=1e-12)
    assert np.isnan(bars[: len(rows) // 2]).all()
    assert min(bars[len(rows) // 2 :]) > 0.0
    assert (tmp_path / "out" / "markers.png").stat().st_size > 10_000
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "taxel t1" in page
    assert "marker m1" in page
