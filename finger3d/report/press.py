"""The page of a press, made from its folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from finger3d.accuracy.error_bars import ErrorBars
from finger3d.contact.conditions import TOLERANCE
from finger3d.contact.friction import OPEN, STATUS_NAMES
from finger3d.report.build import Figure, HeadlineRow, PageSection, Table, write_page
from finger3d.report.scene import how_modelled
from finger3d.report.view3d import view_of
from finger3d.results.states import States, load_states
from finger3d.results.summary import gauges_of, read_json, title_of

_HEADLINE = {
    "normal_force_N": ("normal force", 1.0, "N"),
    "friction_sum_N": ("sum of |friction|", 1.0, "N"),
    "tangential_force_x_N": ("tangential force along x", 1.0, "N"),
    "contact_half_length_mm": ("contact length at z = 0", 2.0, "mm"),
    "stick_half_length_mm": ("stick length at z = 0", 2.0, "mm"),
    "contact_area_mm2": ("contact area", 1.0, "mm²"),
    "stick_area_mm2": ("stick area", 1.0, "mm²"),
    "external_work_mJ": ("work done on the finger", 1.0, "mJ"),
    "dissipation_mJ": ("lost to friction", 1.0, "mJ"),
}
"""Key of a step -> what the page calls it, its factor, its unit."""

_PICTURES = {
    "finger.png": "The deformed finger at true scale: contact pressure, and the zones that stick and slip",
    "contact.png": "Traction on the finger along x, with the limit of friction and the zones",
    "force.png": "Forces, and half lengths of contact and stick zone, against depth",
}


def press_page(folder: str | Path) -> Path:
    """Write report.html of a press from what is in its folder.

    summary.json must be there; steps.npz (for the 3D view of a solid), scene.toml and pictures are used if they are.

    Raises
    ------
    Finger3dError
        If there is no summary.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    summary = read_json(folder / "summary.json")
    steps = summary["steps"]
    good = [step for step in steps if step["outcome"] == "converged"]
    source = folder / "steps.npz"
    states = load_states(source) if source.exists() else None
    last = f" after step {steps.index(good[-1]) + 1}, {good[-1]['depth_mm']:.4g} mm deep" if good else ""
    sections = [
        PageSection("Scene", [*how_modelled(summary, folder)]),
        *([_proof(steps, states, good)] if steps else []),
        *_error_bars(summary),
        *([_steps(good)] if good else []),
        PageSection("Mesh and cost", [_mesh(summary["mesh"]), _cost(summary["cost"])]),
    ]
    return write_page(
        folder,
        title_of(summary["scene"]),
        headline(good[-1], ErrorBars.of_summary(summary).totals()) if good else (),
        sections,
        [Figure(name, text) for name, text in _PICTURES.items()],
        view_of(states, gauges_of(summary["scene"])) if states else None,
        command="press",
        outcome=f"{summary['outcome']}{last if summary['outcome'] == 'converged' else ''}",
        good=summary["outcome"] == "converged",
        notes=[*summary["warnings"], *summary["advice"], *_what_bars_leave_out(summary)],
        versions=summary["versions"],
    )


def headline(step: Mapping[str, Any], errors: Mapping[str, float]) -> list[HeadlineRow]:
    """The numbers of a step by name, with errors where they were estimated; net friction only where there is some."""
    rows = []
    for key, (name, factor, unit) in _HEADLINE.items():
        if key.startswith("tangential") and abs(step[key]) <= 1e-9 * max(step["friction_sum_N"], 1e-300):
            continue
        error = errors.get(key)
        rows.append(HeadlineRow(name, factor * step[key], unit, None if error is None else factor * error))
    return rows + [
        HeadlineRow(f"strain of gauge {name}", "unknown" if strain is None else strain, "", errors.get(f"gauge_{name}"))
        for name, strain in step["gauges"].items()
    ]


def _what_bars_leave_out(summary: Mapping[str, Any]) -> list[str]:
    known = (summary.get("error_estimate") or {}).get("discretisation")
    return ["What follows ± is the error by mesh and increments, not by what the model leaves out."] if known else []


def _error_bars(summary: Mapping[str, Any]) -> list[PageSection]:
    """How each error splits into that of the mesh and that of the increments, and how they were found."""
    if not summary.get("error_estimate"):
        return []
    bars = ErrorBars.of_summary(summary)
    rows = [(name, value, bars.steps.get(name)) for name, value in bars.discretisation.items()]
    table = [Table(("error, in the unit of the name", "of the mesh", "of the increments"), rows)] if rows else []
    return [PageSection("Error bars", [f"What follows ± is both added. How: {bars.method}", *table])]


