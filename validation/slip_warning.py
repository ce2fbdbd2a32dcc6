"""How early do stick ratio and slip margin warn of slip, beside the one bit that tactile data sets have?

That bit is the friction cone: the tangential load on the finger over mu times the normal load, of a force sensor, as
in the labels of TacBench (Higuera et al. 2024; validation/REFERENCES.md, 3.6).  A ball and a fingertip are pressed to a
force, which is then held, and slide until well after gross slip.  The ball presses a gel pad as camera-based sensors
have it, 4 mm thick, E = .1 MPa, nu = .49, mu = .5; the finger is that of geometries/fingertip.toml under a plane.
Every number that falls is taken where it falls through its level for the last time, over the slide of gross slip; a
press with friction may slip at the rim before the object slides.

Whether a warning comes before the cone's bit is a statement.  Which threshold data sets use is not published with them;
2 % is taken here, about what a force sensor can tell.  The load is all of the tangential force: under a ball that has
sunk in, pressure ahead of it pushes as well, so that the ratio passes mu before the contact slips.

Mindlin's relation c/a = (1 - Q/(mu P))^(1/3) says that stick ratio by area is margin^(2/3), for a ball on a half-space
without friction while it is pressed; on a pad that is thin beside the contact it is not so.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.press import press

from ._press import block_tables
from ._rows import Result, Row, Settled, columns, listed, settled

judged = listed(__file__)

MU = 0.5
THRESHOLD = 0.02
"""Share of the friction cone that is left where its bit says slip."""
PRESS = 4
"""Increments of a press before a slide."""
FINGERTIP = Path(__file__).resolve().parents[1] / "geometries" / "fingertip.toml"
LEVELS = (("stick_ratio_area", 0.5), ("slip_margin", 0.5), ("slip_margin", 0.1))
NAMES = {
    "stick_ratio_area": "stick ratio by area",
    "stick_ratio_force": "stick ratio by force",
    "slip_margin": "slip margin",
    "cone": "friction cone, 1 - |F_t|/(mu F_n)",
}


@dataclass(frozen=True)
class Slide:
    """A slide after a press.

    Attributes
    ----------
    slide_mm : (n,) from the end of the press, whose state is the first, to the last increment
    numbers : (n,) by name: stick ratios, slip margin, what is left of the friction cone, and forces, N
    gross_mm : slide at which the whole contact slips
    first : middle of each taxel's patch and slide at which its region first slips, mm
    """

    name: str
    slide_mm: Float
    numbers: dict[str, Float]
    gross_mm: float
    first: list[tuple[float, float]]
    settled: Settled

    def falls(self, name: str, level: float) -> float:
        """Return the slide over that of gross slip at which a number falls through a level for the last time."""
        values = self.numbers[name]
        above = np.flatnonzero(values > level)
        if len(above) == 0 or above[-1] + 1 == len(values):
            return 0.0 if len(above) == 0 else np.nan
        k = above[-1]
        share = (values[k] - level) / (values[k] - values[k + 1])
        return float((self.slide_mm[k] + share * (self.slide_mm[k + 1] - self.slide_mm[k])) / self.gross_mm)

    @property
    def from_mindlin(self) -> float:
        """Largest distance of the stick ratio by area from margin^(2/3) until gross slip."""
        sticks = self.numbers["slip_margin"] > 0.0
        apart = self.numbers["stick_ratio_area"] - self.numbers["slip_margin"] ** (2.0 / 3.0)
        return float(np.abs(apart[sticks]).max())


def ball(radius_mm: float, size_mm: float, half_length_mm: float, **effects: Any) -> dict[str, Any]:
    """Return the tables of a ball on the gel pad."""
    more = {"object": {"shape": "sphere", "radius_mm": radius_mm}, "effects": effects or {"auto": False}}
    return block_tables((half_length_mm, 4.0, 16.0), 0.1, 0.49, (size_mm, 2.0), **more)


def fingertip(size_mm: float) -> dict[str, Any]:
    """Return the tables of the fingertip under a plane."""
    tables = tomllib.loads(FINGERTIP.read_text("utf-8"))
    mesh = tables["mesh"] | {"size_mm": size_mm, "base_size_mm": 2.5}
    return tables | {"mesh": mesh, "effects": {"auto": False}}


def slid(name: str, tables: dict[str, Any], force_N: float, slide_mm: float, steps: int, spacing_mm: float) -> Slide:
    """Press to a force, hold it and slide; taxels stand in a row along the slide."""
    legs = [{"force_N": force_N, "steps": PRESS}, {"force_N": force_N, "slide_x_mm": slide_mm, "steps": steps}]
    places = {f"t{k}": (k - 3) * spacing_mm for k in range(7)}
    patch = {"length_mm": 0.8 * spacing_mm, "width_mm": spacing_mm}
    taxels = [{"name": key, "x_mm": x, "z_mm": 0.0, **patch} for key, x in places.items()]
    more = {"friction": {"mu": MU}, "press": {"leg": legs}, "taxel": taxels}
    result = press(tables | more, error=False, figures=False)
    taken = result.steps[PRESS - 1 :]
    keys = ("stick_ratio_area", "stick_ratio_force", "slip_margin", "normal_force_N")
    numbers = {key: np.array([getattr(step, key) for step in taken]) for key in keys}
    pull = np.hypot([step.force_x_N for step in taken], [step.force_z_N for step in taken])
    numbers |= {"tangential_force_N": pull, "cone": 1.0 - pull / (MU * numbers["normal_force_N"])}
    events = result.summary()
    regions = ((x, events["first_slip"][f"taxel_{key}"]) for key, x in places.items())
    return Slide(
        name,
        np.array([step.slide_x_mm for step in taken]),
        numbers,
        events["gross_slip"]["slide_x_mm"],
        [(x, event["slide_x_mm"]) for x, event in regions if event],
        Settled(len(result.steps), PRESS + steps, max(step.residual or 0.0 for step in result.steps)),
    )


def run(quick: bool) -> Result:
    """Quick: coarse meshes, few increments, small strain."""
    coarser, steps = (2.0, 8) if quick else (1.0, 20)
    pad, tip = ball(6.0, 0.4 * coarser, 10.0), fingertip(0.8 * coarser)
    given = {"ball": (pad, 0.5, 1.6, 0.5), "fingertip": (tip, 2.0, 1.8, 1.0)}
    found, rows = list[Slide](), list[Row]()
    for name, (tables, force_N, slide_mm, spacing_mm) in given.items():
        few, many = (slid(name, tables, force_N, slide_mm, n * steps, spacing_mm) for n in (1, 4))
        found.append(many)
        rows.append(_same_gross_slip(few, many, slide_mm / steps))
    if not quick:
        large = ball(6.0, 0.5, 10.0, large_deformation={})
        found.append(slid("ball, large deformation", large, 0.5, 1.6, steps, 0.5))
    shallow = slid("shallow ball", ball(12.0, 0.2 * coarser, 6.0), 0.02, 0.12, 12, 0.3)
    rows += [row for one in found for row in _warnings(one)]
    rows += [
        judged("stick-ratio-under-shallow-ball", shallow.from_mindlin, tolerance=0.1 * coarser),
        judged("stick-ratio-under-ball", found[0].from_mindlin, tolerance=0.1 * coarser),
    ]
    every = [*found, shallow]
    names = "scene slide_mm gross_slip_mm stick_ratio_area stick_ratio_force slip_margin normal_force_N "
    table = columns(names + "tangential_force_N cone", [line for one in every for line in _lines(one)])
    return Result(tuple(rows), table, lambda figure: _draw(figure, found), settled([one.settled for one in every]))


def _lines(one: Slide) -> Iterator[tuple[Any, ...]]:
    for slide, *values in zip(one.slide_mm.tolist(), *(v.tolist() for v in one.numbers.values()), strict=True):
        yield one.name, slide, one.gross_mm, *values


def _same_gross_slip(few: Slide, many: Slide, increment_mm: float) -> Row:
    fewer, more = (len(one.slide_mm) - 1 for one in (few, many))
    apart = abs(few.gross_mm - many.gross_mm) / increment_mm
    return judged("gross-slip", apart, fewer=fewer, more=more, name=few.name)


def _warnings(one: Slide) -> Iterator[Row]:
    """How early each number warns, and the bit of the friction cone."""
    bit = one.falls("cone", THRESHOLD)
    for name, level in LEVELS:
        yield judged("warning", one.falls(name, level), bit, number=NAMES[name], level=level, name=one.name)
    step = float(one.slide_mm[-1] - one.slide_mm[-2]) / one.gross_mm
    yield judged("bit-of-the-friction-cone", bit, tolerance=step, name=one.name)


def _draw(figure: Any, found: list[Slide]) -> None:
    figure.set_size_inches(11.0, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    one = found[0]
    share = one.slide_mm / one.gross_mm
    for name, color in (("stick_ratio_area", "#2166ac"), ("stick_ratio_force", "#67a9cf"), ("slip_margin", "#b2182b")):
        left.plot(share, one.numbers[name], color=color, label=NAMES[name])
    bit = one.falls("cone", THRESHOLD)
    left.step([0.0, bit, share[-1]], [1.0, 0.0, 0.0], where="post", color="#555555", ls="--",
              label="bit of the friction cone (0: slip)")  # fmt: skip
    left.axvline(1.0, color="k", lw=0.8, ls=":", label="gross slip")
    left.set(xlabel="slide over the slide of gross slip", ylabel="what is left until slip", ylim=(-0.03, 1.08))
    left.set_title("ball on a gel pad")
    left.legend(frameon=False, loc="upper right")
    for other, mark in zip(found, "osv", strict=False):
        place, first = np.array(other.first).T
        right.plot(place, first / other.gross_mm, mark + "-", ms=4, lw=0.8, label=other.name)
    right.axhline(1.0, color="k", lw=0.8, ls=":", label="gross slip")
    right.set(xlabel="middle of the taxel along the slide (mm)", ylim=(-0.03, 1.45),
              ylabel="slide of first slip over that of gross slip")  # fmt: skip
    right.set_title("first slip above each taxel")
    right.legend(frameon=False, loc="upper right", ncols=2)
