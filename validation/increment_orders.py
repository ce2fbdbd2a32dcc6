"""At which order do errors of increments fall, and how many plain ones give what twenty give?

Source: a point that closes within an increment is held where it touches, so that the error of monotone paths is of
second order; plain increments hold it where it was at their start, which is first order (finger3d's theory page).  The
paper's Fig. 9 finger (nu = .49) on a round bar, as a section, pressed, slid, released, with viscosity and at large
deformation; as a solid on a plane and on a ball.  The reference is the same press in 320 to 640 increments; that of
the energy balance, work less stored energy less dissipation in small strain, is zero; plain increments have it at
second order, too, so that it is not compared with theirs.

Points close and change state one by one, so single ratios scatter widely about 4 and the median over quantities is
taken.  Stick areas change by whole points: their error is often zero, which counts as an infinite fall.  Errors that
are round-off in ten increments do not count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.relaxation import Relaxation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Gauge, Leg, Model
from finger3d.mechanics.results.history import measure
from finger3d.objects import Cylinder, Sphere

from ._increments import PlainCoulomb, imbalance
from ._paper import STRAIN, fig9
from ._press import under
from ._rows import Result, Row, at_least, at_most, columns

COUNTS = (10, 20, 40, 80)
ROUND_OFF = 1e-9
PLAIN = 160
"""Plain increments that twenty are compared with."""
NAMES = ("friction sum", "stick area", "gauge", "dissipation", "energy balance")
GAUGE = Gauge("g", 36.0, 40.0, angle=float(np.deg2rad(30.0)))
ORDER = "second order: 4"
BAR = Cylinder(radius_mm=20.0, axis="z")


@dataclass(frozen=True)
class Press:
    """A model and the number of increments of its reference."""

    name: str
    model: Model
    mu: float
    finest: int


def presses(quick: bool) -> Iterator[Press]:
    """All presses; quick ones on coarse meshes."""
    section = fig9(0.49, STRAIN, 2.0 if quick else 1.0, [GAUGE]).model
    on_bar = replace(section, object=BAR, legs=(Leg(6.0),))
    few = 320 if quick else 640
    yield Press("section on a bar", on_bar, 0.5, few)
    yield Press("bar is released", replace(on_bar, legs=(Leg(6.0), Leg(2.0))), 0.5, few)
    solid = fig9(0.49, "solid", 5.0 if quick else 2.5, [GAUGE]).model
    yield Press("solid on a plane", solid, 0.5, few)
    if not quick:
        yield Press("bar slides", replace(on_bar, legs=(Leg(5.0), Leg(5.0, slide_x_mm=2.0))), 0.5, few)
        viscous = Relaxation(((0.4, 0.5),), bulk=True)
        yield Press("with viscosity", replace(on_bar, legs=(Leg(6.0, duration_s=1.0),), relaxation=viscous), 0.5, few)
        yield Press("solid on a ball", replace(solid, object=Sphere(radius_mm=30.0), legs=(Leg(5.0),)), 0.5, few)
        yield Press("at large deformation", LargeDeformation().apply(on_bar), 0.3, 320)


def numbers(problem: Problem, mu: float, count: int, plain: bool = False) -> np.ndarray:
    """Values of `NAMES` at the end; the energy balance is NaN where the stored energy is not that of a linear body."""
    step = under(problem, PlainCoulomb(mu) if plain else Coulomb(mu), count)[-1]
    found = measure(problem.points, step)
    balance = imbalance(problem, step) if problem.model.is_linear_elastic else np.nan
    return np.array(
        [found["friction_sum_N"], found["stick_area_mm2"], found["gauges"]["g"], found["dissipation_mJ"], balance]
    )


def run(quick: bool) -> Result:
    """Quick: a section of 2 mm and a solid of 5 mm."""
    own, plain, lines = {}, {}, []
    for press in presses(quick):
        problem = build(press.model)
        exact = numbers(problem, press.mu, press.finest)

        own[press.name] = np.array([_errors(numbers(problem, press.mu, count), exact) for count in COUNTS])
        plain[press.name] = _errors(numbers(problem, press.mu, PLAIN, plain=True), exact)
        for count, errors in (*zip(COUNTS, own[press.name], strict=True), (-PLAIN, plain[press.name])):
            lines.append((press.name, abs(count), int(count < 0), *map(float, errors)))
    names = "press increments plain " + " ".join(name.replace(" ", "_") for name in NAMES)
    rows = tuple(_rows(COUNTS, own, plain))
    return Result(rows, columns(names, lines), lambda figure: _draw(figure, COUNTS, own, plain))


def _errors(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Relative errors of `NAMES`; that of the energy balance is its value."""
    off = np.abs(found - exact) / np.where(exact, np.abs(exact), 1.0)
    off[-1] = abs(found[-1])
    return off


