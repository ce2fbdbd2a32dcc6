"""Calibrations as files and commands: what is written, read, refused, and kept when something fails."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.sensor import Tolerance, estimate, load, save
from tests.commands import run
from tests.sensor_cases import curve, saturating, straight

G = ("readings", "g")


def test_a_calibration_comes_back_from_its_file_as_it_was(tmp_path: Path) -> None:
    before = curve(
        saturating,
        tolerances=(Tolerance("nu", "1", 0.003, np.linspace(0.0, 1.0, 25), np.linspace(0.0, 1e-3, 25)),),
        failed=((0.3, "x"),),
    )
    after = load(save(before, tmp_path / "calibration.json"))
    assert np.array_equal(after["g"].reading, before["g"].reading)
    assert np.array_equal(after["g"].tolerances[0].slope, before["g"].tolerances[0].slope)
    assert after.failed == before.failed
    assert estimate(after, 0.005)[0] == estimate(before, 0.005)[0]


def test_calibration_files_that_are_none(tmp_path: Path) -> None:
    good = save(curve(straight), tmp_path / "good.json").read_text()
    data = json.loads(good)
    own = data["readings"]["g"]

    def changed(**changes: Any) -> str:
        return json.dumps(data | {"readings": {"g": own | changes}})

    cases = {
        "not JSON, or cut short": good[: len(good) // 2],
        "version 9, this finger3d reads version 4; calibrate again": json.dumps({**data, "version": 9}),
        "version 2, this finger3d reads version 4; calibrate again": json.dumps({**data, "version": 2}),
        "version 1 of several readings, this finger3d reads version 4; calibrate again": json.dumps(
            {**data, "format": "finger3d joint calibration", "version": 1}
        ),
        "no calibration": json.dumps([1, 2]),
        "readings: missing": json.dumps({k: v for k, v in data.items() if k != "readings"}),
        "readings: there are none": json.dumps(data | {"readings": {}}),
        "readings.g: must be a table": json.dumps(data | {"readings": {"g": 3}}),
        "must be a name without control characters": json.dumps(data | {"readings": {"\033[31m": own}}),
        "readings.g.kind = 'x': must be gauge": changed(kind="x"),
        "readings.g.noise = 0.0: must be a number from 1e-12 to 1000": changed(noise=0.0),
        "readings.g: must have a reading and tolerances for each of the 25": changed(curve=own["curve"][:5]),
        "readings.g.curve: must be a list": changed(curve=3),
        "readings.g.curve.0 = nan: must be": changed(curve=[float("nan")] * 25),
        "resolution_limit = True: must be a number": json.dumps({**data, "resolution_limit": True}),
        "failed.mu: missing": json.dumps({**data, "failed": ["x"]}),
        "mu.0 = 'a': must be a number from 0": json.dumps({**data, "mu": ["a", 1.0, 2.0, 3.0]}),
        "mu: must be at least 4 values that ascend": json.dumps(data | {"mu": data["mu"][::-1]}),
    }
    for told, text in cases.items():
        path = tmp_path / "bad.json"
        path.write_text(text)
        with pytest.raises(Finger3dError, match=told) as found:
            load(path)
        assert "\n" not in str(found.value)
        assert str(found.value).startswith(str(path))
    with pytest.raises(Finger3dError, match="none.json"):
        load(tmp_path / "none.json")
    with pytest.raises(Finger3dError, match=str(tmp_path)):
        load(tmp_path)


@pytest.mark.parametrize(
    ("place", "value"),
    [((*G, "noise"), 1e300), (("resolution_limit",), 1e300), ((*G, "curve", 3), -1e300), (("mu", 24), 1e300),
     ((*G, "tolerances", "nu", "sd"), 1e300), ((*G, "tolerances", "nu", "per_unit", 2), 1e300),
     ((*G, "tolerances", "nu", "per_unit_squared", 2), 1e300)],
)  # fmt: skip
def test_a_number_that_would_overflow_is_refused(
    place: tuple[Any, ...], value: float, tmp_path: Path, capsys: Any
) -> None:
    one = Tolerance("nu", "1", 0.003, np.ones(25), np.ones(25))
    data = json.loads(save(curve(straight, tolerances=(one,)), tmp_path / "calibration.json").read_text())
    node = data
    for key in place[:-1]:
        node = node[key]
    node[place[-1]] = value
    (tmp_path / "calibration.json").write_text(json.dumps(data))
    assert run("estimate", tmp_path / "calibration.json", "--strain", "0.01") == 2
    err = capsys.readouterr().err
    assert ".".join(map(str, place)) in err
    assert len(err.splitlines()) == 1
