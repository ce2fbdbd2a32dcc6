"""Sketches that open the pages of the theory: ``python docs/_sketches.py`` draws them into docs/theory/."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

INK, BODY, OBJECT, STICK, SLIP = "#222222", "#d9d6cf", "#7fa7c9", "#1f3f77", "#f28e2b"


def contact(figure: Figure) -> None:
    """Draw a dome under a plate, its zones, and the friction cone."""
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
    _dome(left, pressed=0.45)
    left.fill_between([-3.2, 3.2], 1.55, 1.95, color=OBJECT, lw=0)
    for low, high, colour in ((-1.32, -0.7, SLIP), (-0.7, 0.7, STICK), (0.7, 1.32, SLIP)):
        left.plot([low, high], [1.55, 1.55], color=colour, lw=5, solid_capstyle="butt")
    _arrow(left, (0.0, 2.75), (0.0, 1.98))
    left.text(0.15, 2.4, "the object moves down")
    for x, text, to in ((-2.9, "open: gap,\nno force", -1.9), (0.0, "stick: no slip", 0.0), (2.6, "slip", 1.05)):
        left.annotate(
            text, (to, 1.5), (x, 1.0), ha="center", va="top", arrowprops={"arrowstyle": "-", "color": INK, "lw": 0.7}
        )
    right.fill([0.0, -0.8, 0.8], [0.0, 1.6, 1.6], color=BODY)
    right.plot([-0.9, 0.0, 0.9], [1.8, 0.0, 1.8], color=INK, lw=1.0)
    _arrow(right, (0.0, 0.0), (-0.2, 1.4), STICK)
    _arrow(right, (0.0, 0.0), (0.6, 1.2), SLIP)
    right.text(-0.95, 1.2, "stick: inside", color=STICK, ha="right")
    right.text(0.85, 1.2, "slip: on the cone", color=SLIP)
    right.text(0.0, -0.35, "force of a contact point in its friction cone", ha="center")
    _bare(left, right)


def condensation(figure: Figure) -> None:
    """Draw a mesh whose unknowns are replaced by those of its contact points and gauges."""
    left, right = figure.subplots(1, 2)
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(-1.0, 1.0, 9), np.linspace(0.0, 1.0, 5)))
    top = y * (0.6 + 0.4 * np.sqrt(np.maximum(1.0 - (x / 1.4) ** 2, 0.0)))
    for axes in (left, right):
        outline = np.linspace(-1.0, 1.0, 60)
        axes.fill_between(outline, 0.0, 0.6 + 0.4 * np.sqrt(1.0 - (outline / 1.4) ** 2), color=BODY, lw=0)
        axes.plot(x[y == 1.0], top[y == 1.0], "o", color=STICK, ms=6)
        axes.plot([0.45, 0.62], [0.6, 0.68], color=SLIP, lw=3)
    left.triplot(x, top, color="#8d8a84", lw=0.6)
    left.plot(x, top, ".", color=INK, ms=3)
    left.set_title("K u = f: every node of the mesh", fontsize=10)
    for a, b in ((-0.75, -0.25), (-0.25, 0.25), (0.25, 0.75)):
        right.annotate("", (b, 0.9), (a, 0.9), arrowprops={"arrowstyle": "<->", "connectionstyle": "arc3,rad=0.35"})
    right.set_title("w = W r + q: contact points and readings only", fontsize=10)
    _bare(left, right)


def gaps(figure: Figure) -> None:
    """Draw a ball beside the apex of a dome, and the gap along its normal."""
    axes = figure.subplots()
    _dome(axes)
    angle = np.linspace(0.0, 2.0 * np.pi, 90)
    middle, radius = np.array([1.9, 3.2]), 0.9
    axes.fill(middle[0] + radius * np.cos(angle), middle[1] + radius * np.sin(angle), color=OBJECT)
    point = np.array([1.0, 1.79])
    normal = (middle - point) / np.linalg.norm(middle - point)
    touch = middle - radius * normal
    axes.plot(*np.array([point, touch]).T, color=SLIP, lw=2.0)
    axes.plot(*point, "o", color=STICK, ms=6)
    axes.annotate("gap g along the object's normal n", 0.5 * (point + touch), (-2.6, 2.9), va="center",
                  arrowprops={"arrowstyle": "-", "lw": 0.7})  # fmt: skip
    axes.text(*point + [-0.15, -0.3], "contact point", ha="right")
    axes.text(*middle, "object", ha="center")
    _bare(axes)


def parts(figure: Figure) -> None:
    """Draw a finger of skin, body and core."""
    axes = figure.subplots()
    _dome(axes)
    x = np.linspace(-2.2, 2.2, 80)
    axes.fill_between(x, 0.0, 1.55 - 0.16 * x**2, color="#ece9e2", lw=0)
    axes.fill_between([-1.0, 1.0], 0.0, 0.8, color="#8d8a84", lw=0)
    for text, at, to in (("skin", (3.0, 2.3), (1.7, 1.25)), ("body", (3.4, 1.4), (1.4, 0.8)),
                         ("rigid core", (-3.2, 1.4), (-0.7, 0.4))):  # fmt: skip
        axes.annotate(text, to, at, arrowprops={"arrowstyle": "-", "lw": 0.7})
    axes.text(-3.3, 2.3, "bonded: the same displacement\nand traction on both sides", va="center", ha="center")
    _bare(axes)


def large_deformation(figure: Figure) -> None:
    """Draw a body at rest and pressed, and how a point of it moves."""
    left, right = figure.subplots(1, 2)
    for axes, bulge, title in ((left, 0.0, "at rest"), (right, 0.45, "pressed")):
        y = np.linspace(0.0, 1.0, 40)
        side = 1.0 + bulge * 4.0 * y * (1.0 - y) * 0.6
        height = 1.0 if not bulge else 0.72
        axes.fill_betweenx(height * y, -side, side, color=BODY, lw=0)
        axes.plot([0.2, 0.5] if not bulge else [0.22, 0.66], [height * 0.5, height * 0.7], color=SLIP, lw=3)
        axes.set_title(title, fontsize=10)
        axes.set_xlim(-1.6, 1.6)
    right.fill_between([-1.5, 1.5], 0.72, 0.85, color=OBJECT, lw=0)
    left.text(0.0, 0.2, "X: place of a point", ha="center")
    right.text(0.0, 0.15, "x = X + u, F = dx/dX", ha="center")
    _bare(left, right)


def relaxation(figure: Figure) -> None:
    """Draw a depth that is held, and the force that relaxes."""
    left, right = figure.subplots(1, 2)
    time = np.linspace(0.0, 4.0, 200)
    left.plot(time, np.minimum(time, 1.0), color=INK)
    left.set_title("depth", fontsize=10)
    held = np.where(time < 1.0, time * 0.9, 0.55 + 0.35 * np.exp(-(time - 1.0) / 0.7))
    right.plot(time, held, color=SLIP)
    right.axhline(0.55, color=INK, ls=":", lw=0.8)
    right.set_title("force: falls to the long-time share", fontsize=10)
    for axes in (left, right):
        axes.set(xlabel="time", xticks=[], yticks=[], ylim=(0.0, 1.15))
        axes.spines[["top", "right"]].set_visible(False)


def errors(figure: Figure) -> None:
    """Draw a number against the edge length, its limit, and the bar that the estimate gives."""
    axes = figure.subplots()
    h = np.linspace(0.0, 1.1, 100)
    axes.plot(h, 1.0 + 0.30 * h**1.5, color=INK)
    for at, text in ((1.0, "coarser mesh"), (0.5, "this press")):
        axes.plot(at, 1.0 + 0.30 * at**1.5, "o", color=STICK)
        axes.annotate(text, (at, 1.0 + 0.30 * at**1.5), (at - 0.12, 1.06 + 0.30 * at**1.5), ha="center")
    axes.errorbar([0.5], [1.0 + 0.3 * 0.5**1.5], [0.13], color=SLIP, capsize=4, lw=1.5)
    axes.axhline(1.0, color=INK, ls=":", lw=0.8)
    axes.text(0.75, 0.95, "exact value", ha="center", va="top")
    axes.set(xlabel="edge length", ylabel="number", xticks=[], yticks=[], xlim=(0.0, 1.15), ylim=(0.85, 1.45))
    axes.spines[["top", "right"]].set_visible(False)


def differences(figure: Figure) -> None:
    """Draw a reading along a press at two friction coefficients, and their difference; lines bend at events."""
    left, right = figure.subplots(1, 2)
    path = np.array([0.0, 0.25, 0.6, 1.0])
    low, high = np.array([0.0, 0.12, 0.42, 0.6]), np.array([0.0, 0.12, 0.5, 0.85])
    for values, colour, text in ((low, INK, "at mu"), (high, SLIP, "at mu + dmu")):
        left.plot(path, values, "o-", color=colour, ms=4)
        left.text(1.03, values[-1], text, color=colour, va="center")
    left.annotate("", (1.0, high[-1] - 0.02), (1.0, low[-1] + 0.02), arrowprops={"arrowstyle": "<->", "color": STICK})
    left.annotate(
        "event: a point\nbegins to slip",
        (0.6, 0.42),
        (0.72, 0.12),
        ha="center",
        arrowprops={"arrowstyle": "-", "lw": 0.7},
    )
    left.set_title("a reading", fontsize=10)
    right.plot(path, high - low, "o-", color=STICK, ms=4)
    right.set_title("the effect of dmu: the difference", fontsize=10)
    for axes in (left, right):
        axes.set(xlabel="depth", xticks=[], yticks=[], xlim=(0.0, 1.3), ylim=(0.0, 1.0))
        axes.spines[["top", "right"]].set_visible(False)
    right.set(xlim=(0.0, 1.05), ylim=(0.0, 0.3))


SKETCHES: dict[str, tuple[float, Callable[[Figure], None]]] = {
    "contact": (2.8, contact), "condensation": (2.2, condensation), "gaps": (2.8, gaps), "parts": (2.2, parts),
    "large_deformation": (2.0, large_deformation), "relaxation": (2.0, relaxation), "errors": (2.6, errors),
    "differences": (2.3, differences),
}  # fmt: skip
"""Page -> height of its sketch in inches, and the function that draws it."""


def draw(folder: Path) -> None:
    """Draw all sketches as PNG files, the same ones on every run."""
    with matplotlib.rc_context({"font.size": 9, "axes.linewidth": 0.8}):
        for name, (height, sketch) in SKETCHES.items():
            figure = Figure(figsize=(7.0, height), layout="constrained")
            FigureCanvasAgg(figure)
            sketch(figure)
            figure.savefig(folder / f"{name}.png", dpi=110, metadata={"Software": None})


def _dome(axes: Any, pressed: float = 0.0) -> None:
    """Fill the section of a finger, cut off at its top where it is pressed."""
    x = np.linspace(-2.5, 2.5, 120)
    axes.fill_between(x, 0.0, np.minimum(2.0 - 0.24 * x**2, 2.0 - pressed), color=BODY, lw=0)
    axes.plot([-2.5, 2.5], [0.0, 0.0], color=INK, lw=2.5)


def _arrow(axes: Any, start: tuple[float, float], end: tuple[float, float], colour: str = INK) -> None:
    axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.6})


def _bare(*panels: Any) -> None:
    for axes in panels:
        axes.set_axis_off()
        axes.set_aspect("equal")


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent / "theory")
