"""Does the base push back as hard as the object pushes, and is all the work stored or lost?

Source: the balances of validation/REFERENCES.md, 7.1, on the paper's Fig. 9 finger, solved whole, pressed 10 mm with mu
= 0.25 and then slid 15 mm.  Contact forces and the reactions of the base, taken from K u, balance in force and in
moment; friction dissipates at every point in every increment; a mirror-symmetric press has no net friction; and the
work of the object equals the stored energy, u K u / 2, plus the dissipation.

Theory of the rates: the work of the contact forces on a linear body is integrated exactly, so without friction the
balance holds to round-off in any number of increments.  Dissipation is slip times the friction under the mean normal
force of the increment; where friction turns during an increment it leaves an error of the second order in the step.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg

from ._common import convergence, rate
from ._press import changed, fig9_model
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)
SIZES = {"plane-strain": 2.0, "solid": 8.0}


def finger(domain: Any, nu: float) -> Problem:
    """The whole finger, ready for any path that presses 10 mm at first."""
    return build(fig9_model(nu, SIZES[domain], 2.0 * SIZES[domain], domain, symmetry=()))


def along(problem: Problem, steps: int, mu: float, slide: float) -> list[StepResult]:
    """Frames of a press, and a slide if there is one, of `steps` increments each."""
    legs = (Leg(10.0, steps=steps),) + ((Leg(10.0, slide_x_mm=slide, steps=steps),) if slide else ())
    return list(march(changed(problem, legs=legs, friction=Coulomb(mu))))


@dataclass(frozen=True)
class Balance:
    """Relative imbalances of a frame: of force, of moment about the origin, and of work."""

    force: float
    moment: float
    work: float


def balance(problem: Problem, frame: StepResult) -> Balance:
    """Compare contact forces with K u, and work with what is stored and lost."""
    upper, n, d = problem.body.stiffness.upper, problem.mesh.points.size, problem.dim
    unknowns = problem.unknowns(frame.meshed_state.contact.force)
    inner = (upper + sparse.triu(upper, 1).T) @ unknowns
    nodal = inner[:n].reshape(-1, d)
    base = np.unique(problem.mesh.facets["base"])
    reaction, arm = np.zeros((len(base), 3)), np.zeros((len(base), 3))
    reaction[:, :d], arm[:, :d] = nodal[base], problem.mesh.points[base]
    push = problem.points.to_global(frame.state.force)
    # a contact force acts where its hat's mean is, which for a moment is the hat's mean place
    place = np.zeros_like(push)
    place[:, :d] = (problem.surface.trace @ problem.mesh.points)[problem.symmetry.image_of]  # no symmetry here: no sign
    scale = np.linalg.norm(push.sum(axis=0))
    turning = np.cross(arm, reaction).sum(axis=0) + np.cross(place, push).sum(axis=0)
    stored = 0.5 * float(unknowns @ inner)
    return Balance(
        float(np.linalg.norm(reaction.sum(axis=0) + push.sum(axis=0)) / scale),
        float(np.linalg.norm(turning) / (scale * problem.model.design.half_length_mm)),
        (frame.external_work_mJ - stored - frame.dissipation_mJ) / frame.external_work_mJ,
    )


def least_loss(frames: list[StepResult]) -> float:
    """Smallest energy lost by friction at any point in any increment, over the largest."""
    states = [frame.meshed_state.contact for frame in frames]
    slips = [end.accumulated_slip - start.accumulated_slip for start, end in itertools.pairwise(states)]
    lost = [-np.sum(end.force[:, 1:] * slip, axis=1) for end, slip in zip(states[1:], slips, strict=True)]
    return float(np.min(lost) / np.max(lost))


def run(quick: bool) -> Result:
    """Section and solid, compressible and not; ever more increments."""
    rows, table = [], []
    curves: dict[str, tuple[Float, Float]] = {}
    for domain in ("plane-strain", "solid"):
        worst = dict.fromkeys(("force", "moment", "loss", "net"), 0.0)
        for nu in (0.3, 0.5) if quick else (0.3, 0.49, 0.5):
            problem = finger(domain, nu)
            frames = along(problem, 5, 0.25, 15.0)
            found = [balance(problem, frame) for frame in frames]
            pressed = frames[4].state.force
            net = np.linalg.norm(problem.points.friction(pressed).sum(axis=0)) / pressed[:, 0].sum()
            here = max(b.force for b in found), max(b.moment for b in found), -least_loss(frames), float(net)
            worst = {k: max(v, new) for (k, v), new in zip(worst.items(), here, strict=True)}
        name = domain.replace("-", " ")
        for key, what in (
            ("force", "forces of contact and base together, over the force"),
            ("moment", "moments of contact and base together, over force times half length"),
            ("loss", "energy that friction gives back at a point in an increment, over the most it takes"),
            ("net", "net friction of the press before the slide, over its force"),
        ):
            rows.append(judged("imbalance", worst[key], what=what, name=name))
        rows += _energy(problem, f"{name}, nu = {nu:g}", curves, table)
    names = "case mu increments_per_leg work_less_stored_and_lost"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, curves))


def _energy(problem: Problem, name: str, curves: Any, table: list[tuple[Any, ...]]) -> Iterator[Row]:
    """Rows of the work's balance, with friction also of its rate."""
    for mu, counts, slide in ((0.25, (20, 40, 80), 15.0), (0.0, (5, 10, 20, 40), 0.0)):
        found = [balance(problem, along(problem, n, mu, slide)[-1]).work for n in counts]
        steps = 1.0 / np.array(counts)
        table += [(name, mu, n, e) for n, e in zip(counts, found, strict=True)]
        kind = f"{name}, mu = {mu:g}"
        if mu == 0.0:
            yield judged("work-without-friction", np.abs(found).max(), kind=kind, few=counts[0], many=counts[-1])
            continue
        yield judged("work-over-stored-and-lost", 1.0 / (1.0 - found[-1]), kind=kind, many=counts[-1])
        curves[kind] = steps, np.abs(found)
        yield judged("rate-of-the-balance", rate(steps[-3:], found[-3:]), kind=kind)


def draw(figure: Any, curves: dict[str, tuple[Float, Float]]) -> None:
    """Draw the work that is neither stored nor dissipated against the size of the increments."""
    labels = "1 / increments of a leg", "work not stored or dissipated, over the work"
    convergence(figure.subplots(), next(iter(curves.values()))[0], {k: e for k, (_, e) in curves.items()}, 2.0, *labels)
