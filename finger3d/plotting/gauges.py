"""Positions of the gauges in a deformed finger, and their marks in a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from finger3d.mechanics.readings import Gauge


COLOUR = "#b0006a"
"""Colour of gauges in all pictures."""

_POINT_LENGTH = 0.06  # drawn length of a gauge of length zero, relative to the largest extent of the body
_BISECTIONS = 8  # of the distance to the surface, which is then known to 0.4 %
_BULGE = 0.2  # enlargement of the bounding boxes of cells, relative to their size: curved cells bulge


@dataclass(frozen=True)
class Mark:
    """A gauge as a line of three points, each a weighted mean of nodes, which follows the deformation.

    Attributes
    ----------
    label : name and angle
    nodes, weights : (3, k) arrays
        Nodes and weights of start, middle and end. An end outside the body is replaced by the middle.
    """

    label: str
    nodes: Int
    weights: Float

    def of(self, values: Float) -> Float:
        """Interpolate nodal values, shape (n, ...), at the three points, shape (3, ...)."""
        found: Float = np.einsum("pk,pk...->p...", self.weights, values[self.nodes])
        return found


def marks_of(mesh: Mesh, gauges: Sequence[Gauge], near: bool = False) -> tuple[Mark, ...]:
    """Return the marks of the gauges that lie in the body.

    Parameters
    ----------
    mesh : undeformed mesh of the whole finger (unfolded, if symmetry was used), mm
    gauges : gauges of the scene
    near : project each gauge along +z onto the surface, where it is visible from outside
    """
    if not gauges:
        return ()
    size, front = float(np.ptp(mesh.points, axis=0).max()), float(mesh.points[:, -1].max())
    corners = mesh.points[mesh.cells[:, : mesh.dim + 1], :2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    slack = _BULGE * (high - low).max(axis=1, keepdims=True)
    marks = []
    for gauge in gauges:
        middle, along = gauge.middle[: mesh.dim], gauge.direction[: mesh.dim]
        half = 0.5 * (gauge.length_mm or _POINT_LENGTH * size)
        # A search of all cells for every point would take as long as the drawing.
        candidates = np.all((low - slack <= middle[:2] + half) & (middle[:2] - half <= high + slack), axis=1)
        part = Mesh(mesh.points, mesh.cells[candidates], {})
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
    """Project a point (3,) along z onto the surface by bisection, between its own z and `outside`."""
    from finger3d.fem.mesh import cells_at

    inside = point[2]
    if cells_at(mesh, np.array([*point[:2], outside])):
        inside = outside
    for _ in range(_BISECTIONS if inside < outside else 0):
        half = 0.5 * (inside + outside)
        inside, outside = (half, outside) if cells_at(mesh, np.array([*point[:2], half])) else (inside, half)
    return np.array([*point[:2], inside])


def _weights(mesh: Mesh, point: Float) -> tuple[Int, Float] | None:
    """Return the nodes and weights (k,) that interpolate at a point, or None outside the body."""
    # Imported here because a process that only draws marks does not need SciPy.
    from finger3d.fem.mesh import cells_at

    found = cells_at(mesh, point)
    if not found:
        return None
    cell, bary = found[0]
    return mesh.cells[cell], mesh.element.shape(bary[None])[0]


def draw_marks(axes: Axes, marks: Sequence[tuple[str, Float]]) -> None:
    """Draw gauges, each given by its label and its line (3, 2), in mm, with a dot and the label at its middle."""
    from matplotlib.patheffects import withStroke

    edge = withStroke(linewidth=2.5, foreground="#ffffff")
    below: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "top", "path_effects": [edge]}
    for label, line in marks:
        axes.plot(*line.T, color=COLOUR, lw=2.0, marker="o", markevery=[1], ms=4, solid_capstyle="butt", zorder=5)
        axes.annotate(label, line[1], (0, -7), color=COLOUR, fontsize=10, zorder=6, **below)
