"""By how much does an object's curvature move the gauge strain, and so the friction coefficient read from it?

No published reference: a sensitivity study, as the paper leaves non-flat objects to future work.  The Fig. 9 finger in
plane strain (nu = 0.49, E = 1 MPa) is pressed to the same *force* on a plane and on bars of radius 400 to 30 mm; gauge
g36 of geometries/fig9.toml is read.  The strain against mu on the plane is the calibration; the strain found on a
curved object of mu = 0.25 is put into it, as a sensor that knows the force and not the shape would.

Checked: a bar of radius 1e5 mm is the plane; the calibration is monotonic, since it is inverted; and what is read
hardly changes when the edge length or the number of increments is halved.  On bars of 400 to 30 mm, 0.28 to 0.32 is
read instead of 0.25.  In 3D, 20 mm wide, friction points mostly along the width: there the shape moves this gauge's
strain more than friction does, so its calibration must be made on the object's own shape.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.optimize import brentq

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Gauge, Leg
from finger3d.objects import Cylinder, Plane, RigidObject

from ._press import changed, fig9_model, measured
from ._rows import Result, Row, listed

judged = listed(__file__)

FORCE = 200.0  # N over 20 mm: some 5 mm deep on the plane
TRUE = 0.25
GAUGE = Gauge("g36", 36.0, 40.0, 0.0, np.deg2rad(30.0))


def finger(obj: RigidObject, size: float, solid: bool = False) -> Problem:
    """The Fig. 9 finger under an object, deep enough for the force on any of them."""
    domain, legs = "solid" if solid else "plane-strain", (Leg(14.0, steps=1),)
    return build(fig9_model(0.49, size, 4.0 * size, domain, legs=legs, object=obj, gauges=(GAUGE,)))


def at_force(problem: Problem, mu: float, steps: int) -> tuple[float, float, float]:
    """Depth (mm), strain of the gauge and half the contact length (mm) where the force reaches FORCE."""

    def pressed(depth: float) -> dict[str, Any]:
        return measured(changed(problem, friction=Coulomb(mu), legs=(Leg(depth, steps=steps),)))[-1]

    depth = brentq(lambda d: pressed(d)["normal_force_N"] - FORCE, 2.0, 14.0, rtol=1e-6)
    found = pressed(depth)
    return depth, found["gauges"]["g36"], found["contact_half_length_mm"]


def run(quick: bool) -> Result:
    """Strains over mu on the plane, one mu on every other object; all twice, on two meshes."""
    sizes, steps = ((3.0, 1.5), 4) if quick else ((1.0, 0.5), 80)
    mus = np.array([0.0, 0.06, 0.125, 0.25, 0.375, 0.5, 0.75, 1.0])
    if quick:
        mus = np.array([0.0, 0.25, 0.375, 0.5])  # on coarse meshes the strain is constant beyond
    radii = (100.0, 1e5) if quick else (30.0, 50.0, 70.0, 100.0, 140.0, 200.0, 400.0, 1e5)
    (coarse, _, rough), (calibration, found, read) = (_measured(size, steps, mus, radii) for size in sizes)
    fewer = _measured(sizes[0], steps // 2, mus, (100.0,))[2]
    curve = calibration[:, 1]
    true = float(np.interp(TRUE, mus, curve))
    monotonic = all(_is_monotonic(c[:, 1]) for c in (coarse, calibration))
    what = "mu read on a bar of radius 100 mm with the plane's calibration, true 0.25"
    words = {"what": what, "coarsest": sizes[0], "steps": steps, "value": steps // 2}
    rows = [
        judged("strain-on-a-bar-of-radius", found[1e5][1] / true),
        judged("calibration-on-the-plane-is-monotonic", float(monotonic)),
        judged("mu-read-on-a-bar-of", read[100.0], rough[100.0]),
        judged("mu-read-by-increments", rough[100.0], fewer[100.0], **words),
    ]
    rows += _solid_rows((4.0,) if quick else (3.0, 2.0), 4 if quick else 40)
    table = {
        "radius_mm": [np.inf] * len(mus) + list(radii),
        "mu": [*mus, *[TRUE] * len(radii)],
        "depth_mm": [*calibration[:, 0], *[f[0] for f in found.values()]],
        "strain": [*curve, *[f[1] for f in found.values()]],
        "contact_half_length_mm": [*calibration[:, 2], *[f[2] for f in found.values()]],
        "mu_read": [*mus, *read.values()],
    }
    return Result(tuple(rows), table, lambda figure: _draw(figure, mus, curve, found, read))


def _is_monotonic(curve: np.ndarray) -> bool:
    """Whether a curve nowhere turns back by more than 1e-6 of its range; the prescribed force is met to some 1e-8."""
    change = np.diff(curve) * np.sign(curve[-1] - curve[0])
    return bool((change > -1e-6 * np.ptp(curve)).all())


def _solid_rows(sizes: tuple[float, ...], steps: int) -> Iterator[Row]:
    """In 3D: what a bar of radius 100 mm does to the strain, over all that mu does to it on a plane."""
    found = []
    for size in sizes:
        plane, bar = finger(Plane(), size, True), finger(Cylinder(radius_mm=100.0), size, True)
        flat = [at_force(plane, mu, steps)[1] for mu in (0.0, TRUE, 1.0)]
        found.append((at_force(bar, TRUE, steps)[1] - flat[1], np.ptp(flat)))
    shape, friction = found[-1]
    yield judged("solid-over-friction", abs(shape) / friction)
    if len(found) > 1:
        yield judged("solid-by-mesh", 1e3 * shape, 1e3 * found[0][0], coarsest=sizes[0])


def _measured(
    size: float, steps: int, mus: np.ndarray, radii: tuple[float, ...]
) -> tuple[np.ndarray, dict[float, tuple[float, float, float]], dict[float, float]]:
    """Calibration (m, 3) on the plane, what is found on the bars, and the coefficients read."""
    plane = finger(Plane(), size)
    calibration = np.array([at_force(plane, float(mu), steps) for mu in mus])
    found = {radius: at_force(finger(Cylinder(radius_mm=radius), size), TRUE, steps) for radius in radii}
    return calibration, found, {r: _read(calibration[:, 1], mus, strain) for r, (_, strain, _) in found.items()}


def _read(curve: np.ndarray, mus: np.ndarray, strain: float) -> float:
    """Coefficient that the calibration gives for a strain; nan out of its range."""
    order = np.argsort(curve)
    return float(np.interp(strain, curve[order], mus[order], left=np.nan, right=np.nan))


def _draw(figure: Any, mus: np.ndarray, curve: np.ndarray, found: dict[float, Any], read: dict[float, float]) -> None:
    left, right = figure.subplots(1, 2)
    left.plot(mus, 1e3 * curve, "ko-", ms=4, label="plane: the calibration")
    kept = sorted(r for r in found if r < 1e4)
    strains = [1e3 * found[r][1] for r in kept]
    left.plot([TRUE, TRUE], [min(strains), max(strains)], "C0_-", ms=12, label="bars of 30 to 400 mm")
    left.set(xlabel="mu", ylabel="strain of g36, 1e-3", title="200 N over 20 mm, plane strain")
    right.plot([100.0 / r for r in kept], [read[r] for r in kept], "s-", label="with the plane's calibration")
    right.plot([0.0], [TRUE], "ko", label="plane")
    right.axhline(TRUE, color="k", ls="--", lw=1.0, label="true")
    right.set(xlabel="100 mm / radius of the bar (the finger's is 100 mm)", ylabel="mu read", ylim=(0.0, None))
    right.set_title("a sensor that knows the force, not the shape")
