"""Charts of a sweep."""

from __future__ import annotations

from finger3d.mechanics.readings.columns import strain_columns
from finger3d.report.chart import Line
from finger3d.report.sweep import sweep_charts


def row(mu: str, depth: str, force: str, outcome: str = "converged", **more: str) -> dict[str, str]:
    return {"friction.mu": mu, "press.depth_mm": depth, "normal_force_N": force, "outcome": outcome} | more


def test_a_line_for_each_setting_of_the_other_keys_in_the_order_of_its_own() -> None:
    rows = [row("0.5", "10.0", "3.0"), row("0.5", "5.0", "1.0"), row("0.1", "10.0", "2.0"), row("0.1", "5.0", "0.5")]
    mu, depth = sweep_charts(rows, ["friction.mu", "press.depth_mm"])
    assert mu.lines == [Line("10", (0.1, 0.5), (2.0, 3.0)), Line("5", (0.1, 0.5), (0.5, 1.0))]
    assert (mu.x, mu.y, mu.legend) == ("friction.mu", "normal force (N)", "press.depth_mm")
    assert "friction.mu" in mu.caption
    assert depth.lines == [Line("0.5", (5.0, 10.0), (1.0, 3.0)), Line("0.1", (5.0, 10.0), (0.5, 2.0))]


def test_what_has_no_numbers_is_in_no_line() -> None:
    rows = [row("0.1", "5", "2.0"), row("0.2", "5", "nan", "contact did not settle"), row("0.3", "5", "4.0")]
    (chart,) = sweep_charts(rows, ["friction.mu", "press.depth_mm"])
    assert chart.lines == [Line("5", (0.1, 0.3), (2.0, 4.0))]
    assert sweep_charts(rows[:2], ["friction.mu"]) == []
    assert sweep_charts([], ["friction.mu"]) == []


def test_a_key_of_texts_names_lines_and_is_no_axis() -> None:
    rows = [row(mu, "5", "1.0", **{"model.domain": d}) for mu in ("0.1", "0.2") for d in ("solid", "plane-strain")]
    (chart,) = sweep_charts(rows, ["friction.mu", "model.domain"])
    assert [line.label for line in chart.lines] == ["solid", "plane-strain"]


def test_of_many_keys_gauges_and_settings_the_first_are_drawn_and_the_rest_is_counted() -> None:
    strains = [strain_columns(f"g{i}")[0] for i in range(5)]
    gauges = {column.key: "0.01" for column in strains}
    rows = [row(str(0.1 * i), str(j), "1.0", a=str(i), b=str(j), **gauges) for i in range(2) for j in range(12)]
    charts = sweep_charts(rows, ["friction.mu", "press.depth_mm", "a", "b"], strains)
    assert [chart.x for chart in charts] == ["friction.mu", "press.depth_mm", "a"] * 3
    assert {chart.y for chart in charts} == {"normal force (N)", "strain, g0", "strain, g1"}
    assert [(len(chart.lines), chart.more) for chart in charts] == [(8, 24 - 8)] * 9
