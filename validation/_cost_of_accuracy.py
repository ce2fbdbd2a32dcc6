"""What does accuracy cost: which element, mesh, increments and solver give 5, 1, 0.1 % in the least time and memory?

Five presses with mu = 0.25: the Fig. 9 finger at nu = 0.49 as a section in plane strain and as a 20 mm wide solid
(Maeno 2004, Sec. III), in small strain and at large deformation, and the paper's half cylinder in plane stress at
nu = 0.3 (Sec. II).  Every case is pressed in a process of its own, which reports its peak memory.  Times are processor
times from meshing to the last increment, the least of up to three runs in turn.  The truth is extrapolated from the
finest meshes and the most increments.  Where no run is known to be as exact as is asked for, mesh and increments are
extrapolated by measured rates, and marked.

Rates: a corner of 90 degrees between a clamped and a free side gives a displacement r^e (Williams 1952), and the work
of the load converges as h^(2 e).  A section under a plane has no increments; elsewhere their error falls as 1/N^2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._machine import memory_bytes
from finger3d._types import Tree
from finger3d.scene.mesh_sizes import BASE_SHARE, MOST_OF_EXTENT, SIZE_SHARE

from ._child import Bench, best_of
from ._corner import clamped_free, observed
from ._cost import HALF, LARGE, QUANTITIES, SECTION, SOLID, Case
from ._cost_extrapolated import EMPTY, at, constant, extrapolate, memory_mb, rate
from ._cost_figure import draw
from ._cost_runs import MODULE
from ._cost_truth import LENGTHS, Advice, Known, Truth, advise, mesh_errors, seconds, step_errors, truth, value
from ._press import empty_mesh_cache
from ._rows import Result, Row, given, listed, of_records, zero

judged = listed(__file__)

TARGETS = (0.05, 0.01, 0.001)
WIDTH = 20.0  # of the solid
NEED_GB = 14.0  # of free memory, for 500 000 unknowns

BODIES = given(__file__)["body"]
"""By body: its height, its best element, the claims of the defaults, and the edge lengths of all series."""

BEST = {body: given["best"] for body, given in BODIES.items()}
Runs = dict[Case, dict[str, Any]]
Groups = dict[str, list[Case]]


def default(body: str) -> Case:
    """What a scene that gives no sizes and no steps is solved with."""
    kind = "ftetwild" if body in (SOLID, LARGE[SOLID]) else "section"
    height = BODIES[body]["height_mm"]
    longest = min(height * BASE_SHARE[kind], MOST_OF_EXTENT * WIDTH)
    return Case(body, height * SIZE_SHARE[kind], longest, BEST[body], "swept" if kind == "section" else kind)


def groups(body: str, quick: bool) -> Groups:
    """Series of cases by name, coarse to fine: elements, the other mesher, grading, solvers, and the paper's way."""
    sizes = _sizes(body, quick)
    best = BEST[body]
    middle = sizes["ladder"]
    made = {e: [Case(body, h, 4.0 * h, e) for h in sizes[e]] for e in ("mixed", "quadratic", "linear") if e in sizes}
    made["steps"] = [Case(body, middle, 4.0 * middle, best, counts=tuple(sizes["counts"]))]
    if body in LARGE.values():
        return made
    made["grading"] = [Case(body, middle, r * middle, best) for r in sizes["ratios"]]
    made["SuperLU"] = [Case(body, h, 4.0 * h, best, solver="superlu") for h in sizes["slow"]]
    made["one factorisation an iteration"] = [Case(body, h, 4.0 * h, best, way="each iteration") for h in sizes["slow"]]
    made["plain increments"] = [replace(c, way="plain increments") for c in made["one factorisation an iteration"]]
    if "pytetwild" in sizes:
        made["pytetwild"] = [Case(body, h, 4.0 * h, best, "ftetwild") for h in sizes["pytetwild"]]
    return made


