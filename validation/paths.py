"""Is the path of a section from event to event the limit of many increments, and what does it cost?

Source: contact in small strain under a flat object is piecewise linear in the motion (Klarbring 1999, finger3d's
theory page), so that increments have a limit which events reach.  The limit is checked against up to 10 240 plain
increments of the paper's two sections (Maeno 2004, Secs. II and III), whose error is of first order.  The numbers at
the ends of the legs must not depend on how many results are written on the way, also at coefficients of friction so
large that forces may jump, and the work must be what is stored and dissipated.

Costs are processor seconds of this machine, and ratios to ten plain increments in the same run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.mechanics.small_strain.exact_path import solve_path
from finger3d.objects import Move, Plane

from ._increments import PlainCoulomb, imbalance, pressed
from ._paper import STRAIN, STRESS, columns, fig9, half_cylinder
from ._rows import Result, Row

MUS = (0.25, 0.5, 1.0)
GRID_NU, GRID_MU = (0.0, 0.3, 0.49, 0.5), (0.0, 0.06, 0.25, 1.0, 3.0, 10.0, 1e3, 1e6)
STATIONS = (7, 320)
FORCES = ("normal_force_N", "tangential_force_x_N", "friction_sum_N")
AREAS, ENERGIES = ("contact_area_mm2", "stick_area_mm2"), ("external_work_mJ", "dissipation_mJ")
GAUGE = Gauge("g", 36.0, 40.0, angle=float(np.deg2rad(30.0)))
PRESS_SLIDE_RELEASE = (Leg(10.0), Leg(10.0, slide_x_mm=3.0), Leg(4.0, slide_x_mm=3.0))
TO_FORCES = (Leg(5.0, force_N=1.0), Leg(2.0, force_N=0.3))
MANY = "plain increments, of first order"
SAME = "a path has no increments"
GOAL = "goal of finger3d"
COST = "processor time of this machine"


def run(quick: bool) -> Result:
    """Quick: coarse sections, 640 increments and 16 presses of a sweep."""
    ladder = (10, 40, 160, 640) if quick else (10, 40, 160, 640, 2560, 10240)
    sizes = (4.0,) if quick else (1.0, 0.5)
    sections = {f"Fig. 9, {size:g} mm": fig9(0.49, STRAIN, size) for size in sizes}
    if not quick:
        sections["half cylinder"] = half_cylinder(0.3, STRESS, 0.1)
    found: dict[tuple[str, float, int], np.ndarray] = {}
    costs, rows = [], []
    for name, problem in sections.items():
        counts = ladder if quick or name == "Fig. 9, 1 mm" else ladder[:-1]
        for mu in MUS[::2] if quick else MUS:
            costs.append(_cost(name, problem, mu))
            for count in (0, *counts):  # 0: the path
                found[name, mu, count] = _numbers(problem, mu, count)
            rows += _against_increments(f"{name}, mu = {mu:g}", found, (name, mu), counts)
    rows += [row for cost in costs for row in _cost_rows(cost)]
    grid = _grid(quick)
    rows += _grid_rows(grid)
    rows += _sweeps(quick)
    titles = "section mu events systems path_s path_and_ten_results_s ten_increments_s".split()
    titles += "nu history difference imbalance unsettled".split()
    table = [(*cost, *("",) * 5) for cost in costs] + [("grid", mu, *("",) * 5, nu, *more) for nu, mu, *more in grid]
    return Result(tuple(rows), columns(" ".join(titles), table), lambda figure: _draw(figure, found, costs))


def _numbers(problem: Problem, mu: float, count: int) -> np.ndarray:
    """Normal force, friction sum, work and dissipation at the end, in plain increments or, for none, on the path."""
    law, steps = (PlainCoulomb(mu), count) if count else (Coulomb(mu), 1)
    numbers = measure(problem.points, pressed(problem, law, steps)[-1])
    return np.array([numbers[key] for key in (FORCES[0], FORCES[2], *ENERGIES)])


def _against_increments(here: str, found: dict[Any, np.ndarray], key: tuple[str, float], counts: Any) -> list[Row]:
    exact = found[(*key, 0)]
    few, most = (np.abs(found[(*key, n)] / exact - 1.0) for n in (counts[0], counts[-1]))
    rate = float(np.log(few.max() / most.max()) / np.log(counts[-1] / counts[0]))
    why = "first order; 3/N measured at mu = 1 in plane stress, 0.4/N or less in plane strain"
    rows = [
        Row(f"{quantity}, {here}: path against {counts[-1]} increments, relative", MANY, 0.0, float(error),
            5.0 / counts[-1], why, measure="absolute")
        for quantity, error in zip(("normal force", "friction sum", "work"), most, strict=False)
    ]  # fmt: skip
    what = f"rate at which increments near the path, worst of these and the dissipation, {here}"
    return [*rows, Row(what, "first order", 1.0, rate, 0.25, "points close one by one", measure="at least")]


def _seconds(job: Callable[[], Any], repeats: int = 3) -> float:
    """Return the least processor time of a job."""
    best = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        job()
        best = min(best, time.process_time() - start)
    return best


def _cost(name: str, problem: Problem, mu: float) -> tuple[Any, ...]:
    """Events, systems solved, and seconds of the path, of the path with ten results, and of ten increments."""
    own = replace(problem, model=replace(problem.model, friction=Coulomb(mu)))
    start = formulation_of(own.model).start(own)
    found = solve_path(own, start, Move(own.origin, own.model.legs[-1].end(own.origin)))
    runs = ((Coulomb(mu), 1), (Coulomb(mu), 10), (PlainCoulomb(mu), 10))
    spent = [_seconds(lambda law=law, steps=steps: pressed(problem, law, steps)) for law, steps in runs]  # type: ignore[misc]
    return name, mu, len(found.events), found.events[-1].systems, *spent


def _cost_rows(cost: tuple[Any, ...]) -> list[Row]:
    name, mu, _, _, path, ten, plain = cost
    here = f"{name}, mu = {mu:g}"
    what = f"processor time of the path over that of ten plain increments, {here}"
    return [
        Row(what, GOAL, 1.0, path / plain, 0.0, COST, "statement", "at most"),
        Row(f"{what}, ten results written", GOAL, 1.0, ten / plain, 0.0, COST, "statement", "at most"),
    ]


def _grid(quick: bool) -> list[tuple[Any, ...]]:
    """Lines nu, mu, history, largest difference between numbers of results, imbalance, unsettled histories."""
    lines = []
    size, nus, mus = (6.0, (0.49,), (0.25, 1e6)) if quick else (4.0, GRID_NU, GRID_MU)
    few, many = (3, 20) if quick else STATIONS
    for nu in nus:
        section = fig9(nu, STRAIN, size, [GAUGE])
        for history, legs in (("press, slide, release", PRESS_SLIDE_RELEASE), ("forces", TO_FORCES)):
            problem = build(replace(section.model, legs=legs))
            for mu in mus:
                frames = [_march(problem, mu, steps) for steps in (few, many)]
                settled = all(own[-1].outcome.ok for own in frames)
                ends = [_ends(problem, own, len(legs)) for own in frames] if settled else []
                apart = _apart(*ends) if settled else float("nan")
                balance = max(abs(imbalance(problem, own[-1])) for own in frames) if settled else float("nan")
                lines.append((nu, mu, history, apart, balance, int(not settled)))
    return [(nu, mu, *more) for nu, mu, *more in lines]


def _march(problem: Problem, mu: float, steps: int) -> list[StepResult]:
    legs = tuple(replace(leg, steps=steps) for leg in problem.model.legs)
    return list(march(replace(problem, model=replace(problem.model, friction=Coulomb(mu), legs=legs))))


def _ends(problem: Problem, frames: Sequence[StepResult], legs: int) -> list[dict[str, Any]]:
    """Return the numbers at the end of each leg."""
    each = len(frames) // legs
    return [measure(problem.points, frames[(k + 1) * each - 1]) for k in range(legs)]


def _apart(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> float:
    """Largest difference, forces over the largest normal force, areas over the largest area of contact and so on."""

    def largest(key: str) -> float:
        return max(abs(leg[key]) for leg in one)

    scales = dict.fromkeys(FORCES, largest(FORCES[0])) | dict.fromkeys(AREAS, largest(AREAS[0]))
    scales |= dict.fromkeys(ENERGIES, largest(ENERGIES[0])) | {"depth_mm": largest("depth_mm")}
    worst = max(abs(a[key] - b[key]) / scale for a, b in zip(one, other, strict=True) for key, scale in scales.items())
    gauges = [(a["gauges"]["g"], b["gauges"]["g"]) for a, b in zip(one, other, strict=True)]
    return max(worst, max(abs(a - b) for a, b in gauges) / max(abs(a) for a, _ in gauges))


def _grid_rows(grid: Sequence[tuple[Any, ...]]) -> list[Row]:
    rows = [
        Row(f"{len(grid)} histories of the grid: unsettled", GOAL, 0.0, float(sum(line[-1] for line in grid)), 0.0,
            "none", measure="absolute"),
    ]  # fmt: skip
    settled = [line for line in grid if not line[-1]]
    here = f"{len(settled)} histories, mu up to {max(line[1] for line in grid):g}"
    apart, balance = (max(line[k] for line in settled) for k in (3, 4))
    what = f"{here}: largest change of a number at the end of a leg with the results on the way, relative"
    rows.append(Row(what, SAME, 0.0, apart, 1e-9, "round-off", measure="absolute"))
    what = f"{here}: work less stored energy less dissipation, over the work"
    rows.append(Row(what, "first law", 0.0, balance, 1e-9, "round-off", measure="absolute"))
    return rows


def _sweeps(quick: bool) -> list[Row]:
    """25 coefficients of friction, and 200 presses of coefficient, depth and tilt."""
    size = 4.0 if quick else 1.0
    problem = fig9(0.49, STRAIN, size)
    many = _seconds(lambda: [pressed(problem, Coulomb(mu)) for mu in np.linspace(0.06, 1.0, 25)], 1)
    rows = [Row("processor time of 25 coefficients of friction, s", GOAL, 2.0, many, 0.0, COST, "statement", "at most")]
    tilts = np.deg2rad(np.linspace(0.0, 3.5, 2 if quick else 8))
    mus, depths = np.linspace(0.06, 1.0, 4 if quick else 5), np.linspace(4.0, 10.0, 2 if quick else 5)
    start, count = time.process_time(), 0
    for tilt in tilts:
        body = build(replace(problem.model, object=Plane(tilt=float(tilt))))
        for mu, depth in product(mus, depths):
            pressed(replace(body, model=replace(body.model, legs=(Leg(float(depth)),))), Coulomb(float(mu)))
            count += 1
    spent = time.process_time() - start
    what = f"processor time of {count} presses (mu, depth, tilt) of {len(tilts)} bodies, these included, s"
    return [*rows, Row(what, GOAL, 20.0, spent, 0.0, COST, "statement", "at most")]


def _draw(figure: Any, found: dict[Any, np.ndarray], costs: Sequence[tuple[Any, ...]]) -> None:
    left, middle, right = figure.subplots(1, 3)
    for k, (name, mu) in enumerate(dict.fromkeys((name, mu) for name, mu, _ in found)):
        exact, counts = found[name, mu, 0], [n for *of, n in found if of == [name, mu] and n]
        for quantity, axes in ((0, left), (1, middle)):
            errors = [abs(found[name, mu, n][quantity] / exact[quantity] - 1.0) for n in counts]
            axes.loglog(counts, errors, "o-", ms=3, lw=1, color=f"C{k}", label=f"{name}, mu = {mu:g}")
    for axes, name in ((left, "normal force"), (middle, "friction sum")):
        axes.loglog([10, 10240], [1e-2, 0.1 / 10240], "k:", lw=1)
        axes.set(xlabel="plain increments", ylabel="change from the path", title=f"{name}; dotted: slope -1")
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=7)
    places = np.arange(len(costs))
    names = [f"{name}, mu = {mu:g}\n{events} events, {systems} systems" for name, mu, events, systems, *_ in costs]
    for shift, of, label in ((-0.2, 4, "the path alone"), (0.2, 5, "with ten results")):
        right.barh(places + shift, [cost[of] / cost[6] for cost in costs], 0.4, label=label)
    right.axvline(1.0, color="k", lw=0.8, ls=":")
    right.set_yticks(places, names, fontsize=6)
    right.set(xlabel="time over ten increments'", title="cost")
    right.legend(fontsize=7, loc="lower right")
