"""Do the errors that `finger3d cost` forecasts hold, and are its times right within a factor of 2?

Twenty scenes: random sections and swept solids under all objects, as error_bars draws them, with another seed; some of
them at large deformation; and two solids by fTetWild.  For each, `cost` presses two coarse meshes and forecasts the
press on the scene's own mesh, and on the mesh for an error of 1 % in forces and readings, if that has at most 60 000
unknowns.  Both are then pressed.  Unknowns and seconds are judged by what the presses had and took; seconds are those
of the solution with its error bars, without start, mesh, pictures.  A quick run only states them, since other work on
the machine changes them.

Forecast errors are judged like error bars: the true error, against a press with half the edge length (or 0.7 times
where that has too many unknowns), lies within twice the forecast.  They are not judged by the error bars of the press
that they are a forecast of, since those scatter from mesh to mesh: a row states how many of them agree within a factor
of 2 with those on edges that are 6 % longer, beside the share of the forecasts that do.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.accuracy.error_bars import relative_error
from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.accuracy.model_error import judged_large_deformation
from finger3d.analyses.cost import CostRow, Forecasts
from finger3d.analyses.pressed_body import PressedBody
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.mechanics.march.step_halving import march_automatic, with_increments_of
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import kinds_of

from ._drawn import drawn, drawn_solids
from ._press import in_edges
from ._rows import Kind, Result, Row, columns, listed

judged = listed(__file__)

SEED = 46
"""Another than those of the scenes by which bars were calibrated."""

SECTIONS, SOLIDS, LARGE = 10, 6, 3
MOST_UNKNOWNS = 60_000
MOST_IN_TRUTH = 120_000
FACTOR, BARS = 2.0, 2.0
"""Largest factor between truth and a right forecast, and forecasts that a true error is within."""

FINER, SLIGHTLY_LONGER = (0.5, 0.7), 1.06

COLUMNS = "scene mesh number forecast real true_error bar_on_slightly_longer_edges"


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
    """Quick: three sections, whose seconds are not judged."""
    lines: list[tuple[Any, ...]] = []
    failed = 0
    for name, model in scenes(quick):
        try:
            forecasts = Forecasts.of(model)
            chosen = forecasts.numbers(())
            rows = [("own", forecasts.row(1.0)), ("1 %", forecasts.wanted(0.01, chosen))]
            for mesh, row in rows:
                if 0 < row.dofs <= MOST_UNKNOWNS:
                    lines += [(name, mesh, *line) for line in _judged(model, row, forecasts.main)]
        except Finger3dError:
            failed += 1
    return Result(tuple(_rows(lines, failed, quick)), columns(COLUMNS, lines), lambda figure: _draw(figure, lines))


class _Pressed:
    """A press with its error bars."""

    def __init__(self, model: Model) -> None:
        start = time.perf_counter()
        problem = PressedBody(model).problem
        steps, chosen = march_automatic(problem)
        self.bars = estimate(problem, steps, numbers=press_numbers, chosen=chosen)
        if not model.finite_strain:  # a press says what large deformation would change
            judged_large_deformation(problem.model)
        self.seconds = time.perf_counter() - start - problem.seconds["cad"] - problem.seconds["mesh"]
        self.dofs, self.increments = problem.size.dofs, len(steps)
        self.numbers, self._kinds = press_numbers(problem, steps[-1]), kinds_of(steps[-1].readings)

    def relative(self, name: str, error: float | None) -> float:
        """The error of a number, see `relative_error`; NaN if it is not known."""
        return math.nan if error is None else relative_error(self.numbers, self._kinds, name, error)


def _judged(model: Model, row: CostRow, names: tuple[str, ...]) -> Iterator[tuple[str, float, float, float, float]]:
    """Yield what was forecast and what a press has: unknowns, seconds, and relative errors by name."""
    own = replace(model, mesh=row.mesh, legs=row.legs or model.legs)
    press = _Pressed(own)
    yield "unknowns", float(row.dofs), float(press.dofs), math.nan, math.nan
    yield "seconds", row.solving_s, press.seconds, math.nan, math.nan
    longer, true = _Pressed(in_edges(own, SLIGHTLY_LONGER)), _truth(own, press)
    for name in names:
        error = abs(true[name] - press.numbers[name]) if true else None
        bar, beside = (one.relative(name, one.bars.totals().get(name)) for one in (press, longer))
        yield name, row.errors[name], bar, press.relative(name, error), beside


def _truth(model: Model, press: _Pressed) -> dict[str, float]:
    """The numbers on shorter edges in twice as many increments; empty if that has too many unknowns."""
    dim = 3 if model.domain == "solid" else 2
    factor = next((f for f in FINER if press.dofs * f**-dim <= MOST_IN_TRUTH), None)
    if factor is None:
        return {}
    legs = with_increments_of(model.legs, 2 * press.increments)
    problem = PressedBody(replace(in_edges(model, factor), legs=legs)).problem
    steps, _ = march_automatic(problem)
    return press_numbers(problem, steps[-1]) if steps[-1].outcome.ok else {}


def _rows(lines: list[tuple[Any, ...]], failed: int, quick: bool) -> Iterator[Row]:
    yield judged("no-forecast", failed)
    for what in ("unknowns", "seconds"):
        ratios = np.array([line[3] / line[4] for line in lines if line[2] == what])
        yield _within(f"forecast {what}", ratios, "statement" if quick and what == "seconds" else "verification")
        yield judged("median", np.median(ratios), what=f"forecast over real {what}")
    errors = np.array([line[3:] for line in lines if line[2] not in ("unknowns", "seconds")], dtype=float)
    forecast, bar, true, beside = errors.T
    known = np.isfinite(true)
    yield judged("true-errors-within", np.mean(true[known] <= BARS * forecast[known]), bars=BARS, count=known.sum())
    seen = known & (true > 1e-6)
    yield judged("median", np.median(forecast[seen] / true[seen]), what="forecast over true errors")
    told = np.isfinite(bar) & (bar > 0.0)
    again = told & np.isfinite(beside) & (beside > 0.0)
    yield _within("forecast errors of the error bars", forecast[told] / bar[told], "statement")
    text = f"error bars on edges {SLIGHTLY_LONGER:g} times as long of the error bars"
    yield _within(text, beside[again] / bar[again], "statement")


def _within(what: str, ratios: Float, kind: Kind) -> Row:
    within = np.mean((ratios >= 1.0 / FACTOR) & (ratios <= FACTOR))
    return replace(judged("share-within-a-factor", within, what=what, factor=FACTOR, count=len(ratios)), kind=kind)


def _draw(figure: Any, lines: list[tuple[Any, ...]]) -> None:
    panels = figure.subplots(1, 2)
    seconds = [line for line in lines if line[2] == "seconds"]
    errors = [line for line in lines if line[2] not in ("unknowns", "seconds") and line[5] > 1e-6 and line[3] > 0.0]
    for axes, title, chosen, column, factors in (
        (panels[0], "time (s)", seconds, 4, (1.0 / FACTOR, FACTOR)),
        (panels[1], "error of a number, relative", errors, 5, (1.0 / BARS,)),
    ):
        real, forecast = (np.array([line[k] for line in chosen]) for k in (column, 3))
        low, high = 0.7 * min(real.min(), forecast.min()), 1.4 * max(real.max(), forecast.max())
        axes.loglog(real, forecast, "o", ms=3, alpha=0.6)
        axes.loglog([low, high], [low, high], "k-", lw=0.8, label="equal")
        for k, factor in enumerate(factors):
            label = None if k else "factor 2" if len(factors) > 1 else "true error of 2 forecasts"
            axes.loglog([low, high], [factor * low, factor * high], "k:", lw=0.8, label=label)
        axes.set(xlabel=f"true {title}", ylabel=f"forecast {title}")
