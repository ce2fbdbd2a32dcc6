"""Do a cylinder and a ball on a deep block show Hertz's force, pressure and size of contact, and how fast do they
converge?

Source: Hertz's solution (validation/REFERENCES.md, 1.1 for the ball, 1.2 for the cylinder), with E* = E/(1 - nu^2), and
E* = E in plane stress.  Forces are compared at equal a, because the depth depends on the height of the block: 200 a
under the cylinder, where its base changes P(a) by 0.7 (a/h)^2 of itself, and 10 a under the ball, where it changes P(a)
by 0.05 % and the force at equal depth by 10 %.

Counting the points in contact would give a only to one point spacing h.  Instead, a is read from the pressure.  Under
the cylinder p^2 is linear in x^2, and the line through the points within 0.9 a ends at a.  Under the ball a^2 is 5/2
times the mean of r^2 weighted with p; the linear fit needs more than the 8 points to a that are affordable there (its
error is 10 %).

Expected rates: pressures are piecewise linear, and the best approximation of the square-root edge has an error of first
order in h in L2; moments of the pressure, and a, which is read from the inner pressure, converge like the force, with
second order (see bonded), or faster where the edge crosses many cells.  The errors oscillate with the position of the
edge between two points, so the root mean square over 20 and 12 depths is used.  Under the ball the body is a quarter of
a graded box; bonded goes through CAD, pytetwild and symmetry.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg
from finger3d.objects import Cylinder

from ._common import ball_numbers, contact_axis, convergence, ellipse, ellipse_error, graded, quarter_block, rate
from ._halfplane import CANDIDATES, Profile, on_block
from ._layer import line, point
from ._press import converged
from ._rows import Result, Row, exact_columns, listed, rms, together

judged = listed(__file__)

RADIUS = 1000.0  # a = 1: the circle is a parabola to 1e-6

CASES = (("plane-strain", 0.3), ("plane-strain", 0.5), ("plane-stress", 0.3))


@dataclass(frozen=True)
class Contact:
    """One depth, against Hertz at the same force.

    Attributes
    ----------
    half_width, peak : a from the line of p^2, and the peak of that line, relative to Hertz's at the force
    pressure : L2 norm of the pressure's error over that of Hertz's
    """

    half_width: float
    peak: float
    pressure: float


def contact(x: Float, p: Float, force: float, modulus: float) -> Contact:
    """Compare nodal pressures p (n,) MPa at ascending x (n,) with Hertz's at `force` (N per mm), modulus E*."""
    a = float(np.sqrt(4.0 * force * RADIUS / (np.pi * modulus)))
    p0 = 2.0 * force / (np.pi * a)
    half_width, peak = ellipse(x, p, 0.9 * a)
    return Contact(half_width / a, peak / p0, ellipse_error(x, p, a, p0))


def measured_line(domain: Any, nu: float, count: int) -> list[Contact]:
    """Press to 20 depths with half-widths near 0.7 to 1; `count` points to a."""
    height = 200.0
    depths = [line(v / height, nu).depth * v**2 / RADIUS for v in np.linspace(0.7, 1.0, 20)]
    legs, bar = tuple(Leg(d, steps=1) for d in depths), Cylinder(radius_mm=RADIUS)
    # points that the rigid cylinder overlaps by 0.2 of the depth reach to 2 a here, far beyond the contact
    problem = build(on_block(bar, Isotropic(1.0, nu), count, legs, height, domain=domain), margin=CANDIDATES)
    modulus = 1.0 if domain == "plane-stress" else 1.0 / (1.0 - nu**2)
    profiles = [Profile.of(problem, frame) for frame in converged(problem)]
    return [contact(profile.x, profile.p, profile.force, modulus) for profile in profiles]


def _line(quick: bool) -> Result:
    """Sections of three sizes and more."""
    counts = (8, 16, 32) if quick else (10, 20, 40, 80)
    rows, table, curves, slopes = [], [], {}, []
    for domain, nu in CASES:
        if quick and nu == 0.5:
            continue
        name = f"{domain.replace('-', ' ')}, nu = {nu:g}"
        levels = [measured_line(domain, nu, n) for n in counts]
        rows += _line_rows(name, levels[-1])
        errors = np.array([[rms(c.half_width - 1.0 for c in cs), rms(c.pressure for c in cs)] for cs in levels])
        curves[name] = errors
        slopes.append([rate(1.0 / np.array(counts[-3:]), e) for e in errors[-3:].T])
        table += [(domain, nu, n, *e) for n, e in zip(counts, errors, strict=True)]
    width, pressure = np.min(slopes, axis=0)
    rows += [judged("rate-of-the-half-width", width), judged("rate-of-the-pressure-under-cylinder", pressure)]
    size = "half-width over Hertz's at the force, less 1"
    names = "domain nu points_per_a half_width_rms_error pressure_L2_error"
    return Result(tuple(rows), exact_columns(names, table), lambda f: draw(f, "cylinder", counts, curves, size))


