"""Deviation of plane models from the solid, and the verdict on a comparison in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float
from finger3d.accuracy.error_bars import with_error
from finger3d.accuracy.richardson import gain
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.readings import Quantity
from finger3d.results.comparison import FORCE, SHOWN, Case

WITHIN = 0.05
"""Relative deviation from the solid below which a plane model is called sufficient."""

_ASYMPTOTIC = 0.25
"""Deviation of plane strain below which it is extrapolated as 1/width; the ends are then independent of each other."""

_COMMON = 0.25
"""Smallest error bar of a deviation, relative to that of independent errors, if the errors cancel."""

_SURE = 2.0
"""Distance from the limit, in error bars, beyond which a deviation differs significantly from it."""


@dataclass(frozen=True)
class Deviation:
    """Relative deviation (plane - solid)/solid of a quantity at one width, and its error bar."""

    width_mm: float
    value: float
    error: float

    def text(self) -> str:
        """Return the magnitude in percent, for instance ``74 % (± 1 %)``."""
        return f"{rounded(100 * abs(self.value))} % (± {rounded(100 * self.error, 1)})"


def rounded(value: float, digits: int = 2, signed: bool = False) -> str:
    """Return a number with the given number of significant digits, without an exponent."""
    return f"{float(f'{value:.{digits}g}'):{'+' if signed else ''}g}"


def deviation(plane: Case, solid: Case, key: str = FORCE) -> Deviation:
    """Return the deviation of one quantity; the errors of both cases are taken as independent."""
    p, s = plane.numbers[key], solid.numbers[key]
    ratio = p / s
    relative = math.hypot(plane.errors.get(key, 0.0) / max(abs(p), 1e-300), solid.errors.get(key, 0.0) / abs(s))
    return Deviation(solid.width_mm, ratio - 1.0, abs(ratio) * relative)


def force_deviation(plane: Case, solid: Case) -> Deviation:
    """Return the deviation of the forces.

    On swept meshes the in-plane error is common to both cases, and the error of their ratio follows from the ratio on
    the companion meshes. The error bar is at least `_COMMON` times that of independent errors, because two changes may
    agree by chance: of 32 deviations of the Fig. 9 finger (nu = 0.3 and 0.49, 10 to 200 mm wide, edges of 3.6 and 5 mm)
    31 are within twice the error bar with this bound, 24 without.
    """
    found = deviation(plane, solid)
    both = plane.companion and solid.companion and (plane.ratio > 1.0) == (solid.ratio > 1.0)
    # Edges of the solid's companion mesh are limited to the width, those of the section's are not.
    if solid.mesher != "swept" or not both or FACTOR * solid.size_mm > solid.width_mm:
        return found
    change = abs(found.value - (plane.companion[FORCE] / solid.companion[FORCE] - 1.0))
    error = change / min(gain(plane.ratio), gain(solid.ratio))
    return Deviation(found.width_mm, found.value, min(found.error, max(error, _COMMON * found.error)))


def crossing_width(found: Sequence[Deviation], narrow: bool) -> tuple[float, float, float] | None:
    """Return the width at which the deviation reaches `WITHIN`, and the ends of its error bar, mm; None if it does not.

    Parameters
    ----------
    found : deviations at several widths
    narrow : whether the model holds for narrow fingers (plane stress) instead of wide ones (plane strain)
    """
    ordered = sorted(found, key=lambda d: d.width_mm)
    width = np.array([d.width_mm for d in ordered])
    value, error = np.array([abs(d.value) for d in ordered]), np.array([d.error for d in ordered])
    # The deviation from plane strain falls as 1/width; that from plane stress grows in proportion to the width.
    scale = width if narrow else 1.0 / width
    at = [_crossing(scale, v, WITHIN) for v in (value, np.maximum(value - error, 0.0), value + error)]
    if at[0] is None:
        return None
    sizes = [float("nan") if a is None else (a if narrow else 1.0 / a) for a in at]
    return sizes[0], sizes[1], sizes[2]


def _crossing(scale: Float, value: Float, limit: float) -> float | None:
    """Return the largest scale up to which the interpolated `value` stays below `limit`; None if there is none."""
    order = np.argsort(scale)
    scale, value = scale[order], value[order]
    if value[0] > limit:
        return None
    for a, b, fa, fb in zip(scale[:-1], scale[1:], value[:-1], value[1:], strict=True):
        if fb > limit:
            return float(a + (b - a) * (limit - fa) / (fb - fa))
    return float(scale[-1])


def verdict(cases: Sequence[Case], own_width_mm: float, height_mm: float, turns: bool = False) -> list[str]:
    """Return the verdict on the solved cases; it names those that did not converge.

    `turns` is whether the object turns out of the plane of the sections.
    """
    failed = [c for c in cases if not c.ok]
    out = [f"{c.model}, {c.width_mm:g} mm wide, has no result: {c.outcome}." for c in failed]
    own = {c.model: c for c in cases if c.ok and c.width_mm == own_width_mm and c.model != "solid"}
    solid = next((c for c in cases if c.ok and c.model == "solid" and c.width_mm == own_width_mm), None)
    planes = [own[name] for name in ("plane strain", "plane stress") if name in own]
    if solid is None or not planes:
        return [*out, "No verdict: the solid and a plane model are needed."]
    out.append(_force(planes, solid, height_mm))
    out += [_width_within(name, cases) for name in ("plane strain", "plane stress")]
    out += _across(solid)
    out += _torsion(solid) if turns else []
    out.append(_sufficient(planes, solid))
    return out


def _force(planes: Sequence[Case], solid: Case, height: float) -> str:
    parts: list[str] = []
    for plane in planes:
        d = deviation(plane, solid)
        verb = "overstates" if d.value > 0.0 else "understates"
        parts.append(f"{plane.model} {verb} {'it' if parts else 'the force'} by {d.text()}")
    text = " and ".join(parts)
    return f"At width/height {solid.width_mm / height:.2g} ({solid.width_mm:g} mm wide, {height:.4g} mm high) {text}."


def _with_error(case: Case, key: str) -> str:
    return with_error(case.numbers[key], case.errors.get(key), digits=4)


def deviations(model: str, cases: Sequence[Case]) -> list[Deviation]:
    """Return the deviations of a plane model from the solids of all widths, each on the same in-plane mesh."""
    found = []
    for solid in cases:
        mesh = model, solid.width_mm, solid.size_mm
        plane = next((c for c in cases if c.ok and (c.model, c.width_mm, c.size_mm) == mesh), None)
        if solid.ok and solid.model == "solid" and plane is not None:
            found.append(force_deviation(plane, solid))
    return sorted(found, key=lambda d: d.width_mm)


def _width_within(name: str, cases: Sequence[Case]) -> str:
    found = deviations(name, cases)
    narrow = name == "plane stress"
    goal, side = f"within {100 * WITHIN:g} % of the solid's force", "up to" if narrow else "from"
    if len(found) < 2:
        return f"{name.capitalize()} was solved at one width only; --widths finds the width at which it is {goal}."
    nearest = found[0] if narrow else found[-1]
    reach = crossing_width(found, narrow)
    widest = f"{rounded(100 * nearest.value, signed=True)} % at {nearest.width_mm:g} mm"
    if reach is None:
        far = "narrowest" if narrow else "widest"
        more = ""
        if not narrow and abs(nearest.value) < _ASYMPTOTIC:
            guess = nearest.width_mm * abs(nearest.value) / WITHIN
            more = f"; extrapolated as 1/width, it does at about {rounded(guess)} mm"
        return f"{name.capitalize()} is not {goal} at any of these widths ({widest}, the {far}){more}."
    at, low, high = reach
    widths = [d.width_mm for d in found]
    if at == (max(widths) if narrow else min(widths)):
        return f"{name.capitalize()} is {goal} at all of these widths, {min(widths):g} to {max(widths):g} mm."
    bar = [f"{v:.3g}" for v in sorted((low, high)) if math.isfinite(v)]
    between = f" (error bar {' to '.join(bar)})" if len(bar) == 2 else ""
    if len(bar) == 1:
        ends = f"less than {min(widths):g} to {bar[0]}" if narrow else f"{bar[0]} to more than {max(widths):g}"
        between = f" (error bar {ends})"
    return f"{name.capitalize()} is {goal} {side} a width of {at:.3g} mm{between}."


def _across(solid: Case) -> list[str]:
    """Return the share of the friction along the width, which no section has."""
    total, across = (solid.numbers[k] for k in ("friction_sum_N_per_mm", "friction_along_z_N_per_mm"))
    if total <= 0.0:
        return []
    return [f"{100 * across / total:.0f} % of the solid's friction sum act along z, where a section has none."]


def numbers_table(cases: Sequence[Case], own_width_mm: float) -> list[list[str]]:
    """Return the numbers of the models at the scene's width with their errors: the head, then a row for each."""
    order = ("solid", "plane strain", "plane stress")
    own = sorted(
        (c for c in cases if c.ok and c.width_mm == own_width_mm and c.model in order),
        key=lambda c: order.index(c.model),
    )
    shown = [*SHOWN, *dict.fromkeys(Quantity.of(column) for case in own for column in case.strains)]
    rows = [
        [one.label, *(_with_error(case, one.name) if one.name in case.numbers else "" for case in own)]
        for one in shown
        if any(case.numbers.get(one.name) for case in own)
    ]
    return [["", *(case.model for case in own)], *rows] if rows else []


