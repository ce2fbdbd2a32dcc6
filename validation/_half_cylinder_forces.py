"""How do tractions and zones of slip in the contact of the half cylinder change with the depth and with friction?

Source: Maeno 2004, Figs. 3, 4 and 6 and Sec. II-B: R = 5 mm, E = 1 MPa, pressed 1 mm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from finger3d.mechanics.discretise.build import build

from ._paper import CASES, MUS, SHOWN, STRAIN, STRESS, Profile, by_mu, draw_shown, half_cylinder, pressed, said
from ._rows import Result, Row, columns, listed, together

judged = listed(__file__)

KNOWN = {0.2: (0.12668, 0.862, 0.639), 0.5: (0.40495, 1.508, 1.376), 1.0: (1.01932, 2.297, 2.230)}
TRACTIONS = ("normal f_n (MPa)", "friction f_t along x (MPa)")


def _depths(quick: bool) -> Result:
    """Are the normal forces semi-circular at every depth, and the friction one minimum and one maximum that sum to
    zero?

    Source: Maeno 2004, Fig. 3 and Sec. II-B: R = 5 mm, mu = 0.25, depths 0.2 to 1 mm. The forces at nu = 0.3 in
    plane stress are compared with validation/REFERENCES.md, 2.6. The paper draws nodal forces; tractions are used
    here, because they do not depend on the mesh. No symmetry is used, so that zero net friction is a result.

    Tractions at five depths in the section of every plane state and Poisson's ratio.
    """
    size = 0.2 if quick else 0.025
    found, lines = {}, []
    for plane, nu in CASES:
        problem = build(replace(half_cylinder(nu, plane, size).model, symmetry=()))
        frames = pressed(problem, 0.25, 5)
        found[plane, nu] = [Profile.of(problem, f) for f in frames]
        for frame, profile in zip(frames, found[plane, nu], strict=True):
            table = zip(profile.x, profile.p, profile.q, profile.status, strict=True)
            lines += [(plane, nu, frame.target.depth_mm, *map(float, row)) for row in table if row[1] > 0.0]
    rows = [*_reference(size)]
    rows += [row for case in SHOWN for row in statements_depths(f"{case[0]}, nu = {case[1]:g}", found[case])]
    table = columns("plane nu depth_mm x_mm p_MPa q_MPa status", lines)
    return Result(tuple(rows), table, lambda figure: _draw_depths(figure, found))


def _reference(size: float) -> Iterator[Row]:
    problem = half_cylinder(0.3, STRESS, size)
    frames = pressed(problem, 0.25, 10)
    for depth, (force, a, c) in KNOWN.items():
        frame = min(frames, key=lambda f: abs(f.target.depth_mm - depth))
        profile = Profile.of(problem, frame)
        here = f"at {depth:g} mm, plane stress, nu = .3, mu = .25"
        yield judged("force", profile.force, force, here=here)
        for name, want, got in (("a", a, profile.a), ("c", c, profile.c)):
            yield judged("half-width", got, want, 2.0 * profile.edge_error() + 0.013, name=name, here=here)


def roundness(profile: Profile) -> float:
    """Largest distance of p from the half ellipse of the same force and width, over its peak, for |x| < .9 a."""
    peak = 2.0 * profile.force / (np.pi * profile.a)
    inside = np.abs(profile.x) < 0.9 * profile.a
    ellipse = peak * np.sqrt(1.0 - (profile.x[inside] / profile.a) ** 2)
    return float(np.abs(profile.p[inside] - ellipse).max() / peak)


def extrema(q: np.ndarray) -> int:
    """Local extrema of q along x that stand out by more than a fifth of its range."""
    return sum(len(find_peaks(sign * q, prominence=0.2 * np.ptp(q))[0]) for sign in (1.0, -1.0))


def statements_depths(here: str, profiles: Sequence[Profile]) -> list[Row]:
    """What Sec. II-B says of the tractions, from small to full depth."""
    shown = "all depths" if len(profiles) > 1 else "full depth"
    net = max(abs(p.q @ p.area) / p.friction for p in profiles)
    return [
        said("semi-circular", max(map(roundness, profiles)), shown=shown, here=here),
        said("two-extrema", extrema(profiles[-1].q), here=here),
        said("no-net-friction", net, here=here),
    ]


def _draw_depths(figure: Any, found: dict[Any, list[Profile]]) -> None:
    figure.suptitle("Tractions on the finger, mu = .25; the paper computes plane stress and gives no nu")
    depths = [f"{0.2 * (i + 1):.1f} mm" for i in range(5)]
    curves = {case: {d: _near(p, p.a + 0.3) for d, p in zip(depths, found[case], strict=True)} for case in SHOWN}
    draw_shown(figure, TRACTIONS, "depth", curves)


def _near(profile: Profile, reach: float) -> tuple[np.ndarray, ...]:
    on = np.abs(profile.x) < reach
    return profile.x[on], profile.p[on], profile.q[on]


JUDGED_ZONES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.49))


def _zones(quick: bool) -> Result:
    """Does the finger slip at both edges and stick in the middle, and do the slip zones grow with the depth?

    Source: Maeno 2004, Fig. 4 and Sec. II-B: R = 5 mm, mu = 0.25, plane stress, 1 mm: "two slip regions at the edge
    and a stick region at the center"; "when the indentation is increased, the partial incipient slip regions at
    both edges increase". In a half-plane c/a is constant while loading (Spence 1968; validation/REFERENCES.md,
    2.1); only the finite size of the body changes it.

    Zones at ten depths, on a fine section.
    """
    size = 0.15 if quick else 0.03
    found, lines = {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        frames = pressed(problem, 0.25, 10)
        found[plane, nu] = [Profile.of(problem, f) for f in frames]
        for profile, frame in zip(found[plane, nu], frames, strict=True):
            line = (frame.target.depth_mm, profile.a, profile.c, profile.edge_error(), profile.slips_at_edges_only)
            lines.append((plane, nu, *line))
    rows = [
        row for plane, nu in JUDGED_ZONES for row in statements_zones(f"{plane}, nu = {nu:g}", *found[plane, nu][1::8])
    ]
    names = "plane nu depth_mm a_mm c_mm error_mm slips_at_both_edges_only"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_zones(figure, found))


def statements_zones(here: str, early: Profile, last: Profile) -> list[Row]:
    """What the paper says of the zones, at a fifth of the depth and at full depth."""
    error = last.edge_error() + early.edge_error()
    return [
        said("stick-between-slip", last.slips_at_edges_only, here=here),
        said("slip-zones-grow", (last.a - last.c) - (early.a - early.c), wanted=error, here=here),
        said("slip-share-grows", last.c / -last.a + early.c / early.a, wanted=error / early.a, here=here),
    ]


def _draw_zones(figure: Any, found: dict[Any, list[Profile]]) -> None:
    axes = figure.subplots()
    for plane, nu in JUDGED_ZONES:
        width = [profile.a - profile.c for profile in found[plane, nu]]
        style = "o-" if plane == STRESS else "s--"
        axes.plot(0.1 * np.arange(1, 11), width, style, ms=4, label=f"{plane}, nu = {nu:g}")
    axes.set(xlabel="depth (mm)", ylabel="width of each slip zone (mm)")


def _mus(quick: bool) -> Result:
    """Does more friction leave the normal force as it is, raise the tangential force and shrink the slip zones?

    Source: Maeno 2004, Fig. 6 and Sec. II-B: R = 5 mm, 1 mm, plane stress, mu = .06 to 1: "the normal reaction
    force does not differ greatly"; "when the friction coefficient is large, the value of the tangential force is
    large, whereas the area of the slip region at the edge of the contact area is small".

    Five coefficients on one condensation each.
    """
    size = 0.2 if quick else 0.05
    found, lines = {}, []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        for mu in MUS:
            profile = Profile.of(problem, pressed(problem, mu)[-1])
            found[plane, nu, mu] = profile
            outward = float((profile.q * np.sign(profile.x)) @ profile.area)
            zones = (profile.a, profile.c, profile.edge_error())
            lines.append((plane, nu, mu, profile.force, float(profile.p.max()), profile.friction, outward, *zones))
    rows: list[Row] = []
    for plane, nu in SHOWN:
        profiles = [found[plane, nu, mu] for mu in MUS]
        force, friction = ([getattr(p, key) for p in profiles] for key in ("force", "friction"))
        rows += statements_mus(f"{plane}, nu = {nu:g}", profiles, force, friction)
    names = "plane nu mu force_N_per_mm peak_MPa friction_sum_N_per_mm outward_N_per_mm a_mm c_mm error_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_mus(figure, found))


def statements_mus(
    here: str, profiles: Sequence[Profile], force: Sequence[float], friction: Sequence[float]
) -> list[Row]:
    """What Sec. II-B says of the normal force and of the sum of |f_t| for the five coefficients."""
    slip = [p.a - p.c for p in profiles]
    return [
        said("normal-force-stays", force[-1], wanted=force[0], here=here),
        said("friction-grows", friction[-1] / friction[2], here=here),
        said("slip-zone-shrinks", slip[-1] / max(slip[0], profiles[0].edge_error()), here=here),
    ]


def _draw_mus(figure: Any, found: dict[Any, Profile]) -> None:
    figure.suptitle("Tractions on the finger at 1 mm under five friction coefficients")
    curves = {case: by_mu(_near(found[*case, mu], 3.1) for mu in MUS) for case in SHOWN}
    draw_shown(figure, TRACTIONS, "mu", curves)


def run(quick: bool) -> Result:
    """Tractions over the depth, zones over the depth, tractions over mu."""
    return together((13.0, 17.2), depths=_depths(quick), zones=_zones(quick), mus=_mus(quick))