def _line_rows(name: str, last: list[Contact]) -> Iterator[Row]:
    """What the finest mesh of a case gives."""
    ratios, peaks = [c.half_width**-2 for c in last], [c.peak for c in last]
    yield judged("force-of-cylinder", np.mean(ratios), name=name)
    yield judged("worst-force-of-cylinder", max(abs(ratio - 1.0) for ratio in ratios), name=name)
    yield judged("peak-of-cylinder", np.mean(peaks), name=name)


HEIGHT = 10.0
PLACES = np.linspace(0.7, 1.0, 12)


def depth(a: float, nu: float) -> float:
    """Depth (mm) for about this radius: the bonded layer's."""
    return point(a / HEIGHT, nu).depth * a**2 / RADIUS


def force_at(a: float, nu: float) -> float:
    """Hertz's force (N) at a radius."""
    return 4.0 / 3.0 * a**3 / (RADIUS * (1.0 - nu**2))


def measured_sphere(nu: float, count: int) -> Float:
    """Per depth: P/P_Hertz(a) by the moment, and the pressure's L2 error at the points over Hertz's own norm."""
    block = quarter_block(contact_axis(1.0, count, HEIGHT), graded(HEIGHT, 1.0 / count, 1.6), nu, 1.3)
    gap = block.gap(lambda p: (p[:, 0] ** 2 + p[:, 2] ** 2) / (2.0 * RADIUS))
    forces = [block.normal_force(gap - depth(v, nu)) for v in PLACES]
    found = [ball_numbers(block, force, RADIUS, 1.0 / (1.0 - nu**2)) for force in forces]
    return np.array([(force / force_at(a, nu), away) for force, a, away in found])


def _sphere(quick: bool) -> Result:
    """Quarter blocks of three sizes."""
    cases = {0.3: (3, 4, 5)} if quick else {0.3: (4, 6, 8), 0.5: (4, 6, 8)}
    rows, table, curves = [], [], {}
    for nu, counts in cases.items():
        levels = [measured_sphere(nu, n) for n in counts]
        sizes = 1.0 / np.array(counts)
        rows.append(judged("force-of-ball", levels[-1][:, 0].mean(), nu=nu, count=counts[-1]))
        errors = np.array([np.sqrt([np.mean((e[:, 0] - 1.0) ** 2), np.mean(e[:, 1] ** 2)]) for e in levels])
        table += [(nu, n, *e) for n, e in zip(counts, errors, strict=True)]
        curves[f"nu = {nu:g}"] = errors
        force, pressure = (rate(sizes, column) for column in errors.T)
        rows += [judged("rate-of-the-force", force, nu=nu), judged("rate-of-the-pressure-under-ball", pressure, nu=nu)]
    size = "P(a)/P_Hertz(a) less 1"
    names = "nu points_per_a force_rms_error pressure_L2_error"
    return Result(tuple(rows), exact_columns(names, table), lambda f: draw(f, "ball", counts, curves, size))


def draw(figure: Any, title: str, counts: tuple[int, ...], curves: dict[str, Float], size: str) -> None:
    """Errors of the size of the contact and of the pressure over the point spacing."""
    figure.suptitle(title)
    labels = f"{size}, rms over depths", "pressure, relative L2 error, rms over depths"
    for column, (axes, theory, label) in enumerate(zip(figure.subplots(1, 2), (2.0, 1.0), labels, strict=True)):
        errors = {name: e[:, column] for name, e in curves.items()}
        convergence(axes, 1.0 / np.array(counts), errors, theory, "point spacing / a", label)


def run(quick: bool) -> Result:
    """Sections of three sizes and more; quarter blocks of three sizes."""
    return together((10.0, 9.0), line=_line(quick), sphere=_sphere(quick))
