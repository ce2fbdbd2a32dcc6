"""Does contact settle in every case a user can write, is every state admissible, and what does the paper's rule do?

Source: the cases of validation/REFERENCES.md, 8.1 and 8.2, and a grid: nu from 0 to 1/2, mu from 0 to 1e6, 1 to 200
increments, a coarse and a fine mesh of the paper's Fig. 9 section (E = 1, pressed by 10 mm, a fifth of its height),
each pressed, slid and released; a smaller grid of the 20 mm wide solid, slid obliquely.  Up to mu = 1 the slide is 12
mu times the depth, so that the whole surface slips; for larger mu that would tear the finger off, and it is 3 mm.

Every state at the end of an increment, or of its parts, is checked again here, from compliance and forces alone:
gap, tension, Coulomb's limit, stick, and friction against slip; for points that have just closed the slip is the one
reported.  The paper's literal swap runs through the same histories up to its first cycle.  A state in which friction
helps slip satisfies the paper's own conditions; it is counted as wrong_way, and the history goes on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from operator import itemgetter
from typing import Any

import numpy as np

from finger3d.contact.friction import OPEN, SLIP, STICK, Coulomb
from finger3d.contact.state import ContactState
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.objects import ObjectPose

from . import _hard
from ._common import free_motion
from ._press import fig9_finger, fig9_model
from ._rows import ROBUST, Result, Row, Settled, at_least, at_most, grouped, zero

DEPTH = 10.0
NU = (0.0, 0.3, 0.45, 0.49, 0.499, 0.4999, 0.5)
MU = (0.0, 1e-6, 0.06, 0.25, 1.0, 5.0, 1e6)
STEPS = (1, 10, 200)
SIZES = {2: (4.0, 0.6), 3: (6.0, 4.0)}
LEGS = ("press", "slide", "release")
COLUMNS = (
    "dim nu mu increments contact_points leg settled parts residual violation iterations_median iterations_max "
    "fallback cut_back slipping paper_settled paper_wrong_way paper_cycled"
).split()
CRITERION = "convergence criterion of finger3d: residual <= 1e-8"


def grids(quick: bool) -> tuple[tuple[Any, ...], ...]:
    """Dimension, nu, mu, increments and edge lengths of both grids, thinned to what matters most where it is quick."""
    if quick:
        return (2, (0.0, 0.5), (0.0, 0.25, 1e6), (1, 5), SIZES[2][:1]), (3, (0.49,), (0.25,), (2,), (10.0,))
    return (2, NU, MU, STEPS, SIZES[2]), (3, (0.0, 0.3, 0.49, 0.5), (0.0, 0.25, 1.0, 1e6), (1, 10), SIZES[3])


def slide(mu: float) -> float:
    """Slide, mm: to full slip where that can be."""
    return max(0.5, 12.0 * mu * DEPTH) if mu <= 1.0 else 3.0


def path(dim: int, mu: float, steps: int) -> tuple[Leg, ...]:
    """Press, slide (askew in 3D), release."""
    x, z = slide(mu), 0.5 * slide(mu) if dim == 3 else 0.0
    return tuple(Leg(d, x * on, z * on, steps) for d, on in ((DEPTH, 0.0), (DEPTH, 1.0), (0.0, 1.0)))


def finger(dim: int, nu: float, size: float) -> Problem:
    """The Fig. 9 finger; candidate points for the longest slide of the grid."""
    domain, width, base = ("plane-strain", 1.0, 6.0) if dim == 2 else ("solid", 20.0, 12.0)
    legs, design = path(dim, 1.0, 1), fig9_finger(width)
    return build(fig9_model(nu, size, max(size, base), domain, legs=legs, design=design))


def relative(problem: Problem, pose: ObjectPose, state: ContactState) -> np.ndarray:
    """Gap and tangential displacement (c, d) mm since rest, from compliance and forces."""
    return np.asarray(free_motion(problem, pose) + np.einsum("idje,je->id", problem.delassus, state.force))


def violation(mu: float, before: ContactState, state: ContactState, change: np.ndarray, gap: np.ndarray) -> float:
    """Largest violation of the conditions at the end of a part of an increment: lengths over DEPTH, forces over the
    largest; from forces, gaps (c,) and tangential motion in the part (c, d - 1)."""
    force, status = state.force, state.status
    closed = (before.status == OPEN) & (status != OPEN)  # these moved freely until they touched
    if change.any():
        change = np.where(closed[:, None], state.accumulated_slip - before.accumulated_slip, change)
    normal, friction = force[:, 0], force[:, 1:]
    size = np.linalg.norm(friction, axis=1)
    touching, stuck, slips = status != OPEN, status == STICK, status == SLIP
    rubbed = slips & (size > 0.0)
    against = friction / np.where(size > 0.0, size, 1.0)[:, None]
    along = np.sum(change * against, axis=1)
    astray = np.linalg.norm(change - along[:, None] * against, axis=1)
    lengths = [np.where(touching, np.abs(gap), np.maximum(-gap, 0.0)), stuck * np.linalg.norm(change, axis=1)]
    lengths += [rubbed * np.maximum(along, 0.0), rubbed * astray]
    forces = [
        ~touching * (np.abs(normal) + size),
        np.maximum(-normal, 0.0),
        np.maximum(size - mu * normal, 0.0) * touching,
        slips * np.abs(size - mu * normal),
    ]
    largest = float(np.linalg.norm(force, axis=1).max()) or 1.0
    return max(float(np.max(lengths)) / DEPTH, float(np.max(forces)) / largest)


def case(problem: Problem, mu: float, steps: int) -> Iterator[tuple[Any, ...]]:
    """Rows of the table of one history, one a leg; the iterations a part of every increment follow each."""
    model = replace(problem.model, friction=Coulomb(mu), legs=path(problem.dim, mu, steps))
    problem = replace(problem, model=model)
    before, found = formulation_of(problem.model).start(problem).contact, []
    at = np.zeros_like(before.force)
    for frame in march(problem):
        worst = 0.0 if frame.outcome.ok else np.inf
        for pose, state in frame.parts if frame.outcome.ok else ():
            there = relative(problem, pose, state.contact)
            worst = max(worst, violation(mu, before, state.contact, (there - at)[:, 1:], there[:, 0]))
            before, at = state.contact, there
        found.append((frame, worst))
    outcomes = _literal(replace(problem, model=replace(model, rule="paper")))
    for k, name in enumerate(LEGS):
        leg = slice(k * steps, (k + 1) * steps)
        here, theirs = found[leg], outcomes[leg]
        frames = [f for f, _ in here]
        counts = [f.iterations / max(len(f.parts), 1) for f in frames] or [0]
        last = frames[-1].state.status if frames else np.zeros(1)
        slipping = float((last == SLIP).sum() / max((last != OPEN).sum(), 1))
        yield (
            problem.dim, model.material.nu, mu, steps, len(problem.points.nodes), name,  # type: ignore[attr-defined]
            sum(f.outcome.ok for f in frames), sum(len(f.parts) for f in frames),
            max((f.residual for f in frames), default=np.inf),
            max((v for _, v in here), default=np.inf), float(np.median(counts)), max(counts),
            sum(f.method != "newton" for f in frames), sum(f.method == "cut back" for f in frames),
            slipping,
            *(sum(o is kind for o in theirs) for kind in (Outcome.CONVERGED, Outcome.WRONG_WAY, Outcome.CYCLED)),
            counts,
        )  # fmt: skip


def _literal(problem: Problem) -> list[Outcome]:
    """What the paper's rule made of the increments up to its first cycle."""
    found = []
    for frame in march(problem):
        found.append(frame.outcome)
        if frame.outcome is Outcome.CYCLED:
            break
    return found


