"""Work-precision diagrams of the table of cost_of_accuracy: one question a panel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ._cost import LARGE, SECTION, SOLID

Line = Mapping[str, Any]

COLOURS = {SECTION: "#2c5d8f", SOLID: "#c0392b"}
NAMES = {
    "force": "normal force", "friction_sum": "friction sum", "gauge_strain": "gauge strain",
    "contact_length": "contact length", "stick_length": "stick length",
}  # fmt: skip
_FLOOR = 1e-5
"""Relative error below which the truth is not known."""


def draw(figure: Any, lines: Sequence[Line]) -> None:
    """Draw five panels from the lines of the study's table."""
    figure.set_size_inches(10.5, 11.5)
    *panels, empty = figure.subplots(3, 2).ravel()
    empty.remove()
    runs = [line for line in lines if line["kind"] == "run"]
    for axes, panel in zip(panels, (_elements, _numbers, _memory, _condensation, _large), strict=True):
        panel(axes, runs)


def series(
    runs: Sequence[Line], body: str, element: str = "mixed", mesher: str = "swept", solver: str = "pardiso",
    way: str = "condensed",
) -> list[Line]:  # fmt: skip
    """Return runs on meshes of equal grading, coarse to fine, each once."""
    found = {}
    for line in runs:
        given = (line["body"], line["element"], line["mesher"], line["solver"], line["way"])
        even = abs(line["base_size_mm"] / line["size_mm"] - 4.0) < 1e-9
        if given == (body, element, mesher, solver, way) and even:
            found.setdefault(line["size_mm"], line)
    return [found[size] for size in sorted(found, reverse=True)]


def _plot(axes: Any, some: Sequence[Line], x: str, y: str, label: str, mark: str, **style: Any) -> None:
    known = [line for line in some if not y.startswith("error") or (line[y] or 0.0) > _FLOOR]
    scale = 100.0 if y.startswith("error") else 1.0
    axes.loglog([line[x] for line in known], [scale * line[y] for line in known], mark, label=label, ms=5, **style)


def _elements(axes: Any, runs: Sequence[Line]) -> None:
    for element, colour, mark in (("mixed", "C0", "o-"), ("quadratic", "C1", "s-"), ("linear", "C3", "^-")):
        _plot(axes, series(runs, SOLID, element), "seconds", "error_force", element, mark, color=colour)
    wild = series(runs, SOLID, mesher="ftetwild")
    _plot(axes, wild, "seconds", "error_force", "mixed, fTetWild, mesh made anew", "D:", color="C4")
    axes.set(title="Which element?  Solid, normal force", ylabel="error, %")
    axes.set(xlabel="processor time, mesh to last increment (s)")


def _numbers(axes: Any, runs: Sequence[Line]) -> None:
    for (quantity, name), mark in zip(NAMES.items(), ("o-", "s-", "^-", "D-", "v-"), strict=True):
        _plot(axes, series(runs, SOLID), "seconds", f"error_{quantity}", name, mark)
    axes.set(title="Which number is dear?  Solid, mixed elements", xlabel="processor time, mesh to last increment (s)")
    axes.set(ylabel="error, %", ylim=(None, 200.0))


def _memory(axes: Any, runs: Sequence[Line]) -> None:
    for body in (SECTION, SOLID):
        _plot(axes, series(runs, body), "peak_MB", "error_force", body, "o-", color=COLOURS[body])
    axes.set(title="How much memory?  Normal force, mixed elements", xlabel="peak memory, MB", ylabel="error, %")


def _condensation(axes: Any, runs: Sequence[Line]) -> None:
    for body in (SECTION, SOLID):
        ways: tuple[tuple[str, str, str, str], ...] = (
            ("one condensation", "pardiso", "condensed", "o-"),
            ("SuperLU", "superlu", "condensed", "+--"),
            ("a factorisation an iteration", "pardiso", "each iteration", "*:"),
        )
        for name, solver, way, mark in ways:
            some = series(runs, body, solver=solver, way=way)
            _plot(axes, some, "dofs", "seconds", f"{body}, {name}", mark, color=COLOURS[body])
    axes.set(title="What does one condensation save?", xlabel="unknowns", ylim=(None, 1e4))
    axes.set(ylabel="processor time, mesh to last increment (s)")


def _large(axes: Any, runs: Sequence[Line]) -> None:
    for body in (SECTION, SOLID):
        _plot(axes, series(runs, body), "seconds", "error_force", f"{body}, small strain", "o-", color=COLOURS[body])
        large = series(runs, LARGE[body])
        _plot(axes, large, "seconds", "error_force", f"{body}, large deformation", "v--", color=COLOURS[body])
    axes.set(title="What does large deformation cost?  Normal force")
    axes.set(xlabel="processor time, mesh to last increment (s)", ylabel="error, %")
