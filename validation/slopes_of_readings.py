"""Does the slope of a gauge's strain against friction follow the mesh, and what makes it smooth?

The calibrated strain of a gauge tells mu by its slope.  The finger of Fig. 9 (nu = 0.49) is pressed 10 mm onto a plane
in equal increments, the same number on every mesh, at mu = 0.05, 0.15 to 1.05; its gauge lies 3 mm below the contact
face and 4 mm beside the edge of the contact.  The slope at mu = 0.1, 0.2 to 1 is the difference over 0.1.  Two meshes,
one twice as fine as the other, shall agree within 5 % of the largest slope, as a section in plane strain and as a solid
20 mm wide; both are meshed as `size_mm` says, and refined around the gauge by ``mesh.gauge_refinement``.

Where the strain is read, a cell is as large as its distance from the edge of the contact: that is most of the
difference.  The rest is the edge of the contact, which lies between two points.  The wide finger's strain rises by less
than a tenth of what it falls by in the section: its normal and its tangential tractions nearly cancel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.analyses.study_rows import Result, Row
from finger3d.contact.friction import Coulomb
from finger3d.fem.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.build import build
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.solve import march

from ._paper import columns

Float = NDArray[np.float64]

NAMES: dict[Domain, str] = {"plane-strain": "section", "solid": "20 mm wide"}
PLAIN, REFINED = 1.0, 2.0
SIZES: dict[tuple[Domain, float], tuple[float, ...]] = {
    ("plane-strain", PLAIN): (4.0, 2.0, 1.0, 0.5, 0.25),
    ("plane-strain", REFINED): (4.0, 2.0, 1.0, 0.5, 0.25),
    ("solid", PLAIN): (4.0, 2.8, 2.0, 1.4, 1.0),
    ("solid", REFINED): (4.0, 2.8, 2.0, 1.4, 1.0, 0.7),
}
QUICK: dict[tuple[Domain, float], tuple[float, ...]] = {
    ("plane-strain", PLAIN): (1.0, 0.5),
    ("plane-strain", REFINED): (1.0, 0.5),
}
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

    def error(self, finer: Curve) -> Float:
        """Return the error (10,) of the slope by a finer mesh, over the largest slope there."""
        return np.asarray(np.abs(self.slope - finer.slope) / np.abs(finer.slope).max())


Key = tuple[Domain, float, float]


def curve(domain: Domain, refinement: float, size: float, steps: int) -> Curve:
    """Return the strain of the gauge over mu on a structured mesh."""
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    mesh = MeshOptions(size, 4.0 * size, "swept", gauge_refinement=refinement)
    gauge = Gauge("g", 36.0, 40.0, angle=math.radians(30.0))
    model = Model(design, Isotropic(1.0, 0.49), mesh, (Leg(10.0, steps=steps),), gauges=(gauge,), domain=domain)
    problem = build(model)
    strain = []
    near: Sequence[Float] = ()
    for mu in ENDS:
        frames = list(march(replace(problem, model=replace(model, friction=Coulomb(float(mu)))), near))
        strain.append(frames[-1].gauges["g"] if frames[-1].outcome.ok else math.nan)
        near = [frame.part.force for frame in frames]
    return Curve(np.array(strain), problem.part.stiffness.upper.shape[0], len(problem.surface.nodes))


def run(quick: bool) -> Result:
    """Quick: the section on two meshes, in ten increments."""
    steps = QUICK_STEPS if quick else STEPS
    found: dict[Key, Curve] = {
        (domain, refinement, size): curve(domain, refinement, size, steps)
        for (domain, refinement), sizes in (QUICK if quick else SIZES).items()
        for size in sizes
    }
    lines = [
        (domain, refinement, size, c.dofs, c.points, mu, slope)
        for (domain, refinement, size), c in found.items()
        for mu, slope in zip(MUS, c.slope, strict=True)
    ]
    names = "domain gauge_refinement size_mm dofs contact_points mu strain_per_mu"
    return Result(tuple(_rows(found)), columns(names, lines), lambda figure: _draw(figure, found))


def _rows(found: dict[Key, Curve]) -> list[Row]:
    rows = []
    errors = {
        key: c.error(found[key[0], key[1], key[2] / 2.0])
        for key, c in found.items()
        if (key[0], key[1], key[2] / 2.0) in found
    }
    for (domain, refinement, size), error in errors.items():
        here = f"{NAMES[domain]}, {size:g} mm, gauge_refinement = {refinement:g}"
        rows.append(
            Row(
                f"largest error of d strain / d mu, mu = .1 to 1, over the largest slope, {here}", "half the edges",
                ALLOWED, float(error.max()), 0.0, "the goal", "statement", "at most",
            )
        )  # fmt: skip
    for (domain, refinement, size), error in errors.items():
        if refinement == REFINED and (domain, PLAIN, size) in errors:
            ratio = float(error.max() / errors[domain, PLAIN, size].max())
            what = f"that error with gauge_refinement = {REFINED:g}, over that without, {NAMES[domain]}, {size:g} mm"
            reason = "a refinement that did not halve it would not be worth its cells"
            rows.append(Row(what, "no reference", 0.5, ratio, 0.0, reason, "statement", "at most"))
    return rows + _section(found)


def _section(found: dict[Key, Curve]) -> list[Row]:
    """The section, judged: its meshes can be made so fine that the finest one is known to be better than the others."""
    finest = found[min((k for k in found if k[:2] == ("plane-strain", REFINED)), key=lambda k: k[2])]
    error = {r: float(found["plane-strain", r, 1.0].error(finest).max()) for r in (PLAIN, REFINED)}
    what = "largest error of d strain / d mu by the finest refined mesh, over the largest slope, section, 1 mm"
    return [
        Row(
            f"{what}, gauge_refinement = 2", "finest mesh", ALLOWED, error[REFINED], 0.0, "the goal", "sensitivity",
            "at most",
        ),
        Row(
            f"{what}, gauge_refinement = 2 over 1", "no refinement", 0.5, error[REFINED] / error[PLAIN], 0.0,
            "edges half as long at the gauge leave a quarter of its error", "sensitivity", "at most",
        ),
    ]  # fmt: skip


def _draw(figure: Any, found: dict[Key, Curve]) -> None:
    cases = list(dict.fromkeys(key[:2] for key in found))
    figure.set_size_inches(11.0, 4.2 * (len(cases) // 2))
    figure.set_layout_engine("constrained")
    panels = np.atleast_2d(figure.subplots(len(cases) // 2, 2, sharex=True, sharey="row"))
    shades = dict(zip((4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5, 0.25),
                      ("#fdbe85", "#fd8d3c", "#d94701", "#9ecae1", "#4292c6", "#08519c", "#08519c", "#222222"),
                      strict=True))  # fmt: skip
    for (domain, refinement), axes in zip(cases, panels.ravel(), strict=True):
        for (_, _, size), c in ((k, c) for k, c in found.items() if k[:2] == (domain, refinement)):
            axes.plot(
                MUS, 1e3 * c.slope, "o-", ms=3, lw=1.5, color=shades[size], label=f"{size:g} mm, {c.points} points"
            )
        kind = "no refinement" if refinement == PLAIN else f"gauge_refinement = {refinement:g}"
        axes.set_title(f"{NAMES[domain]}: {kind}", fontsize=10)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, frameon=False)
    for axes in panels[:, 0]:
        axes.set_ylabel("d strain / d mu, 1e-3")
    for axes in panels[-1]:
        axes.set_xlabel("friction coefficient mu")
