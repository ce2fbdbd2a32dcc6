"""Is an increment of .1 mm small enough, at which order do errors of increments fall, and how many plain ones give
what twenty give?

Plain increments, as the paper made them, hold a point that closes where it was at their start; those of finger3d hold
it where it touches.
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
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Leg, Model
from finger3d.objects import Cylinder, Sphere

from ._common import ticks_at
from ._exact_path import exact_press
from ._increments import PlainCoulomb, imbalance
from ._paper import STRAIN, STRESS, Profile, fig9, half_cylinder, line_r5, said, strains
from ._press import PAPER_GAUGE, changed, in_increments, under
from ._rows import Result, Row, columns, listed, together

judged = listed(__file__)

CASES = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.49))
COUNTS_SIZE = (1, 2, 5, 10, 20, 40, 80, 160, 320)
PATH = 0
"""Stands for the path among numbers of increments."""
NAMES = ("normal force", "sum of |f_t|", "stick half-width", "dissipation", "largest gamma_xy")


def _size(quick: bool) -> Result:
    """Is an increment of .1 mm small enough, so that smaller ones change the results little?

    Source: Maeno 2004, Sec. II-A: "the value 0.1 was small enough for our model because the change in result was
    sufficiently small even when the increment value was made smaller". The half cylinder under 1 mm, mu = .25, in 1
    to 320 plain increments, as the paper made them; each result against the exact path from event to event, which
    has no increments, and the rate at which the error of the dissipation falls (1 or more: friction is taken under
    the mean normal force of an increment).

    One condensation for each case.
    """
    size, most = (0.2, 80) if quick else (0.05, 320)
    counts = [n for n in COUNTS_SIZE if n <= most]
    x, gauges = line_r5(count=21)
    found, lines, rows = {}, [], []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size, gauges)
        for count in (PATH, *counts):
            frame = under(problem, PlainCoulomb(0.25), count)[-1] if count else _exact(problem)
            profile = Profile.of(problem, frame)
            shear = float(np.abs(strains(frame, len(x))[2]).max())
            found[plane, nu, count] = np.array(
                [profile.force, profile.friction, profile.c, frame.dissipation_mJ, shear]
            )
            size_mm = 1.0 / count if count else 0.0
            lines.append((plane, nu, count, size_mm, *map(float, found[plane, nu, count])))
        rows += _statements(plane, nu, found, counts)
    names = "plane nu increments increment_mm force_N_per_mm friction_sum_N_per_mm c_mm dissipation_mJ_per_mm gamma_xy"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_size(figure, found, counts))


def _exact(problem: Problem) -> StepResult:
    """The end of the exact path."""
    return exact_press(changed(problem, friction=Coulomb(0.25), legs=in_increments(problem.model.legs, 1)))[-1]


def _statements(plane: str, nu: float, found: dict[Any, np.ndarray], counts: list[int]) -> list[Row]:
    here = f"{plane}, nu = {nu:g}"
    off = {n: np.abs(found[plane, nu, n] / found[plane, nu, PATH] - 1.0) for n in counts}
    rows = [
        said("increments-small-enough", off[10][k], name=NAMES[k], here=here)
        for k in (0, 1, 3, 4)
    ]  # fmt: skip
    rate = np.log(off[5][3] / off[counts[-1]][3]) / np.log(counts[-1] / 5)
    return [*rows, judged("rate-of-the-dissipation", rate, most=counts[-1], here=here)]


def _draw_size(figure: Any, found: dict[Any, np.ndarray], counts: list[int]) -> None:
    panels = figure.subplots(1, 4, sharey=True)
    figure.suptitle("Error of plain increments against the path; dotted line: the paper's .1 mm")
    for axes, (plane, nu) in zip(panels, CASES, strict=True):
        last = found[plane, nu, PATH]
        for k, name in enumerate(NAMES):
            error = [100 * abs(found[plane, nu, n][k] / last[k] - 1.0) for n in counts]
            axes.loglog([1.0 / n for n in counts], np.maximum(error, 1e-4), "o-", ms=3, color=f"C{k}", label=name)
        axes.axvline(0.1, color="#999999", ls=":", lw=1)
        axes.set(xlabel="increment (mm)", title=f"{plane}, nu = {nu:g}", ylim=(1e-3, 1e4))
    panels[0].set_ylabel("error (%)")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(NAMES), frameon=False)


COUNTS_ORDERS = (10, 20, 40, 80)
ROUND_OFF = 1e-9
PLAIN = 160
"""Plain increments that twenty are compared with."""
QUANTITIES = ("friction sum", "stick area", "gauge", "dissipation", "energy balance")


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
    section = fig9(0.49, STRAIN, 2.0 if quick else 1.0, [PAPER_GAUGE]).model
    on_bar = replace(section, object=BAR, legs=(Leg(6.0),))
    few = 320 if quick else 640
    yield Press("section on a bar", on_bar, 0.5, few)
    yield Press("bar is released", replace(on_bar, legs=(Leg(6.0), Leg(2.0))), 0.5, few)
    solid = fig9(0.49, "solid", 5.0 if quick else 2.5, [PAPER_GAUGE]).model
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


def _orders(quick: bool) -> Result:
    """At which order do errors of increments fall, and how many plain ones give what twenty give?

    Source: a point that closes within an increment is held where it touches, so that the error of monotone paths is
    of second order; plain increments hold it where it was at their start, which is first order (finger3d's theory
    page). The paper's Fig. 9 finger (nu = .49) on a round bar, as a section, pressed, slid, released, with
    viscosity and at large deformation; as a solid on a plane and on a ball. The reference is the same press in 320
    to 640 increments; that of the energy balance, work less stored energy less dissipation in small strain, is
    zero; plain increments have it at second order, too, so that it is not compared with theirs.

    Points close and change state one by one, so single ratios scatter widely about 4 and the median over quantities
    is taken. Stick areas change by whole points: their error is often zero, which counts as an infinite fall.
    Errors that are round-off in ten increments do not count.

    Quick: a section of 2 mm and a solid of 5 mm.
    """
    own, plain, lines = {}, {}, []
    for press in presses(quick):
        problem = build(press.model)
        exact = numbers(problem, press.mu, press.finest)

        own[press.name] = np.array([_errors(numbers(problem, press.mu, count), exact) for count in COUNTS_ORDERS])
        plain[press.name] = _errors(numbers(problem, press.mu, PLAIN, plain=True), exact)
        for count, errors in (*zip(COUNTS_ORDERS, own[press.name], strict=True), (-PLAIN, plain[press.name])):
            lines.append((press.name, abs(count), int(count < 0), *map(float, errors)))
    names = "press increments plain " + " ".join(name.replace(" ", "_") for name in QUANTITIES)
    rows = tuple(_rows(COUNTS_ORDERS, own, plain))
    return Result(rows, columns(names, lines), lambda figure: _draw_orders(figure, COUNTS_ORDERS, own, plain))


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
    for name, column in zip(QUANTITIES, values.T, strict=False):
        if not np.isnan(column).all():
            yield name, float(np.nanmedian(column))


def _rows(counts: tuple[int, ...], own: dict[str, np.ndarray], plain: dict[str, np.ndarray]) -> Iterator[Row]:
    few, many = counts[0], counts[-1]
    falls = np.array([_fall(errors) for errors in own.values()])
    for name, fall in zip(own, falls, strict=True):
        yield judged("fall-of-errors-of-a-press", np.nanmedian(fall), name=name, few=few, many=many)
    yield judged("fall-of-all-errors", np.nanmedian(falls), few=few, many=many)
    for name, got in _medians(falls):
        yield judged("fall-of-the-error-of-a-quantity", got, name=name, few=few, many=many)
    twenty = np.array([errors[1, :-1] for errors in own.values()])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = twenty / np.array(list(plain.values()))[:, :-1]
    for name, got in _medians(share):
        yield judged("error-over-that-of-plain-increments", got, name=name, plain=PLAIN)
    yield judged("errors-over-those-of-plain-increments", np.nanmedian(share), plain=PLAIN)


def _draw_orders(
    figure: Any, counts: tuple[int, ...], own: dict[str, np.ndarray], plain: dict[str, np.ndarray]
) -> None:
    panels = figure.subplots((len(own) + 3) // 4, 4, sharex=True, squeeze=False).ravel()
    for axes, (name, errors) in zip(panels, own.items(), strict=False):
        for k, quantity in enumerate(QUANTITIES):
            shown = np.where(errors[:, k] > 0.0, errors[:, k], np.nan)
            axes.loglog(counts, shown, "o-", ms=3, color=f"C{k}", label=quantity)
            axes.loglog([PLAIN], [plain[name][k] or np.nan], "x", color=f"C{k}")
        axes.loglog(counts, [2.0 / n**2 for n in counts], "k:", lw=1)
        ticks_at(axes, [*counts, PLAIN])
        axes.set_title(name, fontsize=9)
    for axes in panels[len(own) :]:
        axes.set_axis_off()
    panels[0].set_ylabel("error")
    figure.supxlabel("increments a leg; crosses: plain ones; dotted: slope -2", fontsize=9)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=len(QUANTITIES))


def run(quick: bool) -> Result:
    """Plain increments of the half cylinder, then both kinds on the finger of Fig. 9."""
    return together((13.6, 11.2), size=_size(quick), orders=_orders(quick))
