"""Several readings calibrated in the same presses: each as if alone, with tolerances that they share."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate.run import calibrate
from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.sensor import Calibration, ReadingCurve, load
from tests.sensor_cases import FEW, NONE, scene

SENSORS: dict[str, Any] = {
    "marker": [{"name": "m1", "x_mm": 30.0, "y_mm": 40.0}],
    "taxel": [{"name": "t1", "x_mm": 20.0, "length_mm": 6.0, "width_mm": 6.0}],
}
SOME = {**NONE, "depth_mm": 0.1, "E_percent": 5.0, "nu": 0.003, "tilt_deg": 0.5, "gauge_y_mm": 0.3, "mesh": 1.0}


@pytest.fixture(scope="module")
def joint() -> Calibration:
    found = calibrate(scene(**SENSORS), ["g36", "m1.x", "t1"], mus=FEW, tolerances=SOME)
    return found


def tolerance(one: ReadingCurve, name: str) -> Any:
    return next(t for t in one.tolerances if t.name == name)


def test_each_reading_is_calibrated_as_if_alone(joint: Calibration) -> None:
    alone = calibrate(scene(), "g36", mus=FEW, tolerances=SOME)
    gauge, (other_gauge,) = joint.readings[0], alone.readings
    assert gauge.reading == pytest.approx(other_gauge.reading, rel=1e-9)
    assert [t.name for t in gauge.tolerances] == [t.name for t in other_gauge.tolerances]
    for own, other in zip(gauge.tolerances, other_gauge.tolerances, strict=True):
        assert own.slope == pytest.approx(other.slope, rel=1e-6, abs=1e-9)
        assert own.spread == pytest.approx(other.spread, rel=1e-6, abs=1e-12)
    assert [c.kind for c in joint.readings] == ["gauge", "marker", "taxel"]
    assert [c.noise for c in joint.readings] == [1.5e-4, 0.02, 1e-3]


def test_the_modulus_changes_pressures_alone(joint: Calibration) -> None:
    gauge, marker, taxel = joint.readings
    assert tolerance(gauge, "E_percent").spread == pytest.approx(0.0)
    assert tolerance(marker, "E_percent").spread == pytest.approx(0.0)
    assert tolerance(taxel, "E_percent").slope == pytest.approx(0.01 * taxel.reading, rel=0.05)


def test_a_place_is_a_tolerance_of_gauges_alone(joint: Calibration) -> None:
    assert [any(t.name == "gauge_y_mm" for t in c.tolerances) for c in joint.readings] == [True, False, False]


def test_a_tilt_is_that_of_tilted_presses(joint: Calibration) -> None:
    """By sqrt(3) deviations to both sides."""
    model, tilt = scene(**SENSORS).model(), 0.5 * 3.0**0.5
    change = {}
    for sign in (1.0, -1.0):
        tilted = replace(model, object=replace(model.object, tilt=sign * np.radians(tilt)), symmetry=())
        *_, last = march(build(replace(tilted, friction=tilted.friction.with_mu(0.6))))
        change[sign] = last.named_readings
    for one in joint.readings:
        expected = 0.5 * (change[1.0][one.name] - change[-1.0][one.name])
        found = tilt * tolerance(one, "tilt_deg").slope[list(FEW).index(0.6)]
        # the meshes of the tilted bodies differ
        assert found == pytest.approx(expected, rel=0.3, abs=0.1 * abs(one.reading).max() * 0.05)


def test_all_readings_together_tell_no_less_than_each(joint: Calibration) -> None:
    together = joint.mu_sd(joint.mu)
    for name in joint.names:
        assert (together <= joint.of([name]).mu_sd(joint.mu) * (1.0 + 1e-9)).all()


def test_files_of_a_joint_calibration(tmp_path: Path) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "cal"
    path.write_text(scene(**SENSORS).to_toml())
    mu = ",".join(map(str, FEW))
    off = [f"--tolerance={name}=0" for name in NONE if name != "depth_mm"]
    assert main(["calibrate", str(path), "--gauge", "g36, t1", "--out", str(out), "--mu", mu, *off]) == 0
    found = load(out / "calibration.json")
    assert found.names == ("g36", "t1")
    with (out / "calibration.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(r["t1"]) for r in rows] == pytest.approx(list(found.readings[1].reading))
    assert {"calibration.png", "reduced.npz", "report.html", "scene.toml"} <= {p.name for p in out.iterdir()}
    assert set(json.loads((out / "calibration.json").read_text())["variance_reductions"]) == {"noise", "depth_mm"}


def test_a_single_marker_is_calibrated_as_a_gauge_is() -> None:
    found = calibrate(scene(**SENSORS), "m1.x", mus=FEW, tolerances=NONE, marker_noise_mm=0.05)
    assert found.noise == pytest.approx([0.05])


@pytest.mark.parametrize(
    ("gauge", "options", "told"),
    [
        (["g36", "x1"], {}, "--gauge x1: "),
        (["g36", "m1"], {}, '"m1.'),
        (["g36", "g36"], {}, "--gauge g36: "),
        ([], {}, "--gauge: "),
        (["g36", "t1"], {"maps": True}, "--map: "),
        (["m1.x"], {"marker_noise_mm": 0.0}, "--marker-noise 0: "),
        (["t1"], {"taxel_noise_MPa": -1.0}, "--taxel-noise -1: "),
    ],
)
def test_what_is_refused(gauge: list[str], options: Any, told: str) -> None:
    with pytest.raises(Finger3dError) as found:
        calibrate(scene(**SENSORS), gauge, mus=FEW, **options)
    assert told in str(found.value)


@pytest.mark.slow
def test_readings_at_large_deformation() -> None:
    """At a small depth they are those of small strain."""
    shallow = {"press": {"depth_mm": 0.2, "steps": 3}, **SENSORS}
    names = ["g36", "m1.x", "t1"]
    small, large = (
        calibrate(scene(**shallow, effects=effects), names, mus=FEW[:4], tolerances={**NONE, "depth_mm": 0.01})
        for effects in ({}, {"large_deformation": {}})
    )
    for one, other in zip(small.readings, large.readings, strict=True):
        assert other.reading == pytest.approx(one.reading, rel=0.05, abs=0.02 * np.abs(one.reading).max())