def _fall(errors: np.ndarray) -> np.ndarray:
    """Factor by which errors (n, k) fall in a halving of the increments, the mean of all; NaN for round-off."""
    with np.errstate(divide="ignore", invalid="ignore"):
        fall = (errors[0] / errors[-1]) ** (1.0 / (len(errors) - 1))
    return np.where(errors[0] > ROUND_OFF, fall, np.nan)


def _medians(values: np.ndarray) -> Iterator[tuple[str, float]]:
    """Yield the name of each quantity (columns) and the median over presses (rows), unless there is no number."""
    for name, column in zip(NAMES, values.T, strict=False):
        if not np.isnan(column).all():
            yield name, float(np.nanmedian(column))


def _rows(counts: tuple[int, ...], own: dict[str, np.ndarray], plain: dict[str, np.ndarray]) -> Iterator[Row]:
    few, many = counts[0], counts[-1]
    falls = np.array([_fall(errors) for errors in own.values()])
    for name, fall in zip(own, falls, strict=True):
        what = f"fall of errors in a halving, median over quantities, {name}, {few} to {many} increments"
        yield at_least(what, ORDER, 3.3, float(np.nanmedian(fall)), "points close one by one", "statement")
    every = f"all presses, {few} to {many} increments"
    what = f"fall of errors in a halving, median over quantities and presses, {every}"
    yield at_least(what, ORDER, 3.3, float(np.nanmedian(falls)), "points close one by one")
    for name, got in _medians(falls):
        what = f"fall of the error of the {name} in a halving, median over {every}"
        yield at_least(what, ORDER, 3.3, got, "points close one by one", "statement")
    twenty = np.array([errors[1, :-1] for errors in own.values()])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = twenty / np.array(list(plain.values()))[:, :-1]
    for name, got in _medians(share):
        what = f"error of the {name} in 20 increments over that in {PLAIN} plain ones, median over presses"
        yield at_most(what, "eight times as many", 1.0, got, "0/0 is left out", "statement")
    what = f"error in 20 increments over that in {PLAIN} plain ones, median over quantities and presses"
    got = float(np.nanmedian(share))
    yield at_most(what, "goal of finger3d", 1.0, got, "eight times as many", "statement")


def _draw(figure: Any, counts: tuple[int, ...], own: dict[str, np.ndarray], plain: dict[str, np.ndarray]) -> None:
    figure.set_size_inches(3.4 * 4, 3.2 * ((len(own) + 3) // 4))
    panels = figure.subplots((len(own) + 3) // 4, 4, sharex=True, squeeze=False).ravel()
    for axes, (name, errors) in zip(panels, own.items(), strict=False):
        for k, quantity in enumerate(NAMES):
            shown = np.where(errors[:, k] > 0.0, errors[:, k], np.nan)
            axes.loglog(counts, shown, "o-", ms=3, color=f"C{k}", label=quantity)
            axes.loglog([PLAIN], [plain[name][k] or np.nan], "x", color=f"C{k}")
        axes.loglog(counts, [2.0 / n**2 for n in counts], "k:", lw=1)
        axes.set_xticks([*counts, PLAIN], [str(n) for n in (*counts, PLAIN)])
        axes.set_xticks([], minor=True)
        axes.set_title(name, fontsize=9)
    for axes in panels[len(own) :]:
        axes.set_axis_off()
    panels[0].set_ylabel("error")
    figure.supxlabel("increments a leg; crosses: plain ones; dotted: slope -2", fontsize=9)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(NAMES))
