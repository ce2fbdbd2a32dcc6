"""Does the finger slip at both edges and stick in the middle, and do the slip zones grow with the depth?

Source: Maeno 2004, Fig. 4 and Sec. II-B: R = 5 mm, mu = 0.25, plane stress, 1 mm: "two slip regions
at the edge and a stick region at the center"; "when the indentation is increased, the partial incipient slip regions at
both edges increase".  In a half-plane c/a is constant while loading (Spence 1968; validation/REFERENCES.md, 2.1); only
the finite size of the body changes it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._paper import STRAIN, STRESS, Profile, half_cylinder, said
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.49))
DRAWN = ((STRESS, 0.3), (STRAIN, 0.49))


def run(quick: bool) -> Result:
    """Zones at ten depths, on a fine section."""
    size = 0.15 if quick else 0.03
    found, lines = {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        frames = under(problem, 0.25)
        found[plane, nu] = [Profile.of(problem, f) for f in frames]
        for profile, frame in zip(found[plane, nu], frames, strict=True):
            line = (frame.target.depth_mm, profile.a, profile.c, profile.edge_error(), profile.slips_at_edges_only)
            lines.append((plane, nu, *line))
    rows = [row for plane, nu in JUDGED for row in statements(f"{plane}, nu = {nu:g}", *found[plane, nu][1::8])]
    names = "plane nu depth_mm a_mm c_mm error_mm slips_at_both_edges_only"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, found))


def statements(here: str, early: Profile, last: Profile) -> list[Row]:
    """What the paper says of the zones, at a fifth of the depth and at full depth."""
    error = last.edge_error() + early.edge_error()
    return [
        said(
            f"stick in the middle between two slip zones at full depth (1: yes), {here}", "Fig. 4", 1.0,
            last.slips_at_edges_only, "yes or no", 0.0, "absolute",
        ),
        said(
            f"slip zones grow with depth: width at full depth less that at a fifth, mm, {here}", "Sec. II-B", error,
            (last.a - last.c) - (early.a - early.c), "more than the points can tell", 0.0, "at least",
        ),
        said(
            f"slip zones grow in their share of the contact: 1 - c/a at full depth less at a fifth, {here}",
            "Sec. II-B", error / early.a, last.c / -last.a + early.c / early.a, "more than the points can tell", 0.0,
            "at least",
        ),
    ]  # fmt: skip


def _draw(figure: Any, found: dict[Any, list[Profile]]) -> None:
    figure.set_size_inches(13.0, 4.4)
    panels = figure.subplots(1, 3)
    for axes, (plane, nu) in zip(panels, DRAWN, strict=False):
        last = found[plane, nu][-1]
        on = np.abs(last.x) < 3.2
        axes.axvspan(-last.a, last.a, color="#fde3c4", lw=0, label="slip")
        axes.axvspan(-last.c, last.c, color="#c9d9ee", lw=0, label="stick")
        axes.plot(last.x[on], last.p[on], color="#222222", label="f_n")
        axes.plot(last.x[on], 0.25 * last.p[on], "--", color="#777777", lw=1, label="± mu f_n")
        axes.plot(last.x[on], -0.25 * last.p[on], "--", color="#777777", lw=1)
        axes.plot(last.x[on], last.q[on], color="#c0392b", label="f_t")
        axes.set(xlabel="x (mm)", xlim=(-3.2, 3.2), ylim=(-0.13, 0.5), title=f"{plane}, nu = {nu:g}, 1 mm")
    panels[0].legend(loc="upper left", framealpha=1.0)
    panels[0].set_ylabel("traction on the finger (MPa)")
    for i, (plane, nu) in enumerate(JUDGED):
        profiles = found[plane, nu]
        depth = 0.1 * np.arange(1, 11)
        style = "o-" if plane == STRESS else "s--"
        panels[2].plot(depth, [p.a - p.c for p in profiles], style, ms=4, color=f"C{i}", label=f"{plane}, nu = {nu:g}")
    panels[2].set(xlabel="depth (mm)", ylabel="width of each slip zone (mm)")
    panels[2].legend(frameon=False)