def run(quick: bool) -> Result:
    """The two grids, and every case of `_hard.py`."""
    table: list[tuple[Any, ...]] = []
    for dim, nus, mus, counts, sizes in grids(quick):
        for nu, size in product(nus, sizes):
            problem = finger(dim, nu, size)
            for mu, steps in product(mus, counts):
                table += case(problem, mu, steps)
    *listed, counts = zip(*table, strict=True)
    columns = dict(zip(COLUMNS, map(list, listed), strict=True))
    rows = [row for dim in (2, 3) for row in _grid_rows(dim, columns, counts)]
    counts = Settled(sum(columns["settled"]), sum(columns["increments"]), max(columns["residual"]))
    return Result((*rows, *_hard.rows(quick)), columns, lambda figure: _draw(figure, columns), counts)


def _grid_rows(dim: int, columns: dict[str, list[Any]], counts: tuple[list[float], ...]) -> list[Row]:
    which = np.array(columns["dim"]) == dim
    t = {k: np.array(v)[which] for k, v in columns.items()}
    iterations = np.concatenate([c for c, of in zip(counts, which, strict=True) if of])
    histories = int((t["leg"] == "press").sum())
    total, settled = int(t["increments"].sum()), int(t["settled"].sum())
    here = f"{dim}D grid, {total} increments with {int(t['parts'].sum())} parts in {histories} histories"
    slid = t["slipping"][(t["leg"] == "slide") & (t["mu"] <= 0.25)]
    literal, cycled = (float(t[k].sum()) for k in ("paper_settled", "paper_cycled"))

    def bound(what: str, most: float, got: float, reference: str = ROBUST) -> Row:
        return at_most(f"{here}: {what}", reference, most, float(got))

    return [
        zero(f"{here}: unsettled", ROBUST, total - settled, 0, "none"),
        bound("largest residual", 1e-8, t["residual"].max(), CRITERION),
        bound("largest violation, computed apart", 1e-8, t["violation"].max(), CRITERION),
        bound("median iterations a part", 10, float(np.median(iterations)), "goal of this project"),
        Row(f"{here}: mu <= .25, least share that slips after the slide", ROBUST, 1, slid.min(), 0, "full slip"),
        at_most(f"{here}: settled by the paper's rule", "settled by finger3d", settled, literal, kind="sensitivity"),
        at_least(f"{here}: histories that the paper's rule ends in a cycle", ROBUST, 1, cycled, "states repeat",
            "sensitivity"),
    ]  # fmt: skip


def _draw(figure: Any, columns: dict[str, list[Any]]) -> None:
    panels = dict(zip(("median", "max"), figure.subplots(1, 2), strict=True))
    for dim, mark in ((2, "o"), (3, "s")):
        legs = dict(sorted(grouped(columns, "mu", dim=dim), key=itemgetter(0)))
        names = [f"{mu:g}" for mu in legs]
        for key, axes in panels.items():
            for quantile, style, name in ((0.5, "-", "median"), (1.0, "--", "largest")):
                values = [np.quantile(part[f"iterations_{key}"], quantile) for part in legs.values()]
                axes.plot(names, values, mark + style, label=f"{dim}D, {name} of the legs")
    panels["median"].axhline(10, color="k", lw=0.8, ls=":")
    for axes, what in zip(panels.values(), ("median", "largest"), strict=True):
        axes.set(xlabel="mu", ylabel=f"{what} iterations per part", yscale="symlog", ylim=(-0.2, 500.0))
