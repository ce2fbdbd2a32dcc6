"""Calibrations as files and commands: what is written, read, refused, and kept when something fails."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.sensor import Tolerance, estimate, load, save
from tests.commands import run
from tests.sensor_cases import curve, saturating, straight


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
    cases = {
        "not JSON, or cut short": good[: len(good) // 2],
        "version 9, this finger3d reads version 5; calibrate again": json.dumps({**data, "version": 9}),
        "version 2, this finger3d reads version 5; calibrate again": json.dumps({**data, "version": 2}),
        "version 1 of several readings, this finger3d reads version 5; calibrate again": json.dumps(
            {**data, "format": "finger3d joint calibration", "version": 1}
        ),
        "no calibration": json.dumps([1, 2]),
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


def parts(node: Any, place: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Places of all parts of a tree."""
    for key in node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ():
        yield (*place, key)
        yield from parts(node[key], (*place, key))


def test_a_file_with_any_part_changed_or_removed_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """Every number is changed by 1e-9 of itself, every word by a letter; every part is removed."""
    one, path = Tolerance("nu", "1", 0.003, np.ones(25), np.ones(25)), tmp_path / "calibration.json"
    text = save(curve(straight, tolerances=(one,), failed=((0.3, "x"),)), path).read_text()
    places = list(parts(json.loads(text)))
    assert len(places) > 200
    for removed in (False, True):
        for place in places:
            data = node = json.loads(text)
            for key in place[:-1]:
                node = node[key]
            value = node.pop(place[-1])
            if not removed and isinstance(value, int | float | str):
                changed = f"{value}x" if isinstance(value, str) else 1.000000001 * value + 1e-12
                node.update({place[-1]: changed}) if isinstance(node, dict) else node.insert(place[-1], changed)
            path.write_text(json.dumps(data))
            with pytest.raises(Finger3dError, match="checksum|no calibration|version"):
                load(path)
    assert run("estimate", path, "--strain", "0.01") == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
