"""How do time and memory of a press grow with the unknowns and with the contact rows, stage by stage?

The Fig. 9 finger, 20 mm wide, nu = 0.49, mu = 0.25, 10 mm in ten increments on swept meshes, pressed by the main job
with all its output, figures, error bars and page, each in a process of its own.  One series refines the body, up to
1 000 000 unknowns; the other refines the contact alone, up to 10 000 rows.  A sweep over sixteen bodies is timed with
one worker and with two.

Source: the theory of nested dissection (George 1973) gives O(n^2) operations and O(n^(4/3)) entries of the factor in
3D; a Newton step of the contact is a dense solve, O(rows^3) at worst.  Powers are those of processor time, which other
work on the machine changes less than wall time.  The limits of memory and contact are goals of this project.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from finger3d._machine import cores

from ._child import Bench, available_gb, best_of
from ._rows import Result, Row, grouped, listed, of_records
from ._scaling import BODIES, STAGES, Size, sweep_seconds

Runs = Mapping[Size, dict[str, Any]]

BY_NAME = True
judged = listed(__file__)
LIMITS_MB = {40_000: 2_000.0, 160_000: 5_000.0, 1_000_000: 20_000.0}
CONTACT_LIMIT = 10_000, 180.0  # rows, and seconds of ten increments
UNKNOWNS = (Size(2.4, 9.6), Size(1.25, 5.0), Size(0.95, 3.8), Size(0.73, 2.92), Size(0.95, 1.25), Size(0.95, 0.98),
            Size(0.9, 0.9))  # fmt: skip
ROWS = (Size(2.4, 9.6), Size(1.3, 16.0), Size(0.77, 16.0), Size(0.52, 16.0), Size(0.385, 16.0))
SWEPT = Size(1.45, 6.0)
WORKER_TRIES = 3
NEED_GB = {Size(0.95, 1.25): 10.0, Size(0.95, 0.98): 15.0, Size(0.9, 0.9): 21.5, Size(0.385, 16.0): 10.0}


def run(quick: bool) -> Result:
    """All sizes; quick: a section and a small solid without limits that they could miss."""
    unknowns, rows = _sizes(quick)
    with Bench("_scaling") as bench:
        wanted = lambda s: 1 if quick or s > 8.0 else 2  # noqa: E731
        runs = best_of(bench, "pressed", dict.fromkeys([*unknowns, *rows]), wanted)
    found = [*_memory_rows(runs), *_contact_rows(runs), *_growth_rows(runs, unknowns, quick)]
    found.append(judged("factorisations", max(run["factorizations"] for run in runs.values())))
    found += [] if quick or cores() < 2 else _workers()
    table = _table(runs, unknowns, rows)
    return Result(tuple(found), table, lambda figure: _draw(figure, table))


def _sizes(quick: bool) -> tuple[list[Size], list[Size]]:
    if quick:
        return [Size(8.0, 32.0, figures=False), Size(4.0, 16.0, figures=False)], [Size(4.0, 16.0, figures=False)]
    free = available_gb()
    unknowns, rows = ([s for s in sizes if NEED_GB.get(s, 0.0) < free] for sizes in (UNKNOWNS, ROWS))
    return unknowns, rows


def _memory_rows(runs: Runs) -> Iterator[Row]:
    """The peak of the smallest run that has as many unknowns as a limit speaks of."""
    for dofs, limit in LIMITS_MB.items():
        found = sorted((r["dofs"], r["peak_MB"]) for r in runs.values() if r["dofs"] >= dofs)
        if found:
            yield judged("peak-memory", found[0][1], limit, unknowns=found[0][0])


def _contact_rows(runs: Runs) -> list[Row]:
    """The time of the smallest contact that has as many rows as the limit speaks of."""
    least, limit = CONTACT_LIMIT
    found = sorted((r["rows"], r["seconds"]["contact"]) for r in runs.values() if r["rows"] >= least)
    return [judged("contact-of-ten-increments", seconds, limit, rows=rows) for rows, seconds in found[:1]]


def _growth_rows(runs: Runs, unknowns: Sequence[Size], quick: bool) -> list[Row]:
    """Exponents over the larger sizes, at most those of theory."""
    if quick:
        force = [runs[s]["force"] for s in unknowns]
        return [judged("force-on-two-meshes", force[0], force[1])]
    big = [s for s in unknowns if runs[s]["dofs"] > 30_000]
    dofs = np.log([runs[s]["dofs"] for s in big])

    def growth(values: Sequence[float]) -> float:
        return float(np.polyfit(dofs, np.log(values), 1)[0])

    assembly, factor = (growth([runs[s]["processor_seconds"][k] for s in big]) for k in ("assembly", "condensation"))
    memory = growth([runs[s]["peak_MB"] for s in big])
    return [
        judged("growth-of-assembly", assembly),
        judged("growth-of-condensation", factor),
        judged("growth-of-memory", memory, 4.0 / 3.0),
    ]


def _workers() -> list[Row]:
    # in turn, and the shorter time of each counts: what others do on the machine only ever makes it longer
    tries = [[sweep_seconds(SWEPT, count) for count in (1, 2)] for _ in range(WORKER_TRIES)]
    one, two = (min(times) for times in zip(*tries, strict=True))
    return [judged("two-workers", one / two, bodies=BODIES, seconds=one, tries=WORKER_TRIES)]


def _table(runs: Runs, unknowns: Sequence[Size], rows: Sequence[Size]) -> dict[str, Any]:
    return of_records([
        {"series": series, "size_mm": s.size, "base_size_mm": s.base, "dofs": r["dofs"], "rows": r["rows"],
         "iterations": r["iterations"], "force_N": r["force"], "load": round(r["load"], 2),
         **{f"{k}_s": round(v, 3) for k, v in r["seconds"].items()},
         **{f"{k}_processor_s": round(v, 3) for k, v in r["processor_seconds"].items()},
         "seconds": round(sum(r["seconds"].values()), 3),
         **{f"{k}_peak_MB": round(v, 1) for k, v in r["peaks"].items()}, "peak_MB": round(r["peak_MB"], 1)}
        for series, sizes in (("unknowns", unknowns), ("contact rows", rows))
        for s in sizes
        for r in (runs[s],)
    ])  # fmt: skip


def _draw(figure: Any, table: Mapping[str, Any]) -> None:
    """Seconds and memory of every stage, over both series."""
    figure.set_size_inches(12.0, 9.0)
    titles = {"unknowns": "contact and body refined", "contact rows": "only the contact refined"}
    for (top, low), (series, t) in zip(figure.subplots(2, 2).T, grouped(table, "series"), strict=True):
        x = t["dofs" if series == "unknowns" else "rows"]
        for stage in STAGES:
            top.loglog(x, t[f"{stage}_s"], "o-", ms=4, label=stage)
            low.loglog(x, t[f"{stage}_peak_MB"], "o-", ms=4, label=stage)
        top.loglog(x, t["seconds"], "ks--", ms=4, label="all")
        if series == "unknowns":
            low.loglog(*zip(*LIMITS_MB.items(), strict=True), "k_", ms=24, label="limit of all")
        top.set(title=titles[series], ylabel="time of the stage (s)")
        low.set(xlabel=series, ylabel="peak memory of the stage (MB)")
