"""What an error costs beyond the runs of cost_of_accuracy, and the table of docs/cost.md."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from validation._cost import SECTION, Case
from validation._cost_extrapolated import at, constant, extrapolate, rate, unknowns
from validation._cost_table import markdown
from validation._cost_truth import Advice, Known, Truth
from validation._rows import committed

CASES = [Case(SECTION, size, 4.0 * size) for size in (4.0, 2.0, 1.0, 0.5)]
TRUTH = Truth(1.0, 1e-3, 0.0)
ERRORS = {case: {"force": 0.02 * case.size} for case in CASES}
UNKNOWN = Advice("force", 0.001, None, 0, 0.0, 0.0, 0.0, 0, 1e-3)


def _run(case: Case, counts: tuple[int, ...] = (10,)) -> dict[str, Any]:
    """A press whose time grows with the unknowns, and whose errors fall with the increments."""
    dofs = 1000.0 / case.size**2
    parts = {"mesh": 1e-6 * dofs, "assembly": 0.0, "condensation": 1e-4 * dofs}
    parts |= {f"contact {n}": 1e-5 * dofs * n for n in counts}
    numbers = {str(n): {"force": 1.0 + 0.004 / n**2} for n in counts}
    return {"processor_seconds": parts, "dofs": dofs, "peak_MB": 80.0 + 0.05 * dofs, "numbers": numbers}


RUNS = {case: _run(case) for case in CASES}
LADDER = replace(CASES[2], counts=(5, 10, 20))


def test_errors_follow_the_edge_length_at_the_rate_of_those_that_are_known() -> None:
    assert rate("force", [(CASES, TRUTH)], ERRORS) == pytest.approx(1.0)
    # an error that is small by chance counts as that of the finer mesh, and one below the uncertainty not at all
    by_chance = ERRORS | {CASES[1]: {"force": 1e-6}, CASES[3]: {"force": 1e-6}}
    assert constant("force", CASES, by_chance, TRUTH, 1.0) == pytest.approx(0.02)
    assert math.isnan(rate("force", [(CASES[:2], TRUTH)], ERRORS))


def test_values_beyond_the_finest_mesh_go_on_with_their_power() -> None:
    assert at(16.0, (1.0, 2.0, 4.0), (3.0, 12.0, 48.0)) == pytest.approx(768.0)
    assert at(2.0, (1.0, 4.0), (1.0, 16.0)) == pytest.approx(4.0)
    assert unknowns(0.25, CASES, [run["dofs"] for run in RUNS.values()]) == pytest.approx(16_000.0)


def test_what_no_run_shows_is_extrapolated_and_marked() -> None:
    known = Known(RUNS, ERRORS, TRUTH, _run(LADDER, LADDER.counts), LADDER.counts)
    found = extrapolate(UNKNOWN, [CASES], known, 1.0)
    assert found.extrapolated
    assert found.case is not None
    # 0.1 % less what five increments leave, 0.004 (1 / 25 - 1 / 400)
    assert found.steps == 5
    assert found.case.size == pytest.approx((0.001 - 0.00015) / 0.02, rel=0.05)
    assert found.dofs == pytest.approx(1000.0 / found.case.size**2, rel=1e-6)
    assert found.seconds == pytest.approx((1.01e-4 + 5e-5) * found.dofs, rel=1e-6)
    assert found.peak_mb == pytest.approx(80.0 + 0.05 * found.dofs, rel=0.5)


def test_the_table_says_what_is_extrapolated_and_what_is_the_same() -> None:
    line = {"kind": "use", "body": "", "quantity": "", "element": "mixed", "size_mm": "0.125", "steps": "10",
            "seconds": "0.5", "peak_MB": "1500", "extrapolated": ""}  # fmt: skip
    far = line | {"seconds": "4e9", "peak_MB": "3e6", "extrapolated": "yes"}
    kept = [line | {"body": b, "quantity": q} | more
            for b in ("section", "solid", "section, large deformation", "solid, large deformation")
            for q in ("force", "friction_sum", "gauge_strain", "contact_length", "stick_length")
            for more in ({}, {}, {k: far[k] for k in ("seconds", "peak_MB", "extrapolated")})]  # fmt: skip
    assert markdown(kept)[2] == "| section: force | M 0.12 mm, 10: 0.5 s, 1.5 GB | the same | over a day |"


def test_the_table_of_the_page_is_made_from_the_kept_results() -> None:
    page = Path(__file__).parents[1] / "docs" / "cost.md"
    assert "\n".join(markdown(committed("cost_of_accuracy"))) in page.read_text(encoding="utf-8")
