"""What does each effect change on the Fig. 9 finger, and what does it cost?

Source: the scene geometries/fig9.toml as a section in plane strain and as a 20 mm wide solid, nu = 0.45, mu = 0.25, 10
mm in 10 steps, each effect switched on alone.  The force in plane strain with and without large deformation is compared
with CalculiX 2.20 (validation/REFERENCES.md, 6.5).  The gauge is 5 mm long at x = 36 mm, at 30 degrees.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np

from finger3d.effects import effect_names
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.scene import Scene, parse

from ._rows import Result, Row, exact_columns, given, listed

judged = listed(__file__)

GIVEN = given(__file__)
SETTINGS, LABELS = ({name: one[key] for name, one in GIVEN["effect"].items()} for key in ("settings", "label"))
QUANTITIES = ("force", "contact_length", "stick", "friction_sum", "gauge_strain")
DOMAINS = ("plane-strain", "solid")


def run(quick: bool) -> Result:
    """Each effect alone, in the section and in the solid; the quick version leaves the solid out."""
    known = [name for name in SETTINGS if name in effect_names()]
    found: dict[tuple[str, str], dict[str, float]] = {}
    for domain in DOMAINS[:1] if quick else DOMAINS:
        for name in ("none", *known):
            found[domain, name] = _pressed(domain, name, quick)
    names = " ".join(("domain", "effect", *next(iter(found.values()))))
    table = exact_columns(names, [(*case, *numbers.values()) for case, numbers in found.items()])
    rows = _rows(found, quick)
    if not quick:  # a time, which a busy machine cannot judge by few pairs
        ratio, scatter = _paired(25)
        rows += (judged("time-of-a-press-without-effects", ratio, value=100.0 * scatter),)
    return Result(rows, table, lambda figure: _draw(figure, found))


def _paired(count: int) -> tuple[float, float]:
    """Least time of a press without effects over the same with finger3d.effects not importable; and their scatter."""
    model = _scene("plane-strain", "none", True).model()
    times: tuple[list[float], list[float]] = ([], [])
    hidden = {name: module for name, module in sys.modules.items() if name.startswith("finger3d.effects")}
    # in random order: every second press may be the slower one, by what the one before left of the memory
    for hide in np.random.default_rng(0).permutation(np.repeat([0, 1], count)).tolist():
        if hide:
            sys.modules.update(dict.fromkeys(["finger3d.effects", *hidden]))  # type: ignore[arg-type]
        try:
            begin = time.process_time()
            list(march(build(model)))
            times[hide].append(time.process_time() - begin)
        finally:
            sys.modules.pop("finger3d.effects", None)
            sys.modules.update(hidden)
    scatter = max(float(np.median(t)) / min(t) - 1.0 for t in times)
    return min(times[0]) / min(times[1]), scatter


def _pressed(domain: str, effect: str, quick: bool) -> dict[str, float]:
    scene = _scene(domain, effect, quick)
    begin = time.process_time()
    problem = build(scene.model())
    workspace = formulation_of(problem.model).workspace()
    *_, end = march(problem, workspace=workspace)
    seconds = time.process_time() - begin
    numbers = measure(problem.points, end)
    return {
        "force": numbers["normal_force_N"] / 20.0,
        "contact_length": 2.0 * numbers["contact_half_length_mm"],
        # of a solid the area: stick ends in a zone one point wide, whose length is that of a few points
        "stick": 2.0 * numbers["stick_half_length_mm"] if problem.dim == 2 else numbers["stick_area_mm2"],
        "friction_sum": numbers["friction_sum_N"] / 20.0,
        "gauge_strain": numbers["gauges"]["g1"],
        "cpu_seconds": seconds,
        "factorizations": problem.factorizations + workspace.factorizations,
    }


def _scene(domain: str, effect: str, quick: bool) -> Scene:
    size, base = {"plane-strain": (2.0, 8.0) if quick else (1.0, 4.0), "solid": (2.0, 8.0)}[domain]
    mesh = {"size_mm": size, "base_size_mm": base, "mesher": "swept"}
    effects = {} if effect == "none" else {effect: SETTINGS[effect]}
    return parse({**GIVEN["scene"], "model": {"domain": domain}, "mesh": mesh, "effects": effects})


def _rows(found: dict[tuple[str, str], dict[str, float]], quick: bool) -> tuple[Row, ...]:
    section = "plane-strain"
    none, large = found[section, "none"], found[section, "large_deformation"]
    mesh = 0.01 if quick else 0.005
    rows = [
        judged("force-per-mm-plane-strain-small", none["force"], tolerance=mesh),
        judged("force-per-mm-plane-strain-large", large["force"]),
    ]
    for domain in sorted({d for d, _ in found}):
        base = found[domain, "none"]
        viscous = found[domain, "viscosity"]["force"] / base["force"]
        # a ramp of T = 2 tau: the mean of the relaxation function over the ramp, if the force grew linearly
        mean = 0.7 + 0.3 * 0.5 * (1.0 - np.exp(-2.0))
        count = max(found[domain, n]["factorizations"] for n in ("none", "kinetic_friction", "viscosity"))
        rows += [
            judged("viscous-over-elastic-force", viscous, mean, domain=domain),
            judged("factorisations-without-large-deformation", count, domain=domain),
        ]
    return tuple(rows)


def _draw(figure: Any, found: dict[tuple[str, str], dict[str, float]]) -> None:
    """Draw changes in per cent, and beside them the seconds of each press."""
    domains = [d for d in DOMAINS if (d, "none") in found]
    effects = [n for n in SETTINGS if (domains[0], n) in found]
    figure.set_size_inches(5.2 * len(domains) + 1.6, 5.6)
    panels = figure.subplots(1, 2 * len(domains), squeeze=False, width_ratios=[3.4, 1.0] * len(domains))[0]
    for k, domain in enumerate(domains):
        axes, times = panels[2 * k : 2 * k + 2]
        stick = "stick length" if domain == "plane-strain" else "stick area"
        names = ("force", "contact length", stick, "sum of |friction|", "gauge strain")
        base = found[domain, "none"]
        height = 0.8 / len(effects)
        for i, effect in enumerate(effects):
            change = [100.0 * (found[domain, effect][q] / base[q] - 1.0) for q in QUANTITIES]
            at = np.arange(len(QUANTITIES)) + (i - (len(effects) - 1) / 2.0) * height
            bars = axes.barh(at, np.clip(change, -100.0, 200.0), height, label=LABELS[effect])
            axes.bar_label(bars, [f"{c:+.0f}" if abs(c) >= 0.5 else "" for c in change], padding=2, fontsize=7)
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.set_yticks(np.arange(len(QUANTITIES)), names)
        axes.invert_yaxis()
        axes.set(xlim=(-125.0, 225.0), xlabel="change by the effect (%)")
        axes.set(title={"plane-strain": "section, plane strain", "solid": "solid, 20 mm wide"}[domain])
        seconds = [found[domain, name]["cpu_seconds"] for name in ("none", *effects)]
        bars = times.barh(range(len(seconds)), seconds, color=["#777777", *(f"C{i}" for i in range(len(effects)))])
        times.bar_label(bars, [f"{s:.2g}" if s < 10.0 else f"{s:.0f}" for s in seconds], padding=2, fontsize=8)
        times.set(xscale="log", xlim=(0.5 * min(seconds), 6.0 * max(seconds)), xlabel="time (s)")
        times.set_yticks([0], ["none"])
        times.invert_yaxis()
        for panel in (axes, times):
            panel.spines[["top", "right"]].set_visible(False)
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", frameon=False, ncols=3)
