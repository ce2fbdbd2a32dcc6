"""Is the contact state of an increment unique, or do other starts of the iteration lead to other solutions?

Source: Maeno 2004, Sec. II-A: "we have confirmed that the unique and accurate time-dependent contact condition can be
obtained using this method".  Coulomb's law admits several solutions where friction is large; finger3d warns by a bound
of every single point (REFERENCES.md, 8.1), which says nothing of many points together.  Every increment of a press, a
slide and a release is solved again from random forces: random points touch, with random pressures, and stick or slip
either way.  A state that satisfies the contact conditions and differs from the one of the path counts.  The search has
to find the two states of the problem of one point, and says how often.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.contact.conditions import ContactProblem
from finger3d.contact.friction import Coulomb
from finger3d.contact.solve import solve_increment
from finger3d.contact.state import ContactState
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import Press
from finger3d.mechanics.model import Leg
from finger3d.mechanics.path import stations
from finger3d.objects import ObjectPose

from ._increments import PlainCoulomb
from ._paper import STRAIN, STRESS, fig9, said
from ._press import changed
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

WIDE = "20 mm wide"
MODELS = ((STRESS, 0.3), (STRAIN, 0.3), (STRAIN, 0.49), (WIDE, 0.3), (WIDE, 0.49))
MUS = (0.25, 1.0, 2.0, 5.0, 20.0)
PATHS = {
    "one increment each": (Leg(10.0, steps=1), Leg(10.0, 5.0, steps=1), Leg(4.0, 5.0, steps=1)),
    "five increments each": (Leg(10.0, steps=5), Leg(10.0, 5.0, steps=5), Leg(4.0, 5.0, steps=5)),
}
STARTS = {STRESS: 20, STRAIN: 20, WIDE: 6}
DIFFERENT = 1e-6
"""Largest difference of a force over the largest force, from which a state is another one."""


class Searched(NamedTuple):
    """Outcome of the search in one case.

    Attributes
    ----------
    limit : bound of the single points; above 1 a point may have two states
    solved, others, unsettled : starts that end in the state of the path, in another one, and in none
    apart : largest difference of a state from that of the path
    """

    model: str
    nu: float
    mu: float
    path: str
    limit: float
    solved: int = 0
    others: int = 0
    unsettled: int = 0
    apart: float = 0.0


def run(quick: bool) -> Result:
    """Quick: two sections on a coarse mesh, few starts."""
    random = np.random.default_rng(20261125)
    found = []
    for model, nu in MODELS[:3:2] if quick else MODELS:
        size = 8.0 if quick else 6.0 if model == WIDE else 2.0
        problem = fig9(nu, "solid" if model == WIDE else model, size)
        for mu in MUS[1:4:2] if quick else MUS:
            for path, legs in PATHS.items():
                case = changed(problem, friction=PlainCoulomb(mu), legs=legs)
                start = Searched(model, nu, mu, path, case.coupling())
                found.append(_search(case, start, 5 if quick else STARTS[model], random))
    rows = [*_rows(found), *_one_point(random, 10 if quick else 100)]
    names = "model nu mu path limit_of_points starts_to_the_same starts_to_others unsettled largest_difference"
    return Result(tuple(rows), columns(names, found), lambda figure: _draw(figure, found))


class PressFromForces(Press):
    """A press whose increments begin their iteration at forces (c, d) N that are given, if any are."""

    start: Float | None = None

    def expected_force(self, pose: ObjectPose) -> Float | None:
        return super().expected_force(pose) if self.start is None else self.start


def _search(problem: Problem, found: Searched, starts: int, random: np.random.Generator) -> Searched:
    """Solve every increment from the path, and from random forces."""
    press = PressFromForces(problem)
    for station in stations(problem.model.legs):
        before = copy(press)
        frame = press.advance(station)
        if press.has_failed:
            return found._replace(unsettled=found.unsettled + starts)
        force = frame.meshed_state.contact.force
        scale = np.abs(force).max()
        for _ in range(starts if scale else 0):
            again = copy(before)
            again.start = _start(force, problem.model.friction.mu, random)
            other = again.advance(station)
            if not other.outcome.ok:
                found = found._replace(unsettled=found.unsettled + 1)
                continue
            apart = float(np.abs(other.meshed_state.contact.force - force).max() / scale)
            same = apart <= DIFFERENT
            found = found._replace(solved=found.solved + same, others=found.others + (not same),
                            apart=max(found.apart, apart))  # fmt: skip
    return found


def _start(force: Float, mu: float, random: np.random.Generator) -> Float:
    """Forces of random points that touch; of these a third sticks, the others slip in random directions."""
    touching = random.random(len(force)) < random.uniform(0.05, 1.0)
    normal = np.where(touching, random.lognormal(0.0, 1.0, len(force)) * force[:, 0].mean(), 0.0)
    tangents = random.normal(size=(len(force), force.shape[1] - 1))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    share = np.where(random.random(len(force)) < 1.0 / 3.0, random.random(len(force)), 1.0)
    return np.column_stack([normal, (share * min(mu, 10.0) * normal)[:, None] * tangents])


def _rows(found: Sequence[Searched]) -> Iterator[Row]:
    """The paper's statement for its own range of mu, and what the search found beyond."""
    for model in dict.fromkeys(s.model for s in found):
        own = [s for s in found if s.model == model]
        for text, some in (("up to 1", [s for s in own if s.mu <= 1.0]), ("above 1", [s for s in own if s.mu > 1.0])):
            tried = sum(s.solved + s.others + s.unsettled for s in some)
            yield said("unique", sum(s.others for s in some), tried=tried, range=text, model=model)
            yield judged("no-solution", sum(s.unsettled for s in some), tried=tried, range=text, model=model)


