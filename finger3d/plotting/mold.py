"""Exploded view of a mold and its steps of casting."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d._types import Float
from finger3d.geometry.surface import Triangles
from finger3d.plotting.layout import DPI, blank, save
from finger3d.plotting.renderer import Camera, Drawing, Polygons, rendering, viewer_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


COLOURS = {
    "half_a": "#9db4c8",
    "half_b": "#c9d9ee",
    "lid": "#8d8a84",
    "insert": "#6f4e7c",
    "sensor": "#f28e2b",
    "strips": "#222222",
    "silicone": "#f28e2b",
    "silicone_2": "#e15759",
    "silicone_3": "#4e79a7",
}
"""Colours of parts by their kind."""

OPACITY = {"half_b": 0.35}
"""Opacity of parts that are not opaque: the front half would hide its pegs, the gauge strips and the sensor."""

LABELS = {"half_a": "half A", "half_b": "half B", "strips": "gauge strips"}

_VIEW = np.array([0.55, 0.5, 1.0])  # direction towards the viewer
_LYING = np.array([0.1, 1.0, 0.7])  # the same for parts as they lie, from above
_POURING_AXES = np.diag([1.0, -1.0, -1.0])  # orientation while pouring: dome down, lid on top
_SEPARATION = 0.45  # distance between the parts, relative to their largest extent
_WINDOW_OVER_PARTS = 1.08  # size of the window over that of the parts
_WIDTH, _TITLE_HEIGHT = 6.2, 0.5  # of the parts and of a title, in inches
_LABEL_FACTOR = 1.6  # width of a figure with labels over that of the parts
_PIXELS = round(_WIDTH * DPI)  # width of the rendered image


@dataclass(frozen=True)
class Scenery:
    """Parts of a picture and its camera.

    Attributes
    ----------
    parts : triangles of each part, mm
    axes : (3, 3) array
        Orthonormal axes of the viewer, rows: right, up, and towards the viewer.
    middle : (3,) array, mm
        Centre of the picture.
    half : (2,) array, mm
        Half the width and half the height of the picture.
    opaque : whether no part is drawn transparent
    title : of the picture
    labels : remark on each part, shown below its name; a part without a remark has no label
    """

    parts: Mapping[str, Triangles]
    axes: Float
    middle: Float
    half: Float
    opaque: bool = False
    title: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)

    @property
    def camera(self) -> Camera:
        """What the picture is seen by."""
        width, height = self.half
        return Camera(self.axes, self.middle, float(height), (_PIXELS, max(int(_PIXELS * height / width), 1)))

    @property
    def drawing(self) -> Drawing:
        """The parts in their colours."""
        opacity = {} if self.opaque else OPACITY
        parts = (
            Polygons(part.points, part.faces, colour(name), opacity.get(name, 1.0), feature_edges=True)
            for name, part in self.parts.items()
        )
        return Drawing(self.camera, tuple(parts))


def kind(name: str) -> str:
    """Return the kind of a part: half_a, half_b, or the first word of its name."""
    return name if name in COLOURS else name.split("_")[0]


def colour(name: str) -> str:
    """Return the colour of a part; grey if it has none of its own."""
    return COLOURS.get(name, COLOURS.get(kind(name), "#a8a8a8"))


def taken_apart(assembled: Mapping[str, Triangles]) -> dict[str, Triangles]:
    """Return the parts of an assembled mold apart, in the axes of the mold.

    Halves move along z, lids one above the other along -y, and inserts to below the last lid.
    """
    size = max(float((part.high - part.low).max()) for part in assembled.values())
    halves = [assembled[name] for name in ("half_a", "half_b") if name in assembled]
    thick = float(max(half.high[2] for half in halves) - min(half.low[2] for half in halves)) if halves else 0.0
    away, above = max(_SEPARATION * size, 0.8 * thick), 0.9 * _SEPARATION * size
    shifts = {"half_a": [0.0, 0.0, away], "half_b": [0.0, 0.0, -away]}
    lids = [name for name in assembled if kind(name) == "lid"]
    shifts |= {name: [0.0, -above * number, 0.0] for number, name in enumerate(lids, 1)}
    shifts |= {name: [0.0, -above * (len(lids) - 0.5), 0.0] for name in assembled if kind(name) == "insert"}
    return {
        name: Triangles(part.points + shifts.get(name, [0.0, 0.0, 0.0]), part.faces) for name, part in assembled.items()
    }


def standing(assembled: Mapping[str, Triangles]) -> dict[str, Triangles]:
    """Return the parts in the orientation in which the mold is poured."""
    return {name: Triangles(part.points @ _POURING_AXES.T, part.faces) for name, part in assembled.items()}


def scenery(parts: Mapping[str, Triangles], title: str = "", labels: Mapping[str, str] | None = None) -> Scenery:
    """Return parts as they are, y up, with a camera that shows them all; see `Scenery`."""
    return _seen(parts, _VIEW, title=title, labels=labels or {})


def scenery_on_the_bed(parts: Mapping[str, Triangles]) -> Scenery:
    """Return opaque parts as they lie on the bed of a printer, z up, seen from above."""
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    y_up = {name: Triangles(part.points @ turn.T, part.faces) for name, part in parts.items()}
    return _seen(y_up, _LYING, opaque=True)


def _seen(parts: Mapping[str, Triangles], towards: Float, **more: Any) -> Scenery:
    """Return parts with a camera in the direction (3,) `towards` the viewer."""
    axes = viewer_axes(towards)
    seen = np.vstack([part.points for part in parts.values()]) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    return Scenery(parts, axes, 0.5 * (low + high) @ axes, _WINDOW_OVER_PARTS * 0.5 * (high - low)[:2], **more)


def write_pictures(views: Mapping[Path, Scenery]) -> None:
    """Write a PNG file of each view, all in one run of the renderer."""
    with rendering([view.drawing for view in views.values()]) as images:
        found = images()
    for image, (path, view) in zip(found, views.items(), strict=True):
        width, height = view.half
        factor = _LABEL_FACTOR if view.labels else 1.0
        above = _TITLE_HEIGHT if view.title else 0.0
        high = float(_WIDTH * height / width) + above
        figure = blank(factor * _WIDTH, high)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0 - above / high))
        axes.imshow(image, extent=(-width, width, -height, height), interpolation="nearest")
        axes.set(xlim=(-factor * width, factor * width), ylim=(-height, height), aspect="equal")
        axes.set_axis_off()
        for name in view.labels:
            _label(axes, view, name)
        figure.text(0.5, 1.0 - 0.5 * above / high, view.title, fontsize=11, ha="center", va="center")
        save(figure, path)


def _label(axes: Axes, view: Scenery, name: str) -> None:
    """Write the name of a part and a remark next to the part: half B at its left, the other parts at their right."""
    seen = view.camera.flat(view.parts[name].points)
    left = name == "half_b"
    low = name == "strips"  # their front end is not hidden by other parts
    at = seen[np.argmin(seen[:, 1] if low else seen[:, 0]) if left or low else np.argmax(seen[:, 0])]
    shift = (-14, -4) if left else (30, -40) if low else (14, -4)
    line = {"arrowstyle": "-", "color": "#777777", "lw": 0.8}
    text = f"{LABELS.get(name, name.replace('_', ' '))}\n{view.labels[name]}".strip()
    beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "ha": "right" if left else "left"}
    place = float(at[0]), float(at[1])
    axes.annotate(text, place, shift, fontsize=8.5, arrowprops=line, annotation_clip=False, **beside)
