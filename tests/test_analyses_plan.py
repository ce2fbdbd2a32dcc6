"""The plan of a press: effects, size and cost."""

from __future__ import annotations

from pathlib import Path

import finger3d
import finger3d.analyses.press
from tests.scenes import SECTION, written


def test_a_plan_forecasts_size_time_and_memory(tmp_path: Path) -> None:
    plan = finger3d.plan(written(tmp_path, SECTION))
    assert plan.dofs > plan.contact_points > 0
    assert plan.total_s > plan.forecast["error_bars_s"] > 0.0
    assert plan.memory_MB > 0.0
    assert plan.summary()["forecast"]["dofs"] == plan.dofs


def test_a_plan_tells_the_size_of_a_file_as_it_lies(tmp_path: Path) -> None:
    from tests.bodies import box, write_stl

    stl = write_stl(tmp_path / "box.stl", box(30.0, 16.0, 12.0, (7.0, -3.0, 2.0)))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'[finger]\ngeometry = "{stl}"\n[material]\nE_MPa = 1.0\nnu = 0.3\n[press]\ndepth_mm = 0.5\n', encoding="utf-8"
    )
    found = finger3d.plan(scene).forecast["finger"]
    assert found == "30 x 16 x 12 mm (x, y up, z), base 30 x 12 mm; unit of the file: mm, as STL files have none"
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text.replace("[finger]\n", '[finger]\nup = "z"\n'), encoding="utf-8")
    lying = finger3d.plan(scene).forecast["finger"]
    assert lying.startswith("30 x 12 x 16 mm (x, y up, z), base 30 x 16 mm; ")
    assert lying.endswith(", its z turned up")
