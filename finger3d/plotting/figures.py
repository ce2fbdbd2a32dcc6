"""Pictures of a press, drawn without a display: contact tractions, force against depth, displacements of markers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d._types import Float, Int
from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK
from finger3d.fem.mesh import CONTACT, FREE_FACES
from finger3d.plotting.layout import WIDEST, finish, sheet
from finger3d.plotting.panels import CMAP, patches
from finger3d.plotting.solid import COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch


_FEWEST_ON_LINE = 5
_MOST_MARKERS = 40  # increments that are marked on a curve
_ON_LINE = 1e-6
"""Distance from a line z = const, in half widths, below which a point lies on it."""

_NO_FORCE = 1e-6  # share of the normal force below which a force is not drawn: round-off

_MAP_MARGINS, _MOST_ASPECT = (0.8, 1.1, 0.55, 0.45), 1.6  # of a flat map: inches; height over width, or the inverse

_SHADES = {STICK: "#c9d9ee", SLIP: "#fde3c4"}


def middle_line(
    table: Mapping[str, ArrayLike], band_mm: float, half_width_mm: float | None
) -> tuple[float, NDArray[np.intp]]:
    """Return the points of the contact face that a picture along x shows: on z = 0, or near it where hardly any is.

    Parameters
    ----------
    table : columns of contact.csv
    band_mm : largest distance from z = 0 where the mesh has hardly any points on it
    half_width_mm : half the width of a solid; None for a section, all of whose points are on the line

    Returns
    -------
    z_mm, points : the place of the line, that of the largest pressure if no point is near z = 0, and numbers of points
        (n,), ascending in x
    """
    x, z = _column(table, "x_mm"), _column(table, "z_mm")
    top = _on_contact_face(table)
    at, points = 0.0, np.flatnonzero(top)
    if half_width_mm is not None:
        # a mesh has points on its middle only if that is a plane of symmetry
        points = np.flatnonzero(top & (np.abs(z) <= _ON_LINE * half_width_mm))
        if len(points) < _FEWEST_ON_LINE:
            points = np.flatnonzero(top & (np.abs(z) <= band_mm))
        if not len(points):
            at = float(z[top][np.argmax(_column(table, "pressure_MPa")[top])])
            points = np.flatnonzero(top & (np.abs(z - at) <= band_mm))
    return at, points[np.argsort(x[points], kind="stable")]


def _on_contact_face(table: Mapping[str, ArrayLike]) -> NDArray[np.bool_]:
    """Return which points are on the contact face; all if none is."""
    top: NDArray[np.bool_] = np.asarray(table["face"]) == FREE_FACES[CONTACT]
    return top if top.any() else ~top


def contact_figure(
    path: str | Path,
    table: Mapping[str, ArrayLike],
    mu: ArrayLike,
    band_mm: float | None = None,
    half_width_mm: float | None = None,
) -> None:
    """Draw tractions f_n and f_t and the friction limit mu f_n along x, with stick and slip zones (Maeno 2004, Fig. 4).

    Only the points of the contact face are drawn.

    Parameters
    ----------
    path : PNG file to write
    table : columns of contact.csv, each (c,); face, places, pressure_MPa, shear_x_MPa, shear_z_MPa and status are used
    mu : scalar or (c,) array
        Coefficient of static friction.
    band_mm : largest distance from z = 0 of the points that represent that line if the mesh has no points on it;
        default 0.4 times the typical distance of neighbouring points
    half_width_mm : half the width of a solid, which adds a panel for its end z = half_width_mm; None for a 2D model
    """
    x, z, status = _column(table, "x_mm"), _column(table, "z_mm"), _status(table)
    if band_mm is None:
        band_mm = 0.4 * _spacing(x, z)
    at, points = middle_line(table, band_mm, half_width_mm)
    lines = [("", points)]
    if half_width_mm is not None:
        lines = [("in the middle, z = 0" if at == 0.0 else f"near z = {at:.3g} mm", points)]
        # a mesh always has points on its end
        end = np.flatnonzero(_on_contact_face(table) & (np.abs(z - half_width_mm) <= _ON_LINE * half_width_mm))
        if len(end):
            lines.append((f"at the end, z = {half_width_mm:g} mm", end[np.argsort(x[end], kind="stable")]))
    tractions = (_column(table, name) for name in ("pressure_MPa", "shear_x_MPa", "shear_z_MPa"))
    columns = [x, *tractions, np.broadcast_to(np.asarray(mu, dtype=np.float64), x.shape)]
    made = sheet(len(lines), 1, (WIDEST, 4.4), (0.95, 0.15, 1.25, 0.35))
    for axes, (where, on) in zip(made.axes, lines, strict=True):
        _contact_line(axes, [column[on] for column in columns], status[on])
        axes.set_title(where, fontsize=10, loc="left")
        axes.set_ylabel("traction on the finger (MPa)")
        axes.set_xlabel("x at rest (mm)")
    reach = max(axes.get_xlim()[1] for axes in made.axes)
    for axes in made.axes:
        axes.set_xlim(-reach, reach)
    made.save(path)


def force_figure(path: str | Path, steps: Sequence[Mapping[str, object]]) -> None:
    """Draw forces (N) and half extents (mm) of contact and stick zone against depth and, if there are any, slides (mm).

    Parameters
    ----------
    path : PNG file to write
    steps : the ``steps`` of summary.json
    """

    def values(key: str) -> Float:
        return np.array([step.get(key, 0.0) for step in steps], dtype=np.float64)

    names = {"depth_mm": "depth (mm)"} | {
        f"slide_{axis}_mm": f"slide of the object along {axis} (mm)"
        for axis in "xz"
        if values(f"slide_{axis}_mm").any()
    }
    normal = values("normal_force_N")
    rows = {
        "force on the finger (N)": [
            ("normal force", "#222222", normal),
            ("friction sum", "#c0392b", values("friction_sum_N")),
            ("net friction along x", "#2c5f9e", values("tangential_force_x_N")),
            ("net friction along z", "#3c8d4f", values("tangential_force_z_N")),
        ],
        "half extent along x at z = 0 (mm)": [
            ("contact", "#555555", values("contact_half_length_mm")),
            ("stick", COLOURS[STICK], values("stick_half_length_mm")),
        ],
    }
    made = sheet(2 * len(names), max(2, len(names)), (WIDEST, 4.4), (0.8, 0.15, 0.55, 0.15))
    cells = [(name, unit) for unit in rows for name in names]
    mark = "o-" if len(steps) <= _MOST_MARKERS else "-"
    for axes, (name, unit) in zip(made.axes, cells, strict=True):
        for label, colour, curve in rows[unit]:
            if len(rows[unit]) == 2 or np.abs(curve).max() > _NO_FORCE * np.abs(normal).max():
                axes.plot(values(name), curve, mark, color=colour, ms=4, label=label)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, 0.0), 1.25 * high)  # room for the legend
        finish(axes, names[name], unit, loc="upper left", ncols=2)
    made.save(path)


def map_figure(path: str | Path, table: Mapping[str, ArrayLike]) -> None:
    """Draw the contact of a solid along the press axis: pressure with arrows of the friction, and stick and slip.

    Parameters
    ----------
    path : PNG file to write
    table : columns of contact.csv
    """
    from matplotlib.tri import Triangulation

    top = _on_contact_face(table)
    x, z, pressure, shear_x, shear_z = (
        _column(table, name)[top] for name in ("x_mm", "z_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa")
    )
    status, spacing = _status(table)[top], _spacing(x, z)
    touches = status != OPEN if np.any(status != OPEN) else np.ones(len(x), dtype=bool)
    (x0, x1), (z0, z1) = ((v[touches].min(), v[touches].max()) for v in (x, z))
    wide, tall = x1 - x0 + 3.0 * spacing, z1 - z0 + 3.0 * spacing
    wide, tall = max(wide, tall / _MOST_ASPECT), max(tall, wide / _MOST_ASPECT)
    left, right, below, above = _MAP_MARGINS
    height = (WIDEST - left - right) * tall / wide
    made = sheet(2, 2, (WIDEST, height + below + above), _MAP_MARGINS)
    for axes, title in zip(made.axes, ("pressure, and friction on the finger", "stick and slip"), strict=True):
        axes.set_aspect("equal")
        axes.set(xlim=(x0 + x1 + np.array([-wide, wide])) / 2.0, ylim=(z0 + z1 + np.array([-tall, tall])) / 2.0)
        axes.set_title(title, fontsize=11, loc="left")
        finish(axes, "x at rest (mm)", "z at rest (mm)")
    first, second = made.axes
    mesh = Triangulation(x, z)
    mesh.set_mask(~touches[mesh.triangles].any(axis=1))
    colours = first.tripcolor(mesh, pressure, shading="gouraud", cmap=CMAP, vmin=0.0)
    bar = first.inset_axes((1.03, 0.0, 0.04, 1.0))
    made.figure.colorbar(colours, cax=bar).set_label("contact pressure (MPa)")
    largest = float(np.hypot(shear_x, shear_z).max())
    if largest > 0.0:
        at = np.flatnonzero(touches)
        arrows = first.quiver(
            x[at], z[at], shear_x[at], shear_z[at], color="#c0392b", scale=12.0 * largest, width=0.004
        )
        value = _round(largest)
        first.quiverkey(arrows, 0.82, 1.0 + 0.13 / height, value, f"{value:g} MPa", labelpos="E")
    for state in (OPEN, STICK, SLIP):
        mine = status == state
        second.plot(x[mine], z[mine], "o", ms=4, color=COLOURS[state])
    second.legend(handles=patches(COLOURS, (STICK, SLIP, OPEN)), loc="lower right", bbox_to_anchor=(1.0, 1.0),
                  ncols=3, frameon=False, borderaxespad=0.0, borderpad=0.2)  # fmt: skip
    made.save(path)


# --- shared -------------------------------------------------------------------------------------------------------


def _column(table: Mapping[str, ArrayLike], name: str) -> Float:
    return np.asarray(table[name], dtype=np.float64)


def _status(table: Mapping[str, ArrayLike]) -> Int:
    """Return the contact status (c,) as integers."""
    return np.array([STATUS_NAMES.index(name) for name in np.asarray(table["status"]).tolist()], dtype=np.int64)


def _spacing(x: Float, z: Float) -> float:
    """Return the median distance of nearest neighbours in the x-z plane, mm."""
    from scipy.spatial import KDTree

    points = np.column_stack([x, z])
    return float(np.median(KDTree(points).query(points, k=2)[0][:, 1])) if len(points) > 1 else 0.0


# --- contact tractions --------------------------------------------------------------------------------------------


def zones(x: Float, status: Int) -> list[tuple[float, float, int]]:
    """Return intervals (start, end, status) of equal status along ascending x; they meet midway between points."""
    if len(x) == 0:
        return []
    change = np.flatnonzero(np.diff(status))
    middle = 0.5 * (x[change] + x[change + 1])
    ends = np.concatenate([[x[0]], middle, [x[-1]]])
    first = np.concatenate([[0], change + 1])
    return [(float(a), float(b), int(status[i])) for a, b, i in zip(ends[:-1], ends[1:], first, strict=True)]


def _contact_line(axes: Axes, columns: Sequence[Float], status: Int) -> None:
    """Draw x, pressure, friction along x and z, mu, and status (n,) at the points of a line z = const."""
    from matplotlib.lines import Line2D

    x, fn, fx, fz, mu = columns
    for start, end, state in zones(x, status):
        if state in _SHADES:
            axes.axvspan(start, end, color=_SHADES[state], lw=0)
    axes.axhline(0.0, color="#999999", lw=0.8)
    axes.plot(x, fn, "-", color="#222222", lw=1.6)
    axes.plot(x, mu * fn, "--", color="#777777", lw=1.2)
    axes.plot(x, -mu * fn, "--", color="#777777", lw=1.2)
    axes.plot(x, fx, "o-", color="#c0392b", lw=1.2, ms=3)
    handles: list[Line2D | Patch] = [
        Line2D([], [], color="#222222", lw=1.6, label="fₙ, pressure"),
        Line2D([], [], color="#777777", ls="--", lw=1.2, label="± μ fₙ" if np.ptp(mu) else f"± μ fₙ, μ = {mu[0]:g}"),
        Line2D([], [], color="#c0392b", marker="o", ms=3, lw=1.2, label="fₜ along x"),
    ]
    shown = [fn, fx]
    if np.any(np.abs(fz) > 1e-6 * np.abs(fn).max(initial=0.0)):
        axes.plot(x, fz, ".:", color="#8e44ad", lw=1.0, ms=4)
        handles.append(Line2D([], [], color="#8e44ad", marker=".", ls=":", label="fₜ along z"))
        shown.append(fz)
    # The friction limit may leave the picture: with a large mu it would flatten the other curves.
    high = max([float(v.max(initial=0.0)) for v in shown] + [1e-12])
    low = min([float(v.min(initial=0.0)) for v in shown] + [-min(float(mu.max()), 0.5) * high])
    axes.set_ylim(1.12 * low, 1.12 * high)
    touching = np.flatnonzero(status != OPEN)
    if len(touching):
        reach = 1.15 * float(np.abs(x[touching]).max()) or float(np.abs(x).max()) or 1.0
        axes.set_xlim(-reach, reach)
    handles += patches(_SHADES, [s for s in (STICK, SLIP) if np.any(status == s)])
    finish(axes, handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=3, columnspacing=1.4)
    axes.grid(False, axis="x")


_MAGNIFIED = (1.0, 2.0, 5.0)  # times a power of ten
_LONGEST = 0.12  # of an arrow, over the extent of the markers
_MARKERS_WIDTH, _LEAST_HEIGHT = 8.4, 2.9  # inches
_MARKERS_MARGINS = (0.9, 1.4, 0.6, 0.45)
_MARKERS_CMAP = "viridis"


def marker_figure(path: Path, table: Mapping[str, ArrayLike]) -> None:
    """Draw the displacements after the last increment as magnified arrows; the colour is that along y.

    Markers of a solid are seen along the press axis, those of a section along z.

    Parameters
    ----------
    path : PNG file to write
    table : columns of markers.csv
    """
    step = np.asarray(table["step"])
    last = step == step.max()
    x, y, z = (np.asarray(table[f"{axis}_mm"], dtype=float)[last] for axis in "xyz")
    along = {axis: np.asarray(table[f"displacement_{axis}_mm"], dtype=float)[last] for axis in "xyz"}
    solid = bool(np.any(z != 0.0) or np.any(along["z"] != 0.0))
    across, moved, name = (z, along["z"], "z") if solid else (y, along["y"], "y")
    extent = max(float(np.ptp(x)), float(np.ptp(across)), 1.0)
    longest = float(np.hypot(along["x"], moved).max())
    factor = _round(_LONGEST * extent / longest) if longest > 0.0 else 1.0
    left, right, below, above = _MARKERS_MARGINS
    pad = 0.08 * extent
    shape = (float(np.ptp(across)) + 2.0 * pad) / (float(np.ptp(x)) + 2.0 * pad)
    height = max(_LEAST_HEIGHT, (_MARKERS_WIDTH - left - right) * shape + below + above)
    made = sheet(1, 1, (_MARKERS_WIDTH, height), _MARKERS_MARGINS)
    (axes,) = made.axes
    arrows = axes.quiver(
        x, across, factor * along["x"], factor * moved, along["y"], cmap=_MARKERS_CMAP, angles="xy", scale_units="xy",
        scale=1.0, width=0.0025, zorder=3,
    )  # fmt: skip
    axes.plot(x, across, "o", ms=2.0, color="#777777", zorder=2)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    depth = float(np.asarray(table["depth_mm"], dtype=float)[last][0])
    axes.set_title(f"markers at {depth:.4g} mm, displacements drawn {factor:g} times", fontsize=11)
    finish(axes, "x (mm)", f"{name} (mm)")
    bar = made.figure.colorbar(arrows, ax=axes, fraction=0.04, pad=0.02)
    bar.set_label("displacement along y (mm)")
    made.save(path)


def _round(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(f * power for f in _MAGNIFIED if f * power <= value * (1.0 + 1e-9)))
