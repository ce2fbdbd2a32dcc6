"""Does the slope of a gauge's strain against friction follow the mesh, and what makes it smooth?

The calibrated strain of a gauge tells mu by its slope.  The finger of Fig. 9 (nu = 0.49) is pressed 10 mm onto a plane
in equal increments, the same number on every mesh, at mu = 0.05, 0.15 to 1.05; its gauge lies 3 mm below the contact
face and 4 mm beside the edge of the contact.  The slope at mu = 0.1, 0.2 to 1 is the difference over 0.1.  Two meshes,
one twice as fine as the other, shall agree within 5 % of the largest slope: of a section in plane strain, and of a
solid 20 mm wide with structured and with unstructured meshes.  They are meshed as `size_mm` says, with edges four times
as long at the base, and refined around the gauge by ``mesh.gauge_refinement``.

Without refinement a cell at the gauge, and an edge of the contact face above it, is as long as the distance of the
gauge from the edge of the contact: that is most of the difference.  The rest is contact far from the gauge: its edge,
and that of the stick zone, lie between two points.  It counts in the wide finger, whose strain moves with mu by a tenth
of what it does in the section, since the effects of normal and tangential tractions nearly cancel.  There the edges at
the base count as well, so that the refined solid is also meshed with edges twice as long at the base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.pressed_body import presses
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg, MeshOptions, Model

from ._press import PAPER_GAUGE, fig9_finger
from ._rows import Result, Row, columns, given, listed

judged = listed(__file__)

SECTION, SWEPT, WILD = "section", "20 mm wide, swept", "20 mm wide, fTetWild"
EVEN = "20 mm wide, swept, base edges twice as long"
CASES = {case["name"]: case for case in given(__file__)["case"]}
"""Domain, mesher, edge lengths at the contact, mm, and those at the base over these."""
PLAIN, REFINED = 1.0, 2.0
QUICK = {SECTION: (1.0, 0.5)}
ENDS = np.linspace(0.05, 1.05, 11)
MUS = 0.5 * (ENDS[1:] + ENDS[:-1])
STEPS, QUICK_STEPS = 40, 10
ALLOWED = 0.05


@dataclass(frozen=True)
class Curve:
    """Strain (11,) at `ENDS` on a mesh, and its numbers of unknowns and contact points."""

    strain: Float
    dofs: int
    points: int

    @property
    def slope(self) -> Float:
        """Slope (10,) of the strain at `MUS`."""
        return np.asarray(np.diff(self.strain) / np.diff(ENDS))

    def error(self, finer: Curve) -> float:
        """Return the largest error of the slope by a finer mesh, over the largest slope there."""
        return float(np.abs(self.slope - finer.slope).max() / np.abs(finer.slope).max())


Curves = dict[tuple[str, float, float], Curve]


def curve(case: str, refinement: float, size: float, steps: int) -> Curve:
    """Return the strain of the gauge over mu on a mesh."""
    domain, mesher, growth = (CASES[case][key] for key in ("domain", "mesher", "growth"))
    mesh = MeshOptions(size, growth * size, mesher, gauge_refinement=refinement)
    legs, gauges = (Leg(10.0, steps=steps),), (PAPER_GAUGE,)
    model = Model(fig9_finger(), Isotropic(1.0, 0.49), mesh, legs, gauges=gauges, domain=domain)
    problem = build(model)
    ends = [press.frame for press in presses(problem, ENDS.tolist())]
    strain = [end.gauges["g"] if end.outcome.ok else math.nan for end in ends]
    return Curve(np.array(strain), problem.body.stiffness.upper.shape[0], len(problem.surface.nodes))


def run(quick: bool) -> Result:
    """Quick: the section on two meshes, in ten increments."""
    steps = QUICK_STEPS if quick else STEPS
    wanted = QUICK if quick else {name: case["sizes_mm"] for name, case in CASES.items()}
    found: Curves = {
        (case, refinement, size): curve(case, refinement, size, steps)
        for case, sizes in wanted.items()
        for refinement in ((REFINED,) if case == EVEN else (PLAIN, REFINED))
        for size in sizes
    }
    lines = [
        (case, refinement, size, c.dofs, c.points, float(mu), float(slope))
        for (case, refinement, size), c in found.items()
        for mu, slope in zip(MUS, c.slope, strict=True)
    ]
    names = "case gauge_refinement size_mm dofs contact_points mu strain_per_mu"
    rows = (*_against_finer(found), *_between_meshers(found), *_section(found))
    return Result(rows, columns(names, lines), lambda figure: _draw(figure, found))


def _against_finer(found: Curves) -> list[Row]:
    """The goal, mesh by mesh, and what the refinement leaves of the error."""
    error = {key: c.error(found[half]) for key, c in found.items() if (half := (*key[:2], key[2] / 2.0)) in found}
    what = "largest error of d strain / d mu, mu = .1 to 1, over the largest slope"
    goal = [
        judged("mm-gauge-refinement", value, ALLOWED, what=what, case=case, size=size, refinement=refinement)
        for (case, refinement, size), value in error.items()
    ]
    left = [
        judged("that-error", value / error[case, PLAIN, size], case=case, size=size)
        for (case, refinement, size), value in error.items()
        if refinement == REFINED and case != EVEN
    ]
    return goal + left


def _between_meshers(found: Curves) -> list[Row]:
    """Two unrelated meshes of the solid with edges of 1.4 mm."""
    which = "between swept and fTetWild, over the largest slope, 20 mm wide, 1.4 mm"
    what = f"largest difference of d strain / d mu {which}"
    both = (SWEPT, WILD)
    pairs = {r: [found[case, r, 1.4] for case in both] for r in (PLAIN, REFINED) if (WILD, r, 1.4) in found}
    return [
        judged("gauge-refinement", one.error(other), 2.0 * ALLOWED, what=what, refinement=refinement)
        for refinement, (one, other) in pairs.items()
    ]


def _section(found: Curves) -> list[Row]:
    """The section, judged: its meshes can be made so fine that the finest one is known to be better than the others."""
    finest = found[min((key for key in found if key[:2] == (SECTION, REFINED)), key=lambda key: key[2])]
    error = {refinement: found[SECTION, refinement, 1.0].error(finest) for refinement in (PLAIN, REFINED)}
    what = "largest error of d strain / d mu by the finest refined mesh, over the largest slope, section, 1 mm"
    return [
        judged("section-refined", error[REFINED], ALLOWED, what=what),
        judged("gauge-refinement-2-over-1", error[REFINED] / error[PLAIN], what=what),
    ]


def _draw(figure: Any, found: Curves) -> None:
    cases = list(dict.fromkeys(key[0] for key in found))
    figure.set_size_inches(11.0, 3.6 * len(cases))
    panels = figure.subplots(len(cases), 2, sharex=True, sharey="row", squeeze=False)
    for case, row in zip(cases, panels, strict=True):
        row[0].set_ylabel("d strain / d mu, 1e-3")
        for refinement, axes in zip((PLAIN, REFINED), row, strict=True):
            for (_, _, size), c in ((k, c) for k, c in found.items() if k[:2] == (case, refinement)):
                label = f"{size:g} mm: {c.dofs} unknowns, {c.points} points"
                axes.plot(MUS, 1e3 * c.slope, "o-", ms=3, lw=1.5, label=label)
            axes.set_visible(bool(axes.lines))
            axes.tick_params(labelleft=axes is row[0] or not row[0].lines)
            kind = "no refinement" if refinement == PLAIN else "refined at the gauge"
            axes.set_title(f"{case}: {kind}", fontsize=9)
    for axes in panels[-1]:
        axes.set_xlabel("friction coefficient mu")
