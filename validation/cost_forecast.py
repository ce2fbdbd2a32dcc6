"""Are the errors and the times that `finger3d cost` forecasts right within a factor of 2?

Twenty scenes: random sections and swept solids under all objects, as error_bars draws them, with another seed; some of
them at large deformation; and two solids by fTetWild.  For each, `cost` presses two coarse meshes and forecasts the
press on the scene's own mesh, and on the mesh for an error of 1 % in forces and readings, if that has at most 60 000
unknowns.  Both are then pressed.  Forecast errors are judged by the error bars of these presses, unknowns and seconds
by what the presses had and took; seconds are those of the solution with its error bars, without start, mesh, pictures.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.accuracy.richardson import kinds_of, relative_error
from finger3d.analyses.cost import CostRow, Forecasts
from finger3d.analyses.pressed_body import PressedBody
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.mechanics.march.step_halving import march_automatic
from finger3d.mechanics.model import Model

from ._drawn import drawn, drawn_solids
from ._paper import columns
from ._rows import Result, Row

SEED = 46
"""Another than those of the scenes by which bars were calibrated."""

SECTIONS, SOLIDS, LARGE = 10, 6, 3
MOST_UNKNOWNS = 60_000
FACTOR, SHARE, SHARE_IF_QUICK = 2.0, 0.8, 0.7
GOAL = "goal of finger3d"
COLUMNS = "scene mesh number forecast real"


def scenes(quick: bool) -> Iterator[tuple[str, Model]]:
    """Names and models."""
    sections, solids = list(drawn(SECTIONS + LARGE, SEED)), list(drawn_solids(SOLIDS + 1, SEED))
    yield from sections[:3] if quick else sections[:SECTIONS]
    if quick:
        return
    yield from solids[:SOLIDS]
    for name, model in (*sections[SECTIONS:], solids[SOLIDS]):
        yield f"{name}, large deformation", LargeDeformation().apply(model)
    for name, model in solids[1:3]:
        yield f"{name}, fTetWild", replace(model, mesh=replace(model.mesh, mesher="ftetwild"))


def run(quick: bool) -> Result:
    """Quick: three sections, of which seven in ten forecasts suffice."""
    lines: list[tuple[Any, ...]] = []
    failed = 0
    for name, model in scenes(quick):
        try:
            forecasts = Forecasts.of(model)
            chosen = forecasts.numbers(())
            rows = [("own", forecasts.row(1.0)), ("1 %", forecasts.wanted(0.01, chosen))]
            for mesh, row in rows:
                if 0 < row.dofs <= MOST_UNKNOWNS:
                    lines += [(name, mesh, *line) for line in _pressed(model, row, forecasts.main)]
        except Finger3dError:
            failed += 1
    rows = tuple(_rows(lines, failed, SHARE_IF_QUICK if quick else SHARE))
    return Result(rows, columns(COLUMNS, lines), lambda figure: _draw(figure, lines))


def _pressed(model: Model, row: CostRow, names: tuple[str, ...]) -> Iterator[tuple[str, float, float]]:
    """Yield what was forecast and what a press has: unknowns, seconds, and relative errors by name."""
    own = replace(model, mesh=row.mesh, legs=row.legs or model.legs)
    start = time.perf_counter()
    problem = PressedBody(own).problem
    steps, chosen = march_automatic(problem)
    bars = estimate(problem, steps, numbers=press_numbers, chosen=chosen)
    seconds = time.perf_counter() - start - problem.seconds["cad"] - problem.seconds["mesh"]
    yield "unknowns", float(row.dofs), float(problem.size.dofs)
    yield "seconds", row.solving_s, seconds
    numbers, kinds = press_numbers(problem, steps[-1]), kinds_of(steps[-1].readings)
    for name in names:
        if error := bars.total(name):
            yield name, row.errors[name], relative_error(numbers, kinds, name, error)


def _rows(lines: list[tuple[Any, ...]], failed: int, share: float) -> Iterator[Row]:
    yield Row("scenes that give no forecast", GOAL, 0.0, float(failed), 0.0, "none", measure="absolute")
    for what, chosen in (
        ("unknowns", [line for line in lines if line[2] == "unknowns"]),
        ("seconds", [line for line in lines if line[2] == "seconds"]),
        ("errors", [line for line in lines if line[2] not in ("unknowns", "seconds")]),
    ):
        ratios = np.array([forecast / real for *_, forecast, real in chosen])
        within = float(np.mean((ratios >= 1.0 / FACTOR) & (ratios <= FACTOR)))
        text = f"share of forecast {what} within a factor of {FACTOR:g}, of {len(ratios)}"
        yield Row(text, GOAL, share, within, 0.0, "eight of ten", measure="at least")
        yield Row(f"median of forecast over real {what}", GOAL, 1.0, float(np.median(ratios)), 0.5, "for the record",
                  "statement")  # fmt: skip


def _draw(figure: Any, lines: list[tuple[Any, ...]]) -> None:
    panels = figure.subplots(1, 2)
    for axes, title, chosen in (
        (panels[0], "seconds", [line for line in lines if line[2] == "seconds"]),
        (panels[1], "relative errors", [line for line in lines if line[2] not in ("unknowns", "seconds")]),
    ):
        real, forecast = (np.array([line[k] for line in chosen]) for k in (4, 3))
        low, high = 0.7 * min(real.min(), forecast.min()), 1.4 * max(real.max(), forecast.max())
        axes.loglog(real, forecast, "o", ms=3, alpha=0.6)
        axes.loglog([low, high], [low, high], "k-", lw=0.8, label="equal")
        for factor in (1.0 / FACTOR, FACTOR):
            axes.loglog(
                [low, high], [factor * low, factor * high], "k:", lw=0.8, label="factor 2" if factor > 1 else None
            )
        axes.set(xlabel="real" if title == "seconds" else "error bar of the press", ylabel="forecast", title=title)
        axes.legend(fontsize=8)
