"""Is a solid with held ends the plane-strain section, is half of it half, and do two meshers agree?

Three ways to the same number, on the paper's Fig. 9 finger (R = 100, 20 mm wide) pressed 10 mm with mu = 0.25: a solid
whose end faces may not move along z is in plane strain (3D against 2D); a scene that is its own mirror image may be
solved whole, half or by a quarter; and the structured and the unstructured mesher fill the same body.  Source: these
are identities (validation/REFERENCES.md, 7.2).

Expected rate: at the edge of the bonded base the displacement goes as r^e (Williams 1952), so the force converges as
h^(2e), 1.2 at nu = 0.49; contact adds an error of second order.  Errors are taken against the section's force
extrapolated with that rate, as the root mean square over 5 depths.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Leg, MeshOptions, Model

from ._common import convergence, rate
from ._corner import clamped_free, extrapolated
from ._press import fig9_finger, measured
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)

STEPS = 5


def press(size: float, nu: float, mesher: str = "swept", **changes: Any) -> list[dict[str, Any]]:
    """Numbers of every increment."""
    mesh, legs = MeshOptions(size, 2.0 * size, mesher), (Leg(10.0, steps=STEPS),)
    problem = build(Model(fig9_finger(), Isotropic(1.0, nu), mesh, legs, friction=Coulomb(0.25), **changes))
    return measured(problem)


def forces(size: float, nu: float, **changes: Any) -> Float:
    """Normal forces (N) of every increment."""
    return np.array([step["normal_force_N"] for step in press(size, nu, **changes)])


def run(quick: bool) -> Result:
    """Sections and held solids of three sizes and more, mirror images, two meshers."""
    flat = (4.0, 2.0, 1.0) if quick else (4.0, 2.0, 1.0, 0.5, 0.25)
    deep = (8.0, 6.0, 4.0) if quick else (8.0, 4.0, 2.0)
    rows, table, curves = [], [], {}
    for nu in (0.3, 0.49):
        theory = 2.0 * clamped_free(np.pi / 2, nu)
        sections = [forces(s, nu, domain="plane-strain") for s in flat]
        limit = np.array([extrapolated(c, f, theory) for c, f in zip(sections[-2], sections[-1], strict=True)])
        solids = [forces(s, nu, held_ends=True) for s in deep]
        same = forces(deep[-1], nu, domain="plane-strain")
        for which, of in (("on the same cells", same), ("extrapolated", limit)):
            rows.append(judged("force-with-held-ends", solids[-1][-1] / of[-1], nu=nu, size=deep[-1], which=which))
        curves[nu] = {}
        for dim, sizes, found in (("section", flat, sections), ("held solid", deep, solids)):
            errors = np.array([np.sqrt(np.mean((f / limit - 1.0) ** 2)) for f in found])
            curves[nu][dim] = np.array(sizes), errors
            table += [(dim, nu, s, f[-1], e) for s, f, e in zip(sizes, found, errors, strict=True)]
            if dim == "section" and quick:
                continue  # two of its three sizes make the limit
            last = slice(-5, -2) if dim == "section" else slice(None)
            rows.append(judged("rate-of-the-force", rate(sizes[last], errors[last]), theory, dim=dim, nu=nu))
    rows += _mirrors(6.0)
    if not quick:
        both = [press(2.0, 0.49, mesher)[-1]["normal_force_N"] for mesher in ("swept", "ftetwild")]
        rows.append(judged("force-by-ftetwild", both[1] / both[0]))
    names = "body nu size_mm force_N rms_error"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, curves))


def _mirrors(size: float) -> Iterator[Row]:
    """Whole and both halves against the quarter, which is the mirror image of nothing."""
    quarter = press(size, 0.49, symmetry=("x", "z"))[-1]
    for name, planes in (("half by x", ("x",)), ("half by z", ("z",)), ("whole", ())):
        other = press(size, 0.49, symmetry=planes)[-1]
        away = max(abs(other[k] / quarter[k] - 1.0) for k in ("normal_force_N", "friction_sum_N", "dissipation_mJ"))
        yield judged("mirror-image", away, name=name)


def draw(figure: Any, curves: dict[float, dict[str, tuple[Float, Float]]]) -> None:
    """Errors over the cell size."""
    for (nu, both), axes in zip(curves.items(), figure.subplots(1, 2), strict=True):
        theory = 2.0 * clamped_free(np.pi / 2, nu)
        labels = "cell size at the contact, mm", "force, relative to the limit, rms over depths"
        for name, (sizes, errors) in both.items():
            convergence(axes, sizes, {name: errors}, theory, *labels)
        ticks = sorted({s for sizes, _ in both.values() for s in sizes})
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.set_title(f"Fig. 9 finger, plane strain, nu = {nu:g}")
