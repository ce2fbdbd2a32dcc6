"""Where the gauges lie in a pressed finger, and how matplotlib marks them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from finger3d.fem.simplex import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from finger3d.mechanics.model import Gauge

Float = NDArray[np.float64]
Int = NDArray[np.int64]

COLOUR = "#b0006a"
_SHOWN = 0.06  # of the body's largest extent: what is drawn of a gauge without a length
_HALVINGS = 8  # of the distance to the surface: to 0.4 % of it


@dataclass(frozen=True)
class Mark:
    """A gauge as a line of three points, each a weighted mean of nodes, so that it moves with the body.

    Attributes
    ----------
    label : name and angle
    nodes, weights : (3, k) of start, middle and end; an end that would stick out of the body is at the middle
    """

    label: str
    nodes: Int
    weights: Float

    def of(self, values: Float) -> Float:
        """What nodal values (n, ...) are at the three points, (3, ...)."""
        return np.einsum("pk,pk...->p...", self.weights, values[self.nodes])


def marks_of(mesh: Mesh, gauges: Sequence[Gauge], near: bool = False) -> tuple[Mark, ...]:
    """Marks of gauges on the whole mesh; a gauge that is not in the body has none.

    Parameters
    ----------
    mesh : the whole finger at rest (unfolded, if symmetry was used), mm
    near : on the face that is next to a gauge along +z, for a solid that hides what is inside
    """
    if not gauges:
        return ()
    size, front = float(np.ptp(mesh.points, axis=0).max()), float(mesh.points[:, -1].max())
    corners = mesh.points[mesh.cells[:, : mesh.dim + 1], :2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = 0.2 * (high - low).max(axis=1, keepdims=True)  # for the bulge of curved cells
    marks = []
    for gauge in gauges:
        middle, along = gauge.middle[: mesh.dim], gauge.direction[: mesh.dim]
        half = 0.5 * (gauge.length_mm or _SHOWN * size)
        # to look through all cells for every point would take as long as drawing
        beside = np.all((low - slack <= middle[:2] + half) & (middle[:2] - half <= high + slack), axis=1)
        part = Mesh(mesh.points, mesh.cells[beside], {})
        points = [middle + sign * half * along for sign in (-1.0, 0.0, 1.0)]
        if near:
            points = [_near(part, point, front) for point in points]
        start, here, end = (_weights(part, point) for point in points)
        if here is None:
            continue
        ends = start or here, end or here
        nodes, weights = zip(ends[0], here, ends[1], strict=True)
        label = f"{gauge.name}, {round(math.degrees(gauge.angle), 6):g}°" + (f", z = {gauge.z_mm:g}" if near else "")
        marks.append(Mark(label, np.array(nodes), np.array(weights)))
    return tuple(marks)


def _near(mesh: Mesh, point: Float, outside: float) -> Float:
    """The point (3,) moved along z to the surface, where no other part of the body is before the z outside."""
    from finger3d.fem.locate import cells_at

    inside = point[2]
    if cells_at(mesh, np.array([*point[:2], outside])):
        inside = outside
    for _ in range(_HALVINGS if inside < outside else 0):
        half = 0.5 * (inside + outside)
        inside, outside = (half, outside) if cells_at(mesh, np.array([*point[:2], half])) else (inside, half)
    return np.array([*point[:2], inside])


def _weights(mesh: Mesh, point: Float) -> tuple[Int, Float] | None:
    # not above: a process that only draws marks needs no SciPy
    from finger3d.fem.locate import cells_at

    found = cells_at(mesh, point)
    if not found:
        return None
    cell, bary = found[0]
    return mesh.cells[cell], mesh.element.shape(bary[None])[0]


def draw_marks(axes: Axes, marks: Sequence[tuple[str, Float]]) -> None:
    """Draw gauges, label and line (3, 2), on flat axes, each with a dot in its middle and the label below."""
    from matplotlib.patheffects import withStroke

    for label, line in marks:
        axes.plot(*line.T, color=COLOUR, lw=2.0, marker="o", markevery=[1], ms=4, solid_capstyle="butt", zorder=5)
        axes.annotate(
            label, line[1], (0, -7), textcoords="offset points", ha="center", va="top", color=COLOUR, fontsize=10,
            zorder=6, path_effects=[withStroke(linewidth=2.5, foreground="#ffffff")],
        )  # fmt: skip
