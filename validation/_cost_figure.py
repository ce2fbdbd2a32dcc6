"""The work-precision diagrams: error over seconds and over memory, a column a quantity, two rows a body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ._cost import LARGE, QUANTITIES, Case
from ._cost_truth import seconds

STYLES = {
    "mixed": ("C0", "o", "-"), "quadratic": ("C1", "s", "-"), "linear": ("C3", "^", "-"), "pytetwild": ("C4", "D", "-"),
    "large deformation": ("C7", "v", "-"), "grading": ("C2", "x", ":"), "SuperLU": ("C5", "+", "--"),
    "one factorisation an iteration": ("C6", "*", "--"),
}  # fmt: skip
LABELS = {
    "mixed": "mixed", "quadratic": "quadratic", "linear": "linear", "pytetwild": "mixed, pytetwild (mesh made anew)",
    "large deformation": "mixed, large deformation", "grading": "base size 1-32 times the contact's",
    "SuperLU": "SuperLU",
    "one factorisation an iteration": "one factorisation an iteration", "steps": "increments 1-200, one mesh",
}  # fmt: skip
NAMES = {
    "force": "force", "contact_length": "contact length", "stick_length": "stick length",
    "friction_sum": "friction sum", "gauge_strain": "gauge strain",
}  # fmt: skip
_FLOOR = 1e-6


def draw(
    figure: Any,
    made: Mapping[str, Mapping[str, Sequence[Case]]],
    runs: Mapping[Case, dict[str, Any]],
    errors: Mapping[Case, Mapping[str, float]],
    steps: Mapping[str, Mapping[str, Mapping[int, float]]],
    known_to: Mapping[str, Mapping[str, float]],
) -> None:
    """Meshes by their error under ten increments; increments by theirs on one mesh; grey: not resolved by the truth.

    Runs at large deformation are in the panels of their body, with errors relative to their own truth.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator

    large = {body: made[name]["mixed"] for body, name in LARGE.items() if name in made}
    made = {
        body: {**series, **({"large deformation": large[body]} if body in large else {})}
        for body, series in made.items()
        if body not in LARGE.values()
    }
    figure.set_size_inches(19.0, 6.6 * len(made))
    panels = figure.subplots(2 * len(made), len(QUANTITIES), sharey="row", squeeze=False)
    for number, (body, series) in enumerate(made.items()):
        for column, quantity in enumerate(QUANTITIES):
            over_time, over_memory = panels[2 * number][column], panels[2 * number + 1][column]
            for name, cases in series.items():
                if name == "steps":
                    continue
                colour, mark, line = STYLES[name]
                known = [c for c in cases if errors[c].get(quantity, 0.0) > _FLOOR]
                error = [errors[c][quantity] for c in known]
                style: dict[str, Any] = {"color": colour, "marker": mark, "ls": line, "ms": 4.5, "lw": 1.2}
                over_time.loglog([seconds(runs[c]) for c in known], error, label=LABELS[name], **style)
                over_memory.loglog([runs[c]["peak_MB"] for c in known], error, **style)
            ladder = series["steps"][0]
            by_steps = steps[body][quantity]
            counts = [n for n in by_steps if by_steps[n] > _FLOOR]
            over_time.loglog(
                [seconds(runs[ladder], n) for n in counts], [by_steps[n] for n in counts], "k.-", lw=0.8,
                label=LABELS["steps"],
            )  # fmt: skip
            over_time.set_title(f"{NAMES[quantity]}, {body}", fontsize=11)
            over_time.set_xlabel("seconds, meshing to last increment")
            over_memory.set_xlabel("peak memory (MB)")
            for axes in (over_time, over_memory):
                for level in (0.05, 0.01, 0.001):
                    axes.axhline(level, color="#999999", lw=0.6, ls="--")
                axes.axhspan(1e-9, known_to[body][quantity], color="#888888", alpha=0.15, lw=0.0)
                axes.set_ylim(_FLOOR, 2.0)
                axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
                axes.minorticks_off()
                axes.tick_params(axis="x", labelsize=7)
                axes.grid(alpha=0.25)
        for row in (2 * number, 2 * number + 1):
            panels[row][0].set_ylabel("relative error")
    handles: dict[str, Any] = {}
    for axes in panels.ravel():
        handles |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside upper center", ncols=4, fontsize=10, frameon=False)