def _sizes(body: str, quick: bool) -> Tree:
    sizes = dict(BODIES[body]["quick" if quick else "series"])
    memory = memory_bytes()
    if body == SOLID and not quick and memory and memory[1] / 1e9 > NEED_GB:
        sizes["mixed"] = [*sizes["mixed"], 0.5]
    return sizes


def run(quick: bool) -> Result:
    """All cases; quick: the section on coarse meshes."""
    bodies = (SECTION,) if quick else (SECTION, HALF, SOLID, *LARGE.values())
    made = {body: groups(body, quick) for body in bodies}
    cases = list(dict.fromkeys(c for g in made.values() for cs in g.values() for c in cs))
    cases += [c for c in map(default, bodies) if c not in cases and not quick]
    # pytetwild meshes are made here, once, and their time counts
    with empty_mesh_cache(), Bench(MODULE) as bench:
        runs = best_of(bench, "measured", cases, lambda s: 1 if quick else 3 if s < 1.5 else 2 if s < 4.0 else 1)
    return _judged(made, runs, quick)


def _judged(made: Mapping[str, Groups], runs: Runs, quick: bool) -> Result:
    rows, lines, errors, steps, truths = [], [], {}, {}, {}
    for body, series in made.items():
        truths[body] = {q: truth(series[BEST[body]], runs, q) for q in QUANTITIES}
        ladder = series["steps"][0]
        errors |= mesh_errors([c for c in runs if c.body == body], runs, truths[body])
        steps[body] = {q: step_errors(runs[ladder], q, ladder.counts) for q in QUANTITIES}
    rates = {q: rate(q, [(s, truths[b][q]) for b in made for s in _even(made[b])], errors) for q in QUANTITIES}
    for body, series in made.items():
        rows += _truth_rows(body, truths[body], quick)
        if body not in LARGE.values():
            rows += _rate_rows(body, series, runs)
            rows += [*_solver_rows(body, series, runs), *_locking_rows(body, series, errors)]
        if not quick:
            rows += _slower_row(body, series, runs) if body not in LARGE.values() else _large_row(body, series, runs)
            rows += _default_rows(body, errors, truths[body], steps[body])
        lines += [_run_line(c, runs[c], errors[c]) for c in runs if c.body == body]
    advices = [(b, a) for b, series in made.items() for a in _advices(series, runs, errors, truths[b], rates)]
    rows += _extrapolation_rows(made, runs, errors, truths, rates)
    holes = sum(a.case is None for _, a in advices)
    if not quick:
        rows.append(judged("cells", holes))
    lines += [_advice_line(body, a) for body, a in advices]
    lines += [{"kind": "rate of the error", "quantity": q, "rate": round(power, 3)} for q, power in rates.items()]
    table = of_records(lines)
    return Result(tuple(rows), table, lambda figure: draw(figure, [dict.fromkeys(table, "") | line for line in lines]))


def _even(series: Groups) -> list[list[Case]]:
    """Series of meshes by size whose errors follow the edge length; linear elements lock."""
    return [series[k] for k in ("mixed", "quadratic") if k in series]


def _advices(
    series: Groups, runs: Runs, errors: Mapping[Case, Mapping[str, float]], truths: Mapping[str, Truth],
    rates: Mapping[str, float],
) -> list[Advice]:  # fmt: skip
    """The cheapest way to every target, by the runs if they show one."""
    usual = [series[k] for k in ("mixed", "quadratic", "linear", "pytetwild") if k in series]
    ladder, found = series["steps"][0], []
    for q in QUANTITIES:
        for target in TARGETS:
            known = Known(runs, errors, truths[q], runs[ladder], ladder.counts)
            one = advise(q, target, usual, known)
            found.append(one if one.case else extrapolate(one, _even(series), known, rates[q]))
    return found


