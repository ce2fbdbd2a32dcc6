"""The page of an identification."""

from __future__ import annotations

import json
from pathlib import Path

from finger3d.report.identify import identify_page
from tests.scenes import words
from tests.sensor_cases import scene


def test_values_with_bounds_intervals_correlation_and_residuals(tmp_path: Path) -> None:
    value = {"value": 0.371, "std": 0.012, "low": 0.36, "high": 0.384}
    data = {
        "scene": scene().as_dict(), "measured": "bench/a.csv", "presses": 11, "notes": ["the depth is off"],
        "deviations": "of the noise",
        "values": {"material.E_MPa": value, "friction.mu": {**value, "value": 0.6}},
        "correlation": {
            "material.E_MPa": {"material.E_MPa": 1.0, "friction.mu": -0.25},
            "friction.mu": {"material.E_MPa": -0.25, "friction.mu": 1.0},
        },
        "residual_rms": {"normal_force_N": 0.4},
        "std_of_columns": {"normal_force_N": {"rms": 0.5, "from": "given"}},
    }  # fmt: skip
    task = {"free": [["material.E_MPa", 0.05, 5.0], ["friction.mu", 0.1, 1.0]]}
    for name, content in {"identify.json": data, "task.json": task}.items():
        (tmp_path / name).write_text(json.dumps(content), encoding="utf-8")
    page = identify_page(tmp_path)
    text, tables = words(page), page.read_text(encoding="utf-8").count("<table>")
    assert "a.csv" in text
    assert "material.E_MPa 0.371 ± 0.012" in text
    assert "material.E_MPa 0.05 5 0.371 0.012 0.36 to 0.384" in text
    assert "friction.mu -0.250 1.000" in text
    assert "normal_force_N 0.4 0.5 given" in text
    assert data["notes"][0] in text
    del data["values"]["friction.mu"]
    (tmp_path / "identify.json").write_text(json.dumps(data), encoding="utf-8")
    # one value is correlated with no other
    assert identify_page(tmp_path).read_text(encoding="utf-8").count("<table>") == tables - 1
