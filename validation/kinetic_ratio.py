"""With mu_k below mu_s, does a press have one answer?

Source: validation/REFERENCES.md, 2.5; Maeno 2004, Sec. II-A and Fig. 8.  A cylinder on a half-plane, nu = 0.3,
mu_s = 0.25.  Two rules for a point that slipped in the previous increment are compared.

keep: the point keeps slipping at mu_k until its slip would reverse (the default of effects.kinetic_friction).  In a
press every point outside the stick zone slips from its first touch on, so the solution is that with mu_k alone, in
the same plain increments, since a law with two coefficients speaks of increments.

paper: every increment starts with all points sticking, so the point may carry mu_s again.  The result is expected to
depend on the mesh and on the increments; the table shows how much.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import FrictionLaw, TwoCoefficients
from finger3d.mechanics.discretise.problem import Problem

from . import _halfplane
from ._common import ticks_at
from ._halfplane import line, loading, under
from ._increments import PlainCoulomb
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)

NU, STATIC = 0.3, 0.25
COLUMNS = "branch ratio points_per_a increments q_over_P D_over_AP2 c_over_a iterations"
STICK, OUTWARD = "half width of stick / of contact", "friction on one half / normal force"
Key = tuple[str, float, int, int]


def numbers(problem: Problem, law: FrictionLaw, count: int) -> np.ndarray:
    """int q/P and c/a as means over the second half of the increments, D/(A P^2), and the most iterations."""
    found = under(problem, law, loading(count))
    _, share, stuck, lost = _halfplane.numbers(found, _halfplane.compliance(NU))
    return np.array([share, lost, stuck, max(p.frame.iterations for p in found)])


def run(quick: bool) -> Result:
    """Ratios .9, .7, .4 under both rules and one coefficient mu_k; 10, 20, 40 points to a; 10, 50, 200 increments."""
    meshes, counts, ratios = ((10, 20), (10, 50), (0.7,)) if quick else ((10, 20, 40), (10, 50, 200), (0.9, 0.7, 0.4))
    found: dict[Key, np.ndarray] = {}
    for points in meshes:
        problem = line(NU, points, loading(1))
        for ratio in ratios:
            laws = {
                "keep": TwoCoefficients(STATIC, ratio, "keep"),
                "paper": TwoCoefficients(STATIC, ratio, "paper"),
                "one coefficient": PlainCoulomb(ratio * STATIC),
            }
            for branch, law in laws.items():
                for count in counts:
                    found[branch, ratio, points, count] = numbers(problem, law, count)
    rows = _rows(found, meshes, counts, ratios)
    table = [(*k, *v) for k, v in found.items()]
    return Result(tuple(rows), exact_columns(COLUMNS, table), lambda figure: _draw(figure, found, meshes, counts))


def _rows(found: dict[Key, np.ndarray], meshes: Any, counts: Any, ratios: Any) -> Iterator[Row]:
    fine, many = meshes[-1], counts[-1]
    got = found["keep", 0.7, fine, many]
    here = f"{fine} points to a, {many} increments"
    yield judged("keep-q-over-p", got[0], here=here)
    yield judged("keep-c-over-a", got[2], tolerance=0.5 / fine, here=here, fine=fine)
    for ratio in ratios:
        one, two = found["one coefficient", ratio, fine, many], found["keep", ratio, fine, many]
        yield judged("keep-q-over-that-of-one-coefficient", two[0] / one[0], ratio=ratio)
        yield judged("keep-dissipation-over-that-of-one-coefficient", two[1] / one[1], ratio=ratio)
    literal = found["paper", 0.7, fine, many]
    yield judged("paper-distance-of-c-over-a", abs(literal[2] - 0.263), here=here)
    values = [found["paper", 0.7, fine, n][2] for n in counts]
    yield judged("paper-change-of-c-over-a", np.ptp(values), few=counts[0], many=many, fine=fine)
    yield judged("paper-q-over-p", literal[0] / 0.0773, here=here)


def _draw(figure: Any, found: dict[Key, np.ndarray], meshes: Any, counts: Any) -> None:
    axes = figure.subplots(1, 2)
    for (k, label, exact), ax in zip(((2, STICK, 0.263), (0, OUTWARD, 0.0773)), axes, strict=True):
        for branch, rule, colour in (("keep", "keeps slipping", "C0"), ("paper", "the paper's rule", "C1")):
            for points, mark in zip(meshes, "o^s", strict=False):
                values = [found[branch, 0.7, points, n][k] for n in counts]
                ax.semilogx(counts, values, colour + mark + "-", mfc="w", label=f"{rule}, {points} points")
        ax.axhline(exact, color="k", ls="--", lw=1, label="exact, kinetic friction alone")
        ticks_at(ax, counts)
        ax.set(xlabel="increments", ylabel=label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle("kinetic friction 0.7 times the static one; points to the half width of contact")
