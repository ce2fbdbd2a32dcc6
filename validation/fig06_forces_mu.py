"""Does more friction leave the normal force as it is, raise the tangential force and shrink the slip zones?

Source: Maeno 2004, Fig. 6 and Sec. II-B: R = 5 mm, 1 mm, plane stress, mu = .06 to 1: "the normal reaction force does
not differ greatly"; "when the friction coefficient is large, the value of the tangential force is large, whereas the
area of the slip region at the edge of the contact area is small".
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._paper import MUS, STRAIN, STRESS, Profile, half_cylinder, said
from ._press import under
from ._rows import Result, Row, columns

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
JUDGED = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))


def run(quick: bool) -> Result:
    """Five coefficients on one condensation each."""
    size = 0.2 if quick else 0.05
    found, lines = {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        for mu in MUS:
            profile = Profile.of(problem, under(problem, mu)[-1])
            found[plane, nu, mu] = profile
            friction = float(np.abs(profile.q) @ profile.area)
            outward = float((profile.q * np.sign(profile.x)) @ profile.area)
            zones = (profile.a, profile.c, profile.edge_error())
            lines.append((plane, nu, mu, profile.force, float(profile.p.max()), friction, outward, *zones))
    rows = [row for case in JUDGED for row in _judged(*case, [found[*case, mu] for mu in MUS])]
    names = "plane nu mu force_N_per_mm peak_MPa friction_sum_N_per_mm outward_N_per_mm a_mm c_mm error_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, found))


def _judged(plane: str, nu: float, profiles: list[Profile]) -> list[Row]:
    force = [p.force for p in profiles]
    friction = [float(np.abs(p.q) @ p.area) for p in profiles]
    return statements(f"{plane}, nu = {nu:g}", profiles, force, friction)


def statements(here: str, profiles: Sequence[Profile], force: Sequence[float], friction: Sequence[float]) -> list[Row]:
    """What Sec. II-B says of the normal force and of the sum of |f_t| for the five coefficients."""
    slip = [p.a - p.c for p in profiles]
    return [
        said(
            f"f_n does not differ greatly: force at mu = 1 is that at .06, {here}", "Fig. 6", force[0], force[-1],
            "10 % would be read off a figure", 0.1,
        ),
        said(
            f"f_t is large when mu is: sum |f_t| at mu = 1 over that at .25, {here}", "Fig. 6", 1.1,
            friction[-1] / friction[2], "10 % would be read off a figure", 0.0, "at least",
        ),
        said(
            f"the slip zone is small when mu is large: width at mu = 1 over that at .06, {here}", "Fig. 6", 0.5,
            slip[-1] / max(slip[0], profiles[0].edge_error()), "half would be called small", 0.0, "at most",
        ),
    ]  # fmt: skip


def _draw(figure: Any, found: dict[Any, Profile]) -> None:
    from matplotlib import colormaps

    figure.set_size_inches(12.0, 6.4)
    panels = figure.subplots(2, 3, sharex=True, sharey="row")
    figure.suptitle("Tractions on the finger at 1 mm under five friction coefficients")
    for column, (plane, nu) in enumerate(JUDGED):
        for i, mu in enumerate(MUS):
            profile = found[plane, nu, mu]
            on = np.abs(profile.x) < 3.1
            colour = colormaps["plasma"](0.85 * i / 4)
            panels[0, column].plot(profile.x[on], profile.p[on], color=colour, label=f"{mu:g}")
            panels[1, column].plot(profile.x[on], profile.q[on], color=colour)
        panels[0, column].set_title(f"{plane}, nu = {nu:g}")
        panels[1, column].set_xlabel("x (mm)")
        panels[1, column].axhline(0.0, color="#999999", lw=0.7)
    panels[0, 0].set_ylabel("normal f_n (MPa)")
    panels[1, 0].set_ylabel("friction f_t along x (MPa)")
    panels[0, 0].legend(title="mu", frameon=False)
