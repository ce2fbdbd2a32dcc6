"""Time of a press relative to one factorisation of the same matrix, and the overhead of the commands.

All ratios are measured in one run on the Fig. 9 finger, 20 mm wide, nu = 0.49, in ten increments except where the
rows say that their number is chosen by the estimated error. Solids use swept meshes, which are reproducible. Each is
solved twice in a process of its own and the shorter time of each stage counts; for whole sweeps the median over pairs
is taken. The factorisation it is compared with is PARDISO's, called through pypardiso with the same settings
(parallel METIS, Bunch-Kaufman). Every row states the load of the machine, since other work distorts the times. The
results describe one machine at one time and are not stored.

Run it by ``make bench``.  ``python -m validation._bench --quick`` only shows that the benchmark runs.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from finger3d._machine import child_environment, cores
from finger3d.analyses.pressed_body import presses
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Domain, Model
from finger3d.progress import Progress

from ._cost import factored, free_part
from ._press import changed, converged, fig9_model
from ._rows import Row, at_most

LARGE, MIDDLE, QUICK = 1.1, 1.25, 3.0  # mm: 150 000, 47 000 and 8 000 unknowns
MUS = (0.06, 0.125, 0.25, 0.5, 1.0)
MU = 0.25
GRADING = {LARGE: 2.0}  # how much longer edges are far from the contact, else 4: the large one has 1 400 contact rows
FIG9 = Path(__file__).parents[1] / "geometries" / "fig9.toml"
SMALL_STRAIN = "effects.auto=false"
PRESSED = (SMALL_STRAIN, "gauge=[]", "press.steps=10")
SECTION = (*PRESSED, "model.domain=plane-strain", "mesh.size_mm=0.3", "mesh.base_size_mm=1.0")  # 26 000 unknowns
SOLID = (*PRESSED, "mesh.mesher=swept", f"mesh.size_mm={MIDDLE}", f"mesh.base_size_mm={4.0 * MIDDLE}")
BALL_ON_GEL = (
    'finger={geometry="block",half_length_mm=12.625,height_mm=4.0,width_mm=20.75}', "material.E_MPa=0.1", "gauge=[]",
    'object={shape="sphere",radius_mm=3.0}', "friction.mu=0.5", "press.depth_mm=0.8",
)  # fmt: skip
"""The gel pad under a ball that irisxu02/gelsight_ansys_sim presses in ANSYS, in 130 s on eight cores."""

FIVE_AGAINST_ONE = {"in ten increments": 1.6, "in increments chosen by their error": 2.6}
"""Bounds on the time of five presses of a body over that of one; choosing the increments of a press takes up to 0.4 of
the time of the whole command with one press."""


def fig9(size: float, domain: Domain = "solid") -> Model:
    """The finger at an edge length."""
    return fig9_model(0.49, size, GRADING.get(size, 4.0) * size, domain, friction=Coulomb(0.25))


def _seconds(act: Callable[[], Any]) -> float:
    """Wall time of a call."""
    begin = time.perf_counter()
    act()
    return time.perf_counter() - begin


def measured(size: float) -> dict[str, float]:
    """A press in this process and one of all MUS, seconds by stage; the same again; then plain PARDISO.

    The shorter time of each stage counts: the plain factorisation finds memory that was used before, and memory touched
    for the first time is slow, above all on a virtual machine.
    """
    problem, found = _pressed(size)
    del problem  # frees the memory of its factor
    problem, again = _pressed(size)
    upper = free_part(problem)
    del problem
    return _least([found, again]) | {"factorisation": factored(upper)[0]}


def _pressed(size: float) -> tuple[Problem, dict[str, float]]:
    """The finger condensed, and pressed in ten increments, under one mu and all; seconds by stage, unknowns, rows."""
    problem = build(fig9(size))
    found = {k: problem.seconds[k] for k in ("assembly", "condensation")}
    found |= {"dofs": problem.body.stiffness.upper.shape[0], "rows": len(problem.system.active_dofs)}
    found["contact"] = _seconds(lambda: converged(changed(problem, friction=Coulomb(MU))))
    return problem, found | {"contact_all": _seconds(lambda: _under_all(problem, MUS))}


def _under_all(problem: Problem, mus: Sequence[float]) -> None:
    if not all(one.frame.outcome.ok for one in presses(problem, mus)):
        raise AssertionError("not every mu converged")


def _child(size: float) -> dict[str, float]:
    """`measured` in a process of its own, which starts with a clean memory; and the condensation by MUMPS in another.

    Where MKL is loaded, MUMPS calls MKL's BLAS in place of its own, and takes half the time.
    """
    command = [sys.executable, "-m", "validation._bench", json.dumps(size)]
    found, seconds = (json.loads(_run([*command, *more]).stdout.splitlines()[-1]) for more in ((), ("mumps",)))
    return dict(found) | {"mumps": seconds}


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    # a user's Python keeps what it compiled; one that may not would compile all of finger3d in every run
    environment = {**child_environment(), "PYTHONDONTWRITEBYTECODE": ""}
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment)


def _least(runs: Sequence[dict[str, float]]) -> dict[str, float]:
    return {key: min(run[key] for run in runs) for key in runs[0]}


def _finger3d(command: str, *arguments: str, keys: Sequence[str] = ()) -> None:
    """Run a command on the scene of Fig. 9 with some keys changed."""
    changes = [word for key in keys for word in ("--set", key)]
    _run([sys.executable, "-m", "finger3d", command, str(FIG9), *arguments, *changes])


def _press_overhead(repeats: int) -> float:
    """Seconds of `finger3d press --no-error` of a section that are not the solve: imports, pictures, files, page."""
    found = []
    with tempfile.TemporaryDirectory(prefix="finger3d_bench_") as out:
        for _ in range(repeats):
            wall = _seconds(lambda: _finger3d("press", "--no-error", "--out", out, keys=SECTION))
            spent = json.loads(Path(out, "summary.json").read_text(encoding="utf-8"))["cost"]["seconds"]
            found.append(wall - sum(spent[k] for k in ("mesh", "assembly", "condensation", "contact")))
    return min(found)


def _default_presses(quick: bool) -> Iterator[Row]:
    """Yield the time of presses with error bars and the effects that scenes call for, over that in small strain."""
    with tempfile.TemporaryDirectory(prefix="finger3d_bench_") as out:

        def seconds(*keys: str) -> float:
            for _ in range(2):  # the second takes the mesh from the cache
                last = _seconds(lambda: _finger3d("press", "--no-figures", "--out", out, keys=keys))
            return last

        for name, keys, ratio in (("Fig. 9", (), 3.0), ("a ball on a gel pad", BALL_ON_GEL, 4.0))[quick:]:
            large = seconds(*keys)
            what = f"press of {name}, effects that it calls for, {large:.1f} s, over small strain"
            yield _row(what, ratio, large / seconds(*keys, SMALL_STRAIN))
        what = "press of the section of Fig. 9, effects that it calls for, s"
        yield _row(what, 1.5, seconds("model.domain=plane-strain"))


def _sensitivity(quick: bool) -> Iterator[Row]:
    """Yield the processor time of the effects of all keys of a scene over that of its press."""
    section = ("model.domain=plane-strain",) if quick else ()
    with tempfile.TemporaryDirectory(prefix="finger3d_bench_") as out:

        def used(command: str, *arguments: str, large: bool) -> float:
            before = os.times()
            keys = (*section, SMALL_STRAIN, f"effects.large_deformation={str(large).lower()}")
            _finger3d(command, *arguments, "--out", str(Path(out, command)), keys=keys)
            after = os.times()
            return after.children_user + after.children_system - before.children_user - before.children_system

        for name, large in (("small strain", False), ("large deformation", True)):
            press = used("press", "--no-figures", large=large)
            what = f"effects of all keys of Fig. 9, {name}, processor time over that of a press"
            yield _row(what, 7.0, used("sensitivity", "--of", "normal_force_N", large=large) / press)


def _five_against_one(keys: Sequence[str], repeats: int) -> float:
    """Wall time of `finger3d sweep` of all of MUS over that of one, all of Python and output included.

    The median of pairs: one lucky run would decide a ratio of minima, as the speed of a virtual machine drifts.
    """
    with tempfile.TemporaryDirectory(prefix="finger3d_bench_") as folder:

        def seconds(number: int, mus: Sequence[float]) -> float:
            values, out = ",".join(f"{mu:g}" for mu in mus), str(Path(folder, f"{number}_{len(mus)}"))
            return _seconds(lambda: _finger3d("sweep", "--vary", f"friction.mu={values}", "--out", out, keys=keys))

        ones, fives = zip(*[[seconds(number, mus) for mus in ((MU,), MUS)] for number in range(repeats)], strict=True)
        return median(five / one for one, five in zip(ones, fives, strict=True))


def run(quick: bool, report: Progress) -> Iterator[list[Row]]:
    """Yield the rows of every stage; quick: on a small mesh, where they mean nothing, and without pytetwild."""
    repeats = 1 if quick else 3
    report.stage("presses beside one factorisation")
    yield _stages((QUICK,) if quick else (MIDDLE, LARGE), quick)
    report.stage("finger3d press of a section")
    overhead = _press_overhead(repeats)
    yield [_row("finger3d press --no-error of a section, less its solve, s", 3.5, overhead)]
    report.stage("default presses")
    yield list(_default_presses(quick))
    report.stage("effects of keys")
    yield list(_sensitivity(quick))
    report.stage("sweeps of five values of mu")
    yield _sweeps(quick)
    report.stage("large deformation")
    yield [_large_deformation(QUICK if quick else MIDDLE)]


def _stages(sizes: Sequence[float], quick: bool) -> list[Row]:
    """Return the stages of a press over one factorisation, five values of mu over one, and MUMPS."""
    best = {size: _least([_child(size) for _ in range(1 if quick else 2)]) for size in sizes}
    rows = _ratios(best[sizes[-1]])
    for size in sizes:
        once = best[size]["assembly"] + best[size]["condensation"]
        five = (once + best[size]["contact_all"]) / (once + best[size]["contact"])
        unknowns = f"{best[size]['dofs']:.0f} unknowns"
        rows.append(_row(f"5 values of mu against one, stages alone, {unknowns}", 1.25, five))
        mumps = best[size]["mumps"] / best[size]["condensation"]
        rows.append(_row(f"condensation by MUMPS against PARDISO, {unknowns}", 5.0, mumps))
    return rows


def _sweeps(quick: bool) -> list[Row]:
    """Return the time of sweeps of five values of mu over that of one."""
    bodies = {"section": SECTION} if quick else {"section": SECTION, f"solid, edges of {MIDDLE:g} mm": SOLID}
    given, chosen = FIVE_AGAINST_ONE
    found = {(body, given): _five_against_one(keys, 1 if quick else 7) for body, keys in bodies.items()}
    if not quick:
        automatic = {body: [key for key in keys if key != "press.steps=10"] for body, keys in bodies.items()}
        found |= {(body, chosen): _five_against_one(keys, 3) for body, keys in automatic.items()}
    return [
        _row(f"finger3d sweep of 5 values of mu against one, {body}, {increments}", FIVE_AGAINST_ONE[increments], ratio)
        for (body, increments), ratio in found.items()
    ]


def _large_deformation(size: float) -> Row:
    """Return the time of presses under many values of mu over that of one."""
    problem = build(LargeDeformation().apply(fig9(size)))
    one = _seconds(lambda: converged(problem))
    mus = np.linspace(0.05, 1.25, 3 if size == QUICK else 25)
    every = _seconds(lambda: _under_all(problem, mus.tolist()))
    what = f"large deformation, {problem.body.stiffness.upper.shape[0]} unknowns, 10 increments"
    return _row(f"{what}: {len(mus)} values of mu against one", 8.0, every / one)


def _ratios(best: dict[str, float]) -> list[Row]:
    chain = best["assembly"] + best["condensation"] + best["contact"]
    factor = best["factorisation"]
    here = f"against one plain factorisation ({factor:.1f} s) of {best['dofs']:.0f} unknowns, {best['rows']:.0f} rows"
    return [
        _row(f"assembly, condensation and 10 increments {here}", 1.8, chain / factor, "aim 1.4"),
        _row(f"assembly {here}", 0.3, best["assembly"] / factor, "aim 0.15"),
    ]


def _row(what: str, most: float, got: float, reason: str = "a bound") -> Row:
    return at_most(what, "goal of this project", most, got, f"{reason}; {_load()}", "statement")


def _load() -> str:
    load = os.getloadavg()[0]
    return f"load {load:.1f} on {cores()} cores{'' if load <= 1.3 * cores() else ', BUSY'}"


def main(arguments: Sequence[str]) -> None:
    """The table; or, in a child, one measurement as JSON."""
    if arguments and not arguments[0].startswith("-"):
        size = json.loads(arguments[0])
        if "mumps" in arguments:
            os.environ["FINGER3D_SOLVER"] = "mumps"
        print(json.dumps(build(fig9(size)).seconds["condensation"] if "mumps" in arguments else measured(size)))
        return
    from finger3d.cli.common import job
    from finger3d.cli.printing import print_columns

    from ._rows import table

    begin = time.perf_counter()
    with job(False, lambda done: "the rows above are all") as report:
        for rows in run("--quick" in arguments, report):
            if rows:
                print_columns("bench what kind reference wanted got error tolerance verdict".split(), table({"": rows}))
    print(f"{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1:])