def _one_point(random: np.random.Generator, loads: int) -> list[Row]:
    """Loads that nearly close a gap of one point, K = [[1, .8], [.8, 2]] (t, n): several solutions above mu = 1.25."""
    compliance = np.linalg.inv(np.array([[2.0, 0.8], [0.8, 1.0]])).reshape(1, 2, 1, 2)
    found = []
    for mu in (1.2, 2.0):
        several = 0
        for gap, slip in random.uniform((0.005, 0.3), (0.03, 0.5), size=(loads, 2)):
            free = np.array([[gap, -slip]])
            at_rest = ContactState.at_rest(np.zeros(1), 2)
            problem = ContactProblem.of(at_rest, free, compliance, Coulomb(mu), 1.0)
            guesses = random.normal(size=(20, 1, 2)) * 3.0
            ends = [solve_increment(problem, np.abs(guess) * [1.0, np.sign(guess[0, 1])]) for guess in guesses]
            forces = np.array([end.state.force[0] for end in ends if end.outcome.ok])
            several += bool(len(forces) and np.ptp(forces, axis=0).max() > DIFFERENT)
        found.append(several)
    return [
        judged("one-point-below-the-limit", found[0], loads=loads),
        judged("one-point-above-the-limit", found[1], loads=loads),
    ]


def _draw(figure: Any, found: Sequence[Searched]) -> None:
    left, right = figure.subplots(1, 2)
    for i, (model, nu) in enumerate(dict.fromkeys((s.model, s.nu) for s in found)):
        for path, style in zip(PATHS, ("o-", "s--"), strict=True):
            own = [s for s in found if (s.model, s.nu, s.path) == (model, nu, path)]
            tried = [s.solved + s.others + s.unsettled for s in own]
            shares = [100.0 * s.others / max(n, 1) for s, n in zip(own, tried, strict=True)]
            left.plot([s.mu for s in own], shares, style, ms=4, color=f"C{i}", label=f"{model}, nu = {nu:g}, {path}")
            right.loglog([s.mu for s in own], [s.apart or np.nan for s in own], style, ms=4, color=f"C{i}")
    left.set(xscale="log", xlabel="mu", ylabel="starts that end elsewhere (%)")
    right.axhline(DIFFERENT, color="#222222", lw=0.8)
    right.set(xlabel="mu", ylabel="difference of a force over the largest, if any")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