def _torsion(solid: Case) -> list[str]:
    """Name the moment about the press axis, which no section has."""
    return [
        "The object turns out of the plane of the sections, in which it cannot turn: torsion has no 2D model. Moment "
        f"about the press axis: solid {_with_error(solid, 'moment_y_Nmm_per_mm')} N mm per mm of width, sections none."
    ]


def _sufficient(planes: Sequence[Case], solid: Case) -> str:
    """Name the quantities of each plane model that deviate by more and by less than the limit."""
    names = {
        FORCE: "force",
        "contact_length_mm": "extent of contact",
        "stick_length_mm": "extent of the stick zone",
        "friction_sum_N_per_mm": "friction sum",
        "peak_pressure_MPa": "peak pressure",
    }
    names |= {column.key: f"gauge {column.sensor}" for column in solid.strains}
    parts = []
    for plane in planes:
        sides: dict[str, list[str]] = {"more than": [], "less than": [], "not significantly more or less than": []}
        for key, name in names.items():
            if solid.numbers[key] == 0.0:
                continue
            d = deviation(plane, solid, key)
            clear = abs(abs(d.value) - WITHIN) >= _SURE * d.error
            side = "less than" if abs(d.value) < WITHIN else "more than"
            side = side if clear else "not significantly more or less than"
            sides[side].append(f"{name} ({rounded(100 * d.value, signed=True)} %)")
        lists = [f"{side} {100 * WITHIN:g} % in {', '.join(found)}" for side, found in sides.items() if found]
        parts.append(f"{plane.model.capitalize()} deviates from the solid by {'; by '.join(lists)}.")
    return " ".join(parts)