def _proof(steps: Sequence[Mapping[str, Any]], states: States | None, good: Sequence[Mapping[str, Any]]) -> PageSection:
    worst = max((s["residual"] for s in good if s["residual"] is not None), default=None)
    parts: list[Any] = [
        "Every contact point is either open (gap > 0, no force) or touches (gap 0, pressure > 0); one that touches "
        "sticks (it does not move, |friction| below mu times pressure) or slips (|friction| = mu times pressure, "
        "against its motion): Eqs. (1)-(4) of the paper, and friction opposing slip. After every step all of them are "
        "checked; the residual is the largest violation, gaps and slips in parts of the depth, forces in parts of the "
        f"largest nodal force. A step counts as converged only at or below {TOLERANCE:g}."
    ]
    if worst is not None:
        parts.append(f"Largest residual of the {len(good)} converged steps: {worst:.1e}.")
    if states is not None:
        parts.append(_last_state(states))
    rows = [
        (
            k, step["depth_mm"], f"{step['residual']:.1e}" if step["residual"] is not None else "none",
            "yes" if step["residual"] is not None and step["residual"] <= TOLERANCE else "NO",
            step["iterations"], step.get("method", ""), step["outcome"],
        )
        for k, step in enumerate(steps, start=1)
    ]  # fmt: skip
    head = ("step", "depth (mm)", "residual", f"≤ {TOLERANCE:g}", "iterations", "method", "outcome")
    return PageSection("Proof of the contact conditions", [*parts, Table(head, rows)])


def _last_state(states: States) -> Table:
    status, gap, pressure = states.status[-1], states.gap[-1], states.pressure[-1]
    touching = status != OPEN
    rows: list[tuple[str, object, str]] = [
        (f"points that are {name}", int(np.count_nonzero(status == k)), "") for k, name in enumerate(STATUS_NAMES)
    ]
    if (~touching).any():
        rows.append(("smallest gap of an open point", float(gap[~touching].min()), "mm, ≥ 0"))
        rows.append(("largest pressure on an open point", float(np.abs(pressure[~touching]).max()), "MPa, = 0"))
    if touching.any():
        rows.append(("largest |gap| of a point that touches", float(np.abs(gap[touching]).max()), "mm, = 0"))
        rows.append(("smallest pressure on a point that touches", float(pressure[touching].min()), "MPa, ≥ 0"))
    return Table(("in the last step", "", ""), rows)


def _steps(good: Sequence[Mapping[str, Any]]) -> PageSection:
    keys = {
        "depth_mm": "depth (mm)", "slide_x_mm": "slide x (mm)", "slide_z_mm": "slide z (mm)", "time_s": "time (s)",
        "normal_force_N": "normal force (N)", "tangential_force_x_N": "friction x (N)",
        "tangential_force_z_N": "friction z (N)", "friction_sum_N": "sum of |friction| (N)",
        "contact_area_mm2": "contact (mm²)", "stick_area_mm2": "stick (mm²)", "dissipation_mJ": "dissipation (mJ)",
    }  # fmt: skip
    scale = max(abs(step["normal_force_N"]) for step in good)
    # net friction of a symmetric press is round-off, and most paths do not slide
    shown = [k for k in keys if k == "depth_mm" or max(abs(s[k]) for s in good) > 1e-9 * scale]
    gauges = list(good[-1]["gauges"])
    rows = [[float(s[k]) for k in shown] + [s["gauges"].get(g) for g in gauges] for s in good]
    table = Table([*(keys[k] for k in shown), *(f"strain {g}" for g in gauges)], rows)
    return PageSection("Every step", ["The same numbers, and more, with all digits: history.csv.", table], folded=True)


def _mesh(mesh: Mapping[str, Any]) -> Table:
    rows: list[tuple[str, object]] = [
        ("nodes, cells", f"{mesh['points']}, {mesh['cells']}"),
        ("unknowns", str(mesh["dofs"])),
        ("contact points", str(mesh["contact_points"])),
        ("elements", mesh["formulation"]),
        (
            "solved on",
            f"the part that mirrors in {' and '.join(mesh['symmetry'])}" if mesh["symmetry"] else "the whole",
        ),
        ("smallest dihedral angle", f"{_six(mesh['min_dihedral_deg'])} deg"),
        ("volume meshed, of the CAD", f"{mesh['volume_mm3']:.6g}, {_six(mesh['cad_volume_mm3'])} mm³"),
        ("hash", f"{mesh['hash']}{', from the cache' if mesh['from_cache'] else ''}"),
    ]
    return Table(("mesh", ""), rows)


def _six(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g}"


def _cost(cost: Mapping[str, Any]) -> Table:
    seconds = cost["seconds"]
    rows: list[tuple[str, object]] = [(stage, f"{s:.2f} s") for stage, s in seconds.items()]
    rows += [
        ("factorisations", f"{cost['factorizations']}, by {cost.get('solver', 'unknown')}"),
        ("peak memory", f"{cost['peak_memory_MB']:.0f} MB"),
    ]
    return Table(("cost", ""), rows)
