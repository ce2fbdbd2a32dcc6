"""The two panels of pictures of a finger, contact pressure and status: their frames, colours, keys and outlines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d._types import Float, Int
from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK
from finger3d.fem.mesh import Mesh
from finger3d.geometry.design import Design
from finger3d.plotting.layout import WIDEST, blank, head
from finger3d.plotting.solid import BODY, COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from matplotlib.path import Path


CMAP = "viridis"  # of the contact pressure


def patches(colours: dict[int, str], states: Sequence[int]) -> list[Patch]:
    """Return legend entries of contact states."""
    from matplotlib.patches import Patch

    return [Patch(facecolor=colours[s], edgecolor="#888888", lw=0.5, label=STATUS_NAMES[s]) for s in states]


def two_panels(aspect: float, title: str, ticks: bool = False) -> tuple[Figure, list[Axes]]:
    """Return a figure with two panels of equal scale, with space for a legend below them.

    Parameters
    ----------
    aspect : height over width of a panel
    title : title of the figure
    ticks : reserve space for tick labels
    """
    width, panel, below = 2.0 * WIDEST, WIDEST - (0.8 if ticks else 0.2), 1.4 if ticks else 0.95
    above = 0.85 if title else 0.45
    high = panel * aspect
    figure = blank(width, below + high + above)
    total = below + high + above
    panels = []
    for left, name in ((width / 2 - panel - 0.1, "contact pressure"), (width - panel - 0.1, "stick and slip")):
        axes = figure.add_axes((left / width, below / total, panel / width, high / total))
        axes.set_title(name, fontsize=11)
        axes.set_aspect("equal")
        panels.append(axes)
    head(figure, title, 13.0, 0.12)
    return figure, panels


def keys(figure: Figure, highest: float, lines: dict[str, str]) -> None:
    """Draw the colour bar of the pressure below the left panel, and the legend below the right one.

    Parameters
    ----------
    figure : figure from `two_panels`
    highest : upper end of the pressure scale, MPa
    lines : name -> colour of further lines in the legend
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.lines import Line2D

    inch = 1.0 / figure.get_figheight()
    bar = figure.add_axes((0.10, 0.62 * inch, 0.3, 0.16 * inch))
    figure.colorbar(ScalarMappable(Normalize(0.0, highest), CMAP), cax=bar, orientation="horizontal")
    bar.set_xlabel("contact pressure (MPa)")
    handles = patches(COLOURS, (STICK, SLIP, OPEN)) + [Line2D([], [], color=c, label=n) for n, c in lines.items()]
    place: dict[str, Any] = {"loc": "center", "bbox_to_anchor": (0.75, 0.6 * inch), "ncols": len(handles)}
    figure.legend(handles=handles, frameon=False, fontsize=11, columnspacing=1.4, **place)


def sliced(triangles: Float) -> Float:
    """Return the segments (s, 2, 2), x and y, in which triangles (t, 3, 3) meet the plane z = 0."""
    z = triangles[:, :, 2]
    cut = triangles[(z.min(axis=1) < 0.0) & (z.max(axis=1) >= 0.0)]
    ends = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        a, b = cut[:, i], cut[:, j]
        crosses = (a[:, 2] < 0.0) != (b[:, 2] < 0.0)
        share = a[:, 2] / np.where(crosses, a[:, 2] - b[:, 2], 1.0)
        ends.append(np.where(crosses[:, None], a[:, :2] + share[:, None] * (b - a)[:, :2], np.nan))
    found = np.stack(ends, axis=1)
    return np.asarray(found[np.isfinite(found[:, :, 0])].reshape(-1, 2, 2))


def palette() -> Float:
    """Return the RGB colours of open, stick and slip, shape (3, 3)."""
    from matplotlib.colors import to_rgb

    return np.array([to_rgb(COLOURS[s]) for s in (OPEN, STICK, SLIP)])


def pressure_colours(values: Float, highest: float, status: Int) -> Float:
    """Return RGB colours (..., 3) of pressures (...), in MPa; the colour of the body where the status (...) is open."""
    import matplotlib
    from matplotlib.colors import to_rgb

    colours = matplotlib.colormaps[CMAP](values / highest)[..., :3]
    return np.where((status != OPEN)[..., None], colours, np.array(to_rgb(BODY)))


def highest_of(pressure: Float) -> float:
    """Return the upper end of the pressure scale, MPa; 1 if nothing is in contact."""
    return float(pressure.max(initial=0.0)) or 1.0


_MOST_CELLS = 4000  # of a mesh whose edges are drawn; those of a finer mesh would merge into a grey area


def _runs(lines: Float) -> Path:
    """Return one path of k separate polylines, shape (k, p, 2): far faster to draw than k artists."""
    from matplotlib.path import Path

    codes = np.full(lines.shape[:2], Path.LINETO)
    codes[:, 0] = Path.MOVETO
    return Path(lines.reshape(-1, 2), codes.ravel())


def edges_of(mesh: Mesh, moved: Float) -> Path:
    """Return every edge of the cells once, at nodes moved to (n, 2) mm; an empty path for a very fine mesh."""
    if len(mesh.cells) > _MOST_CELLS:
        return _runs(np.zeros((0, 2, 2)))
    edges = _sides(mesh)
    ends = np.sort(edges[:, [0, -1]], axis=1)
    return _runs(moved[edges[np.unique(ends, axis=0, return_index=True)[1]]])


def interfaces_of(mesh: Mesh, moved: Float) -> Path:
    """Return the edges between the parts of a section, at nodes moved to (n, 2) mm; an empty path for one part."""
    edges = _sides(mesh)
    if mesh.part is None:
        return _runs(moved[edges[:0]])
    part = np.repeat(mesh.part, 3)
    _, first, number = np.unique(np.sort(edges[:, [0, -1]], axis=1), axis=0, return_index=True, return_inverse=True)
    between = np.zeros(len(first), dtype=np.bool_)
    number = number.ravel()
    np.logical_or.at(between, number, part != part[first[number]])
    return _runs(moved[edges[first[between]]])


def _sides(mesh: Mesh) -> Int:
    """Return the nodes (3 e, 2 or 3) along the edges of all cells, in order."""
    sides = mesh.element.edges
    if mesh.element.is_quadratic:
        sides = np.insert(sides, 1, range(3, 6), axis=1)
    return np.asarray(mesh.cells[:, sides].reshape(-1, len(sides[0])))


def outline_of(mesh: Mesh, moved: Float) -> Path:
    """Return the boundary of a section as a closed path, at nodes moved to (n, 2) mm."""
    from matplotlib.path import Path

    facets = np.concatenate([f for f in mesh.facets.values() if len(f)])
    facets = facets[:, [0, 2, 1]] if mesh.element.is_quadratic else facets
    following = {int(a): i for i, a in enumerate(facets[:, 0])}
    ring = [0]
    while (after := following[int(facets[ring[-1], -1])]) != 0:
        ring.append(after)
    return Path(np.concatenate([moved[facets[ring, :-1]].reshape(-1, 2), moved[facets[:1, 0]]]), closed=True)


def middle_section(design: Design, count: int = 201) -> Float:
    """Return the closed outline (k, 2), mm, of the section of a finger at z = 0, with `count` points on its top."""
    half = design.half_length_mm
    x = np.linspace(-half, half, count)
    return np.column_stack([[-half, *x, half, -half], [0.0, *np.nan_to_num(design.top(x, np.zeros_like(x))), 0.0, 0.0]])
