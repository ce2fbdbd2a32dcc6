"""When a press is released, is the area of the force-depth loop the work lost, and does friction reverse at once?

Source: validation/REFERENCES.md, 2.7; Spence 1975 and Turner 1979 for unloading.  An elastic body gives back what it
stored, so after release the work done on it equals the dissipation.  With N increments this holds
within O(1/N^2).  The force at rest and the second cycle follow from it.

On unloading, friction at the very edge reverses while the inner points still slip outward under their decreasing limit.
The edge point of a mesh represents one spacing, so the drop of load at which it slips back must vanish with the mesh.
The dissipation during release converges slowly with the mesh (see the table), because points leave contact one by one.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import OPEN, SLIP
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Leg

from ._halfplane import Profile, compliance, line, loading, under
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)

MU = 0.25
COLUMNS = "body nu points_per_a increments work lost_pressing lost_releasing work_over_lost second_over_first"
"""Work in A P^2."""


def cycle(problem: Problem, nu: float, points: int, count: int) -> tuple[tuple[Any, ...], list[Profile]]:
    """A row of the table for two cycles of a cylinder with `count` increments each way, and the profiles."""
    depth = problem.model.legs[-1].depth_mm
    legs = tuple(Leg(d, steps=count) for d in (depth, 0.0, depth, 0.0))
    found = under(problem, MU, legs)
    top, first, last = (found[k * count - 1].frame for k in (1, 2, 4))
    scale = compliance(nu) * found[count - 1].force ** 2
    lost = first.dissipation_mJ
    row = (
        "cylinder", nu, points, count, first.external_work_mJ / scale, top.dissipation_mJ / scale,
        (lost - top.dissipation_mJ) / scale, first.external_work_mJ / lost, (last.dissipation_mJ - lost) / lost,
    )  # fmt: skip
    return row, found


def reversal(problem: Problem) -> tuple[float, list[Profile]]:
    """Share of the load that is gone when the outermost point first slips back, and the profiles up to there."""
    depth = problem.model.legs[-1].depth_mm
    found = under(problem, MU, (Leg(depth, steps=50), Leg(0.8 * depth, steps=200)))
    top = found[49]
    for k, profile in enumerate(found[50:]):
        edge = np.flatnonzero((profile.status != OPEN) & (profile.x > 0.0))[-1]
        if profile.status[edge] == SLIP and profile.q[edge] * top.outward < 0.0:
            return 1.0 - profile.force / top.force, [top, *found[50 : 51 + k]]
    raise AssertionError("friction at the edge did not reverse within the release")


def run(quick: bool) -> Result:
    """A cylinder: 10, 20, 40 points to a, 100 to 400 increments each way."""
    counts = (25, 50, 100) if quick else (100, 200, 400)
    meshes = (10, 20) if quick else (10, 20, 40)
    table, rows, drops = [], [], {}
    for nu in (0.3,) if quick else (0.3, 0.0):
        for points in meshes:
            problem = line(nu, points, loading(1))
            if nu == 0.3:
                drops[points], shown = reversal(problem)
            for count in counts if points == 20 else (() if quick else (counts[-1],)):
                row, found = cycle(problem, nu, points, count)
                table.append(row)
        rows += _cycle_rows(nu, table, counts, found)
    rate = float(np.log(drops[meshes[0]] / drops[meshes[-1]]) / np.log(meshes[-1] / meshes[0]))
    rows.append(judged("rate-at-which-the-drop-of", rate))
    rows.append(judged("drop-of-load-that-reverses-the", drops[meshes[-1]], 2.0 / meshes[-1], finest=meshes[-1]))
    return Result(tuple(rows), exact_columns(COLUMNS, table), lambda figure: _draw(figure, nu, found, shown))


def _cycle_rows(nu: float, table: list[Any], counts: tuple[int, ...], found: list[Profile]) -> Iterator[Row]:
    at = {r[3]: r for r in table if r[1] == nu and r[2] == 20}
    here = f"cylinder, nu = {nu:g}, 20 points to a"
    few, many = counts[-2], counts[-1]
    rate = float(np.log(abs((at[counts[0]][7] - 1.0) / (at[many][7] - 1.0))) / np.log(many / counts[0]))
    extrapolated = at[many][7] + (at[many][7] - at[few][7]) * few**2 / (many**2 - few**2)
    released = found[2 * many - 1]
    yield judged("work-over-work-lost-increments", at[many][7], here=here, many=many)
    yield judged("work-lost", at[many][8], here=here)
    yield judged("force-after-release-n", released.force, here=here)
    if many == 400:
        yield judged("work-over-work-lost-extrapolated-in", extrapolated, here=here, few=few, many=many)
        yield judged("rate-at-which-the-excess", rate, here=here)


def _draw(figure: Any, nu: float, found: list[Profile], shown: list[Profile]) -> None:
    left, right = figure.subplots(1, 2)
    half = found[: len(found) // 2]
    force = np.array([0.0, *(p.force for p in half)]) / max(p.force for p in half)
    depth = np.array([0.0, *(p.frame.target.depth_mm for p in half)])
    top = len(half) // 2
    pressing = np.interp(depth, depth[: top + 1], force[: top + 1])
    left.plot(depth / depth.max(), 1e3 * (force - pressing), label=f"nu = {nu:g}, mu = {MU:g}")
    left.set(xlabel="depth / largest", ylabel="force - that of the press, 0.1 %", title="the loop, opened")
    less = f"load less {100 * (1 - shown[-1].force / shown[0].force):.2g} %"
    for profile, name in ((shown[0], "loaded"), (shown[-1], less)):
        inside = (profile.x >= 0.0) & (profile.status != OPEN)
        right.plot(profile.x[inside] / shown[0].a, profile.q[inside] / (MU * profile.p[inside]), ".-", label=name)
    right.set(xlabel="x / half width", ylabel="friction / (mu pressure)", title="friction reverses first")
