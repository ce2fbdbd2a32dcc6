"""Rows of a study: errors and verdicts."""

from __future__ import annotations

import pytest

from validation._rows import Row


@pytest.mark.parametrize(
    ("measure", "wanted", "got", "error"),
    [
        ("relative", -2.0, -2.1, 0.05), ("absolute", 0.0, -0.2, 0.2), ("at most", 1.0, 0.5, 0.0),
        ("at most", 1.0, 1.2, 0.2), ("at least", 1.0, 1.5, 0.0), ("at least", 1.0, 0.7, 0.3),
    ],
)  # fmt: skip
def test_the_error_is_what_its_measure_says(measure: str, wanted: float, got: float, error: float) -> None:
    row = Row("w", "r", wanted, got, 0.1, "so", measure=measure)
    assert row.error == pytest.approx(error, abs=1e-12)
    assert row.passed == (error <= 0.1)


def test_nan_never_passes() -> None:
    for measure in ("relative", "absolute", "at most", "at least"):
        assert not Row("w", "r", 1.0, float("nan"), 1e9, "so", measure=measure).passed  # type: ignore[arg-type]


def test_a_statement_that_does_not_hold_fails_nothing() -> None:
    rows = [Row("w", "r", 79.0, got, 0.02, "about", "statement") for got in (79.5, 60.0, float("nan"))]
    assert [row.passed for row in rows] == [True, True, False]
    assert [row.verdict for row in rows] == ["holds", "does not hold", "FAIL"]
