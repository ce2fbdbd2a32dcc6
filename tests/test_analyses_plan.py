"""The plan of a press: effects, size and cost."""

from __future__ import annotations

from pathlib import Path

import finger3d
import finger3d.analyses.press
from tests.scenes import SECTION, written


def test_a_plan_forecasts_size_time_and_memory(tmp_path: Path) -> None:
    plan = finger3d.plan(written(tmp_path, SECTION))
    assert plan.dofs > plan.contact_points > 0
    assert plan.total_s > 0.0
    assert plan.memory_MB > 0.0
    assert plan.summary()["forecast"]["dofs"] == plan.dofs
