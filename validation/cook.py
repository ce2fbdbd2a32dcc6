"""Does Cook's membrane come out right from compressible to incompressible, where linear elements lock?

Source: Cook 1974, with the values of validation/REFERENCES.md, 5.4.  A tapered panel, 48 mm long, 44 and 16 mm high, is
clamped on the left and sheared on the right; the deflection at (48, 52) is compared.

Expected rate: at the upper clamped corner (108.4 degrees) the displacement goes as r^e (Williams 1952), so a deflection
converges as h^(2e), 1.09 at nu = 1/2.  The value compared is extrapolated with that rate; a mesh graded towards the
corner, without extrapolation, must agree with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh import Mesh

from ._common import box, convergence, cube, held_at, mapped, side_load, solve
from ._corner import clamped_free, extrapolated
from ._rows import Result, exact_columns, listed

judged = listed(__file__)

CORNER = np.pi / 2 + np.arctan2(16.0, 48.0)


@dataclass(frozen=True)
class Panel:
    """A case: constants, force per thickness, published deflection (mm)."""

    E_MPa: float
    nu: float
    force: float
    wanted: float
    plane_stress: bool = False

    @property
    def elastic(self) -> Elasticity:
        """Constants as the code takes them."""
        return Elasticity.of(self.E_MPa, self.nu, self.plane_stress)

    @property
    def rate(self) -> float:
        """Rate that theory gives."""
        return 2.0 * clamped_free(CORNER, self.nu, self.plane_stress)

    @property
    def name(self) -> str:
        """For a reader."""
        return f"{'plane stress' if self.plane_stress else 'plane strain'}, nu = {self.nu:.4g}"


PANELS = (
    Panel(1.0, 1 / 3, 1.0, 23.967, plane_stress=True),
    Panel(250.0, 0.3, 100.0, 8.778),
    Panel(250.0, 0.49, 100.0, 7.493),
    Panel(250.0, 0.4999, 100.0, 7.403),
    Panel(250.0, 0.5, 100.0, 7.4025),
)


def taper(p: Float) -> Float:
    """The panel from the unit square."""
    x, y = p.T
    return np.stack([48.0 * x, 44.0 * x + y * (44.0 - 28.0 * x)], axis=1)


def deflection(flat: Mesh, panel: Panel, elastic: Elasticity | None = None) -> float:
    """Deflection (mm) at (48, 52) from a mesh of the unit square."""
    mesh = mapped(flat, taper) if elastic is None else Mesh(taper(flat.points), flat.cells, flat.facets)
    load = side_load(mesh, "x+", lambda p: np.tile([0.0, panel.force / 16.0], (len(p), 1)))
    u = solve(mesh, elastic or panel.elastic, held_at(mesh, {"x-": (0, 1)}), 0.0, load).u
    return float(u[np.argmin(np.linalg.norm(mesh.points - [48.0, 52.0], axis=1)), 1])


def towards_corner(size: float) -> Mesh:
    """Unit square with cells of `size`, and 1e-5 at the upper left corner; a vertex at the middle of the right side."""
    x, y = _from_corner(1.0, size), 0.5 * _from_corner(1.0, 2.0 * size)
    return box([x, np.concatenate([np.linspace(0.0, 0.5, round(0.5 / size) + 1)[:-1], 1.0 - y[::-1]])])


def _from_corner(length: float, size: float) -> Float:
    """Coordinates from 0 to `length`: steps that grow by half until they are `size`."""
    fine = np.cumsum(1e-5 * 1.5 ** np.arange(np.log(size / 1e-5) / np.log(1.5)))
    return np.concatenate([[0.0], fine[:-1], np.linspace(fine[-1], length, round((length - fine[-1]) / size) + 1)])


def run(quick: bool) -> Result:
    """Uniform meshes of three and more sizes, one graded, and linear triangles for contrast."""
    counts = (12, 24, 48) if quick else (16, 32, 64, 128)
    rows, table, errors = [], [], {}
    panels = tuple(p for p in PANELS if not quick or p.nu not in (0.49, 0.4999))
    for panel in panels:
        found = [deflection(cube(2, n), panel) for n in counts]
        limit = extrapolated(found[-2], found[-1], panel.rate)
        corner = deflection(towards_corner(1 / 12 if quick else 1 / 32), panel)
        steps = np.diff(found)
        errors[panel.name] = [abs(v / limit - 1.0) for v in found]
        table += [(panel.name, n, v) for n, v in zip(counts, found, strict=True)]
        rows += [
            judged("deflection", limit, panel.wanted, name=panel.name),
            judged("extrapolated-against-graded", limit, corner, name=panel.name),
            judged("rate-of-the-deflection", np.log2(steps[-2] / steps[-1]), panel.rate, name=panel.name),
        ]
    rows += [judged("linear-triangles", _of_linear(0.3)), judged("linear-triangles-lock", _of_linear(0.4999))]
    names = "case cells_per_side deflection_mm"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, counts, errors))


def _of_linear(nu: float) -> float:
    """Error of linear triangles, which must fail at nu near 1/2, or the benchmark shows nothing."""
    panel = next(p for p in PANELS if p.nu == nu)
    return abs(deflection(cube(2, 24), panel, Elasticity.of(250.0, nu, mixed=False)) / panel.wanted - 1.0)


def draw(figure: Any, counts: tuple[int, ...], errors: dict[str, list[float]]) -> None:
    """Errors over the cell size."""
    least = min(p.rate for p in PANELS if p.name in errors)
    labels = "cell size / side", "error of the deflection, relative to the extrapolated"
    convergence(figure.subplots(), 1.0 / np.array(counts), errors, least, *labels)