def _extrapolation_rows(
    made: Mapping[str, Groups], runs: Runs, errors: Mapping[Case, Mapping[str, float]],
    truths: Mapping[str, Mapping[str, Truth]], rates: Mapping[str, float],
) -> Iterator[Row]:  # fmt: skip
    """What is extrapolated to the finest meshes from the coarser ones, beside what these have."""
    ratios = [
        constant(q, cases[:-1], errors, truths[body][q], rates[q]) * cases[-1].size ** rates[q] / errors[cases[-1]][q]
        for body, series in made.items()
        for cases in _even(series)
        for q in QUANTITIES
        if errors[cases[-1]][q] > 2.0 * truths[body][q].uncertainty and math.isfinite(rates[q])
    ]
    if ratios:
        yield judged("error-extrapolated-to-the-finest-mesh", float(np.median(ratios)), count=len(ratios))
    for body, series in made.items():
        *coarser, finest = (runs[c] for c in series[BEST[body]])
        dofs, peaks = ([run[key] for run in coarser] for key in ("dofs", "peak_MB"))
        time = at(finest["dofs"], dofs, list(map(seconds, coarser))) / seconds(finest)
        memory = memory_mb(finest["dofs"], dofs, peaks, EMPTY * min(peaks)) / finest["peak_MB"]
        for what, got in (("processor time", time), ("peak memory", memory)):
            yield judged("extrapolated-to-the-finest-mesh-over", got, what=what, body=body)


def _truth_rows(body: str, truths: Mapping[str, Truth], quick: bool) -> list[Row]:
    """What was extrapolated without the finest run, against the finest run."""
    far = {"force": 0.002, "friction_sum": 0.02, "gauge_strain": 0.05, "contact_length": 0.05, "stick_length": 0.15}
    return [
        judged("finest-run", truths[q].check, tolerance=far[q] * (4.0 if quick else 1.0), q=q, body=body)
        for q in QUANTITIES
        if q not in LENGTHS or not quick
    ]


def _rate_rows(body: str, series: Groups, runs: Runs) -> Iterator[Row]:
    """Of the force in the mesh."""
    wanted = 2.0 * clamped_free(math.pi / 2, 0.3 if body == HALF else 0.49, body == HALF)
    if body != HALF:
        # in a solid the layers across the width are few and whole, so neighbouring levels are no family
        cases = series["mixed"][-3:] if body == SECTION else series["mixed"][-1::-2][2::-1]
        try:
            rate = observed([c.size for c in cases], [value(runs[c], "force") for c in cases])
        except ValueError:  # no rate fits
            rate = math.nan
        yield judged("rate", rate, wanted, value=BEST[body], body=body)


def _solver_rows(body: str, series: Groups, runs: Runs) -> Iterator[Row]:
    """SuperLU and one factorisation an iteration, in plain increments, give what PARDISO and the condensation give."""
    for name, way, limit, keys in (
        ("SuperLU", "condensed", 1e-9, QUANTITIES),
        ("one factorisation an iteration", "plain increments", 1e-6, ("force", "friction_sum", "gauge_strain")),
    ):
        worst = 0.0
        for case in series[name]:
            own = runs[replace(case, solver="pardiso", way=way)]
            worst = max(worst, *(abs(value(runs[case], k) / value(own, k) - 1.0) for k in keys))
        why = "round-off of two factorisations" if limit == 1e-9 else "a step may stop at a residual of 1e-8"
        yield zero(f"{name} against PARDISO and one condensation, largest difference, {body}", "this code", worst,
                   limit, why)  # fmt: skip


def _slower_row(body: str, series: Groups, runs: Runs) -> list[Row]:
    """What one condensation saves against one factorisation in every iteration, on the finest mesh that had both."""
    case = series["one factorisation an iteration"][-1]
    own = runs[replace(case, way="condensed")]
    times = seconds(runs[case]) / seconds(own)
    what = (
        f"time of {runs[case]['factorizations']} factorisations over that of one condensation, {own['dofs']} unknowns"
    )
    return [judged("factorisations-saved", times, what=what, body=body)]


