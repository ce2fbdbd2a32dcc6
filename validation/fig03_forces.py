"""Are the normal forces semi-circular at every depth, and the friction one minimum and one maximum that sum to zero?

Source: Maeno 2004, Fig. 3 and Sec. II-B: R = 5 mm, mu = 0.25, depths 0.2 to 1 mm.  The forces at nu = 0.3 in plane
stress are compared with validation/REFERENCES.md, 2.6.  The paper draws nodal forces; tractions are used here, because
they do not depend on the mesh.  No symmetry is used, so that zero net friction is a result.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Model

from ._paper import STRAIN, STRESS, Profile, half_cylinder, said
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))
KNOWN = {0.2: (0.12668, 0.862, 0.639), 0.5: (0.40495, 1.508, 1.376), 1.0: (1.01932, 2.297, 2.230)}
REFERENCE = "half cylinder, one method; REFERENCES.md, 2.6"


def run(quick: bool) -> Result:
    """Tractions at five depths in the section of every plane state and Poisson's ratio."""
    size = 0.2 if quick else 0.025
    found, lines = {}, []
    for plane, nu in CASES:
        problem = _whole(half_cylinder(nu, plane, size).model)
        frames = under(problem, 0.25, 5)
        found[plane, nu] = [Profile.of(problem, f) for f in frames]
        for frame, profile in zip(frames, found[plane, nu], strict=True):
            table = zip(profile.x, profile.p, profile.q, profile.status, strict=True)
            lines += [(plane, nu, frame.target.depth_mm, *map(float, row)) for row in table if row[1] > 0.0]
    rows = [*_reference(size)]
    rows += [row for case in JUDGED for row in statements(f"{case[0]}, nu = {case[1]:g}", found[case])]
    table = columns("plane nu depth_mm x_mm p_MPa q_MPa status", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, found))


def _whole(model: Model) -> Any:
    """The problem without use of its symmetry."""
    return build(replace(model, symmetry=()))


def _reference(size: float) -> Iterator[Row]:
    problem = half_cylinder(0.3, STRESS, size)
    frames = under(problem, 0.25, 10)
    for depth, (force, a, c) in KNOWN.items():
        frame = min(frames, key=lambda f: abs(f.target.depth_mm - depth))
        profile = Profile.of(problem, frame)
        here = f"at {depth:g} mm, plane stress, nu = .3, mu = .25"
        yield Row(f"P, N per mm, {here}", REFERENCE, force, profile.force, 0.005, "mesh; 0.01 % measured")
        for name, want, got in (("a", a, profile.a), ("c", c, profile.c)):
            reason = "one point spacing here, 0.013 mm in the reference"
            tolerance = 2.0 * profile.edge_error() + 0.013
            yield Row(f"{name}, mm, {here}", REFERENCE, want, got, tolerance, reason, measure="absolute")


def roundness(profile: Profile) -> float:
    """Largest distance of p from the half ellipse of the same force and width, over its peak, for |x| < .9 a."""
    peak = 2.0 * profile.force / (np.pi * profile.a)
    inside = np.abs(profile.x) < 0.9 * profile.a
    ellipse = peak * np.sqrt(1.0 - (profile.x[inside] / profile.a) ** 2)
    return float(np.abs(profile.p[inside] - ellipse).max() / peak)


def extrema(q: np.ndarray) -> int:
    """Local extrema of q along x that stand out by more than a fifth of its range."""
    turning, last, least = 0, q[0], 0.2 * np.ptp(q)
    direction = 0
    for value in q:
        if direction >= 0 and value > last or direction <= 0 and value < last:
            if abs(value - last) > least or direction:
                direction = direction or int(np.sign(value - last))
                last = value
        elif abs(value - last) > least:
            turning += 1
            direction, last = -direction, value
    return turning


def statements(here: str, profiles: Sequence[Profile]) -> list[Row]:
    """What Sec. II-B says of the tractions, from small to full depth."""
    shown = "all depths" if len(profiles) > 1 else "full depth"
    net = max(abs(p.q @ p.area) / (np.abs(p.q) @ p.area) for p in profiles)
    return [
        said(
            f"f_n is semi-circular: largest distance from a half ellipse over its peak, {shown}, {here}",
            "Fig. 3", 0.0, max(map(roundness, profiles)), "5 % is the width of a drawn line", 0.05, "absolute",
        ),
        said(
            f"f_t has one minimum and one maximum: extrema at full depth, {here}", "Fig. 3", 2.0,
            extrema(profiles[-1].q), "a count; wiggles below a fifth of the range are not counted", 0.0, "absolute",
        ),
        said(
            f"the sum of f_t is zero: |sum f_t| / sum |f_t|, {here}", "Sec. II-B", 0.0, net, "round-off", 1e-6,
            "absolute",
        ),
    ]  # fmt: skip


def _draw(figure: Any, found: dict[Any, list[Profile]]) -> None:
    from matplotlib import colormaps

    figure.set_size_inches(12.0, 6.4)
    panels = figure.subplots(2, 3, sharex=True, sharey="row")
    figure.suptitle("Tractions on the finger, mu = .25; the paper computes plane stress and gives no nu")
    for column, (plane, nu) in enumerate(JUDGED):
        for i, profile in enumerate(found[plane, nu]):
            colour = colormaps["viridis"](0.1 + 0.2 * i)
            on = np.abs(profile.x) < profile.a + 0.3
            panels[0, column].plot(profile.x[on], profile.p[on], color=colour, label=f"{0.2 * (i + 1):.1f} mm")
            panels[1, column].plot(profile.x[on], profile.q[on], color=colour)
        panels[0, column].set_title(f"{plane}, nu = {nu:g}")
        panels[1, column].set_xlabel("x (mm)")
        panels[1, column].axhline(0.0, color="#999999", lw=0.7)
    panels[0, 0].set_ylabel("normal f_n (MPa)")
    panels[1, 0].set_ylabel("friction f_t along x (MPa)")
    panels[0, 0].legend(title="depth", frameon=False)
