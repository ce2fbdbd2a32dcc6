"""Beside CalculiX, on the same mesh and machine: do the forces agree, and how many times faster is one condensation?

Peer: CalculiX CrunchiX (ccx, Debian's calculix-ccx 2.20) with its surface-to-surface penalty contact under a flat
plate: 20 MPa/mm, stick slope 5 MPa/mm, ten increments or more, small strain, SPOOLES.  The Fig. 9 finger at nu = 0.45,
mu = 0.25 is pressed 10 mm: its half section in plane strain (CPE6) and a quarter of the 20 mm wide solid (C3D10).  Both
programs use the same quadratic mesh, so that only contact and solution differ.  finger3d is timed from the meshing to
the last increment with the libraries loaded; starting Python and importing them takes about a second once per session.
Where ccx is not installed the committed results are judged.

scikit-fem is no peer, since it has no contact.  A penalty contact written around it would be another program of this
project, solved by SciPy's SuperLU; cost_of_accuracy.py times one factorisation per iteration with a faster solver.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from finger3d._machine import versions
from finger3d.analyses.calculix import Contact
from finger3d.mechanics.model import Leg

from ._ccx import INSTALL, Answer, program, version
from ._ccx import run as run_calculix
from ._child import Bench, best_of
from ._cost import SECTION, SOLID, Case, model_of
from ._cost_runs import MODULE
from ._rows import Result, Row, committed_instead, grouped, listed

BY_NAME = True
judged = listed(__file__)

WANTED = {SECTION: 20.0, SOLID: 60.0}  # goals: time of CalculiX over finger3d's
NU = 0.45
# MPa/mm, under pressures of .2 MPa: of those tried on the coarsest solid (100 and 10, 20 and 5, 20 and 2) the quickest,
# with the force nearest to ours.  At 2000 it diverged.
PENALTY, STICK_SLOPE = 20.0, 5.0
LIMIT_S = 900.0
COLUMNS = (
    "body program size_mm base_size_mm dofs increments iterations factorizations force_N outward_friction_x_N "
    "outward_friction_z_N wall_s cpu_s peak_MB threads load version settings"
).split()


def cases(quick: bool) -> list[Case]:
    """Sections and solids, coarse to fine; the last of each is judged by its time."""
    sizes = [(SECTION, 6.0)] if quick else [(SECTION, 2.0), (SECTION, 1.0), (SOLID, 4.0), (SOLID, 2.0)]
    return [Case(body, h, 4.0 * h, "quadratic", nu=NU) for body, h in sizes]


def run(quick: bool) -> Result:
    """Each mesh once by CalculiX, and by finger3d as the best of three runs spread around it."""
    if program() is None:
        return _judged(committed_instead("beside_calculix", "ccx", INSTALL), timed=not quick)
    return _judged(measured(cases(quick)), timed=not quick)


def measured(meshes: Sequence[Case]) -> list[dict[str, Any]]:
    """A line of the table for each program on each mesh, ours first; ccx must be installed."""
    table: list[dict[str, Any]] = []
    with Bench(MODULE) as bench:
        for case in meshes:
            load = os.getloadavg()[0]
            before = best_of(bench, "measured", [case], lambda _: 2)[case]
            theirs = calculix(case)
            after = best_of(bench, "measured", [case], lambda _: 1)[case]
            seconds = {k: min(v, after["seconds"][k]) for k, v in before["seconds"].items()}
            ours = {**before, "seconds": seconds}
            table += [_line_ours(case, ours, load), _line_theirs(case, ours["dofs"], theirs, load)]
    return table


def _judged(table: Sequence[Mapping[str, Any]], timed: bool) -> Result:
    """Rows from the table alone, pair by pair; times of the finest mesh of each body."""
    pairs = list(zip(table[::2], table[1::2], strict=True))
    rows = [row for ours, theirs in pairs for row in _rows(ours, theirs)]
    if timed:
        finest = {ours["body"]: (ours, theirs) for ours, theirs in pairs}
        rows += [row for ours, theirs in finest.values() for row in times(ours, theirs)]
    columns = {name: [line[name] for line in table] for name in COLUMNS}
    return Result(tuple(rows), columns, lambda figure: _draw(figure, columns))


def calculix(case: Case) -> Answer:
    """A press by CalculiX."""
    model = replace(model_of(case), legs=(Leg(10.0, steps=case.counts[0]),), gauges=())
    return run_calculix(model, LIMIT_S, Contact(PENALTY, STICK_SLOPE, model.friction.mu))


def _line_ours(case: Case, ours: dict[str, Any], load: float) -> dict[str, Any]:
    found = ours["numbers"]["10"]
    values = [
        case.body, "finger3d", case.size, case.base, ours["dofs"], 10, ours["iterations"]["10"], ours["factorizations"],
        found["force"], found["outward_x"], found["outward_z"], sum(ours["seconds"].values()), ours["cpu_s"],
        ours["peak_MB"], _threads(), load, versions().get("finger3d", ""), "swept mesh, PARDISO, projection",
    ]  # fmt: skip
    return dict(zip(COLUMNS, values, strict=True))


def _line_theirs(case: Case, dofs: int, theirs: Answer, load: float) -> dict[str, Any]:
    settings = f"surface to surface, linear penalty {PENALTY:g} MPa/mm, stick slope {STICK_SLOPE:g} MPa/mm"
    values = [
        case.body, "CalculiX", case.size, case.base, dofs, theirs.increments, theirs.iterations, theirs.iterations,
        theirs.force, *theirs.forces[-1, ::2], theirs.wall, theirs.cpu, theirs.peak_mb, _threads(), load,
        version(), settings,
    ]  # fmt: skip
    return dict(zip(COLUMNS, values, strict=True))


def _threads() -> int:
    return int(os.environ.get("OMP_NUM_THREADS") or len(os.sched_getaffinity(0)))


def _rows(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> Iterator[Row]:
    """The force on every mesh; friction where the mesh has some points across the finger."""
    here = f"{ours['body']}, edges of {ours['size_mm']:g} mm, {ours['dofs']:.0f} unknowns"
    yield judged("force", ours["force_N"], theirs["force_N"], here=here)
    if ours["body"] == SECTION or ours["size_mm"] <= 2.0:
        for axis in "x" if ours["body"] == SECTION else "xz":
            key = f"outward_friction_{axis}_N"
            yield judged("outward-friction", ours[key], theirs[key], axis=axis, here=here)


def times(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> list[Row]:
    """Wall time, as a user waits, and processor time, in which the machine's other work counts less."""
    here = f"{ours['body']}, edges of {ours['size_mm']:g} mm, {ours['dofs']:.0f} unknowns"
    wall, cpu = (theirs[k] / ours[k] for k in ("wall_s", "cpu_s"))
    return [
        judged("time-of-calculix", wall, WANTED[ours["body"]], here=here),
        judged("processor-time-of-calculix", cpu, WANTED[ours["body"]], here=here),
    ]


def _draw(figure: Any, columns: dict[str, Any]) -> None:
    """Times of both programs over unknowns, and the forces."""
    left, right = figure.subplots(1, 2)
    for (body, name), t in grouped(columns, "body", "program"):
        style = {"color": "C0" if body == SECTION else "C1", "label": f"{name}, {body}"}
        mark = "o-" if name == "finger3d" else "s--"
        left.loglog(t["dofs"], t["wall_s"], mark, **style)
        right.semilogx(t["dofs"], t["force_N"], mark, mfc="none", **style)
    left.set(xlabel="unknowns", ylabel="wall time (s)", title="mesh to last of 10 increments")
    right.set(xlabel="unknowns", ylabel="force at 10 mm (N)", title="nu = 0.45, mu = 0.25")
