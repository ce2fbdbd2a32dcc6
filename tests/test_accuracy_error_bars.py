"""Error bars by name."""

from __future__ import annotations

from finger3d.accuracy.error_bars import ErrorBars


def test_an_error_bar_is_the_sum_of_both_errors() -> None:
    bars = ErrorBars(discretisation={"normal_force_N": 0.3, "gauge_g": 0.1}, steps={"normal_force_N": 0.2})
    assert bars.totals() == {"normal_force_N": 0.5, "gauge_g": 0.1}
    assert bars.total("friction_sum_N") is None
    assert ErrorBars.of_summary({"error_estimate": bars.as_dict()}) == bars
    assert ErrorBars.of_summary({"error_estimate": None}).totals() == {}