def _large_row(body: str, series: Groups, runs: Runs) -> list[Row]:
    """What large deformation costs beside small strain, on the finest mesh that had both."""
    case = series["mixed"][-1]
    small = replace(case, body=next(b for b, large in LARGE.items() if large == body))
    times = seconds(runs[case]) / seconds(runs[small])
    return [judged("time-of-a-press-at-large", times, value=runs[case]["dofs"], body=body)]


def _locking_rows(body: str, series: Groups, errors: Mapping[Case, Mapping[str, float]]) -> list[Row]:
    """Linear elements lock near incompressibility, and not in plane stress at nu = .3."""
    best = {c.size: errors[c]["force"] for c in series[BEST[body]]}
    case = series["linear"][0] if body != HALF else series["linear"][-1]
    got = errors[case]["force"]
    here = f"error of the force, linear elements of {case.size:g} mm, {body}"
    if body == HALF:
        return [judged("no-locking", got, here=here)]
    factor = got / best[case.size]
    return [judged("over-that-of-ones", factor, here=here, value=BEST[body])]


def _default_rows(
    body: str, errors: Mapping[Case, Mapping[str, float]], truths: Mapping[str, Truth],
    steps: Mapping[str, Mapping[int, float]],
) -> Iterator[Row]:  # fmt: skip
    """Whether the defaults keep what they claim, mesh and increments together."""
    case = default(body)
    for q, claim in BODIES[body]["claims"].items():
        limit = claim * case.size / truths[q].value if q in LENGTHS else claim
        got = errors[case][q] + steps[q][10]
        unit = f"{claim:g} edge length{'s' if claim > 1.0 else ''}" if q in LENGTHS else f"{100 * claim:g} %"
        words = {"size": case.size, "base": case.base, "mesher": case.mesher, "body": body, "unit": unit}
        yield judged("error-of-at-the-defaults-mm", got, abs(limit), truths[q].uncertainty, q=q, **words)


def _run_line(case: Case, run: Mapping[str, Any], errors: Mapping[str, float]) -> dict[str, Any]:
    count = case.counts[0] if 10 not in case.counts else 10
    own = {k: float(f"{v:.5g}") for k, v in errors.items()}
    parts = run["processor_seconds"]
    return {
        "kind": "run", "body": case.body, "element": case.element, "mesher": case.mesher, "size_mm": case.size,
        "base_size_mm": case.base, "steps": count, "solver": case.solver, "way": case.way, "dofs": run["dofs"],
        "contact_points": run["contact_points"], "factorizations": run["factorizations"],
        **{f"{k}_s": round(parts[k], 4) for k in ("mesh", "assembly", "condensation")},
        "contact_s": round(parts[f"contact {count}"], 4), "seconds": round(seconds(run, count), 4),
        "peak_MB": round(run["peak_MB"], 1), "load": round(run["load"], 2),
        **{q: float(f"{value(run, q, count):.7g}") for q in QUANTITIES if q in errors},
        **{f"error_{q}": own[q] for q in QUANTITIES if q in own},
        **{f"contact_{n}_s": round(parts[f"contact {n}"], 4) for n in case.counts if len(case.counts) > 1},
    }  # fmt: skip


def _advice_line(body: str, a: Advice) -> dict[str, Any]:
    line = {"kind": "use", "body": body, "quantity": a.quantity, "target": a.target,
            "truth_known_to": float(f"{a.uncertainty:.2g}"), "extrapolated": "yes" * a.extrapolated}  # fmt: skip
    if a.case is None:
        return line
    return line | {
        "element": a.case.element, "mesher": a.case.mesher, "size_mm": a.case.size, "base_size_mm": a.case.base,
        "steps": a.steps, "dofs": a.dofs, "seconds": round(a.seconds, 3), "mesh_s": round(a.mesh_seconds, 3),
        "peak_MB": round(a.peak_mb, 1),
    }  # fmt: skip
