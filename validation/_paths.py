"""How far are increments in sections from the exact path, and do automatic ones know?

Source: contact in small strain under a flat object is piecewise linear in the motion (Klarbring 1999), so that
increments have a limit which events reach (`_exact_path`).  Plain increments, which hold a point that closes where it
was before, approach it at first order, those of finger3d at second order on the whole; points close one by one, so that
the error falls unevenly, and where points slip one way and then the other the friction sum keeps an error of first
order.  What automatic increments miss is compared with the bar of the press, and with the part of it that is theirs.

The path itself is checked, too: the numbers at the ends of the legs must not depend on how many results are written on
the way, also at coefficients of friction so large that forces jump, and the work must be what is stored and dissipated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.step_halving import errors_of_runs, march_automatic
from finger3d.mechanics.model import Leg

from ._exact_path import exact_press
from ._increments import PlainCoulomb, imbalance
from ._paper import STRAIN, STRESS, fig9, half_cylinder
from ._press import PAPER_GAUGE, changed, in_increments, under
from ._rows import Result, Row, at_least, columns, words, zero

MUS = (0.06, 0.25, 0.5, 1.0)
GRID_NU, GRID_MU = (0.0, 0.3, 0.49, 0.5), (0.0, 0.06, 0.25, 1.0, 3.0, 10.0, 1e3, 1e6)
STATIONS = (7, 320)
FORCES = ("normal_force_N", "friction_sum_N")
AREAS, ENERGIES = ("contact_area_mm2", "stick_area_mm2"), ("external_work_mJ", "dissipation_mJ")

PRESS_SLIDE_RELEASE = (Leg(10.0), Leg(10.0, slide_x_mm=3.0), Leg(4.0, slide_x_mm=3.0))
HALF = "half cylinder"
PLAIN, OWN = "plain", "finger3d's"
ORDER = {PLAIN: 1.0, OWN: 2.0}
WITHIN, SHARE = 2.0, 0.9
_ROUND_OFF = 1e-9
SAME = "a path has no increments"
GOAL = "goal of finger3d"


def run(quick: bool) -> Result:
    """Quick: one coarse section, at most 160 increments, and a small grid."""
    counts = (10, 40, 160) if quick else (10, 40, 160, 640)
    sizes = (4.0,) if quick else (2.0, 1.0)
    sections = {f"Fig. 9, {size:g} mm": fig9(0.49, STRAIN, size, [PAPER_GAUGE]) for size in sizes}
    if not quick:
        sections[HALF] = half_cylinder(0.3, STRESS, 0.1)
    errors, automatic = {}, []
    for name, section in sections.items():
        for mu in MUS[1::2] if quick else MUS:
            problem = _under(section, mu, section.model.legs, 1)
            exact = _numbers(problem, exact_press(problem)[-1])
            for kind, law in ((PLAIN, PlainCoulomb(mu)), (OWN, Coulomb(mu))):
                for count in counts:
                    errors[name, mu, kind, count] = _errors(exact, _numbers(problem, under(problem, law, count)[-1]))
            automatic += [(name, mu, *line) for line in _automatic(problem, exact)]
    rows = [row for name, mu in dict.fromkeys(key[:2] for key in errors) for row in _rates(errors, name, mu, counts)]
    rows += _known(automatic)
    grid = _grid(quick)
    rows += _grid_rows(grid)
    titles = "section mu number increments true_error estimated bar nu difference imbalance"
    table = [(*line, *("",) * 3) for line in automatic] + [
        ("grid", mu, *("",) * 5, nu, *more) for nu, mu, *more in grid
    ]
    return Result(tuple(rows), columns(titles, table), lambda figure: _draw(figure, errors, automatic))


def _under(section: Problem, mu: float, legs: Sequence[Leg], steps: int | Literal["auto"]) -> Problem:
    return changed(section, friction=Coulomb(mu), legs=in_increments(legs, steps))


def _numbers(problem: Problem, step: StepResult) -> dict[str, float]:
    numbers = press_numbers(problem, step)
    return {name: numbers[name] for name in (*FORCES, *ENERGIES, f"gauge_{PAPER_GAUGE.name}") if name in numbers}


def _errors(exact: dict[str, float], numbers: dict[str, float]) -> dict[str, float]:
    """Errors over the number; that of the dissipation over the work."""
    scale = exact | {"dissipation_mJ": exact["external_work_mJ"]}
    return {name: abs(numbers[name] - exact[name]) / abs(scale[name]) for name in exact}


def _rates(errors: dict[Any, dict[str, float]], name: str, mu: float, counts: Sequence[int]) -> Iterator[Row]:
    """Rates at which the worst error falls from the fewest to the most increments."""
    for kind, order in ORDER.items():
        few, most = (max(errors[name, mu, kind, count].values()) for count in (counts[0], counts[-1]))
        rate = float(np.log(few / max(most, 1e-15)) / np.log(counts[-1] / counts[0]))
        what = f"rate at which {kind} increments near the path, {name}, mu = {mu:g}"
        # in the half cylinder points slip one way and then the other within an increment
        sort = "statement" if kind == OWN and name == HALF else "verification"
        yield Row(what, f"order {order:g}", order, rate, 0.4, "points close one by one", sort, "at least")


def _automatic(problem: Problem, exact: dict[str, float]) -> list[tuple[Any, ...]]:
    """Lines of number, increments, true error, its estimate and its bar of a press whose increments are chosen."""
    own = _under(problem, problem.model.friction.largest, problem.model.legs, "auto")
    steps, chosen = march_automatic(own)
    assert chosen is not None
    told = errors_of_runs([(count, _numbers(problem, run[-1])) for count, run in chosen.runs])
    bars = estimate(own, steps, numbers=_numbers, chosen=chosen).totals()
    numbers = _numbers(problem, steps[-1])
    left = {name: abs(numbers[name] - value) - _ROUND_OFF * abs(value) for name, value in exact.items()}
    return [(name, len(steps), max(error, 0.0), told[name], bars[name]) for name, error in left.items()]


def _known(automatic: list[tuple[Any, ...]]) -> list[Row]:
    within, covered = [true <= WITHIN * told for *_, true, told, _ in automatic], [e <= b for *_, e, _, b in automatic]
    what = f"share of {len(within)} errors of automatic increments within"
    return [
        at_least(f"{what} the bar of mesh and increments", GOAL, SHARE, float(np.mean(covered))),
        at_least(f"{what} {WITHIN:g} estimates of the increments alone", GOAL, SHARE, float(np.mean(within)),
            kind="statement"),
    ]  # fmt: skip


def _grid(quick: bool) -> list[tuple[Any, ...]]:
    """Lines nu, mu, largest difference between numbers of results, imbalance."""
    lines = []
    size, nus, mus = (6.0, (0.49,), (0.25, 1e6)) if quick else (4.0, GRID_NU, GRID_MU)
    for nu in nus:
        section = build(replace(fig9(nu, STRAIN, size, [PAPER_GAUGE]).model, legs=PRESS_SLIDE_RELEASE))
        for mu in mus:
            ends = []
            for count in (3, 20) if quick else STATIONS:
                problem = _under(section, mu, PRESS_SLIDE_RELEASE, count)
                steps = exact_press(problem)
                ends.append([measure(problem.points, steps[(k + 1) * count - 1]) for k in range(3)])
            lines.append((nu, mu, _apart(*ends), abs(imbalance(problem, steps[-1]))))
    return lines


def _apart(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> float:
    """Largest difference, forces over the largest normal force, areas over the largest area of contact and so on."""
    scales = {name: max(abs(leg[family[0]]) for leg in one) for family in (FORCES, AREAS, ENERGIES) for name in family}
    return max(abs(a[key] - b[key]) / scale for a, b in zip(one, other, strict=True) for key, scale in scales.items())


def _grid_rows(grid: Sequence[tuple[Any, ...]]) -> list[Row]:
    here = f"{len(grid)} histories, mu up to {max(line[1] for line in grid):g}"
    apart, balance = (max(line[k] for line in grid) for k in (2, 3))
    what = f"{here}: largest change of a number at the end of a leg with the results on the way, relative"
    rows = [zero(what, SAME, apart, 1e-9, "round-off")]
    what = f"{here}: work less stored energy less dissipation, over the work"
    return [*rows, zero(what, "first law", balance, 1e-9, "round-off")]


def _draw(figure: Any, errors: dict[Any, dict[str, float]], automatic: list[tuple[Any, ...]]) -> None:
    left, right = figure.subplots(1, 2)
    names = list(dict.fromkeys(key[0] for key in errors))
    for name, mu in dict.fromkeys(key[:2] for key in errors):
        for kind, style in ((PLAIN, ":"), (OWN, "-")):
            counts = [n for *of, n in errors if of == [name, mu, kind]]
            worst = [max(errors[name, mu, kind, n].values()) for n in counts]
            label = name if (kind, mu) == (OWN, MUS[1]) else None
            left.loglog(counts, worst, f"o{style}", ms=3, lw=1, color=f"C{names.index(name)}", label=label)
    left.set(xlabel="increments", ylabel="largest relative error, each mu", title="finger3d's (lines), plain (dotted)")
    for k, number in enumerate(dict.fromkeys(line[2] for line in automatic)):
        told, true = np.array([(line[5], line[4]) for line in automatic if line[2] == number]).T
        right.loglog(np.maximum(told, 1e-9), np.maximum(true, 1e-9), "o", ms=4, color=f"C{k}", label=words(number))
    ends = np.array([1e-9, 10.0])
    right.loglog(ends, WITHIN * ends, "k:", lw=1, label="two estimates")
    right.set(xlabel="estimated error (N, mJ, strain)", ylabel="true error (N, mJ, strain)")
    right.set_title("automatic increments; 1e-9: less than that")
