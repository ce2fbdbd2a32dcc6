"""Page of a comparison of plane and solid models."""

from __future__ import annotations

from pathlib import Path

from finger3d.report.build import Figure, HeadlineRow, Page, PageSection, Table, how_modelled, number
from finger3d.results.summary import read_json, title_of

_FORCE = "force_N_per_mm"


def compare_page(folder: str | Path) -> Page:
    """Return the page of a comparison, from the files in its folder.

    Raises
    ------
    Finger3dError
        If compare.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "compare.json")
    numbers = data.get("table", ())
    own = data["scene"]["finger"].get("width_mm")
    cases = [c for c in data["cases"] if c["numbers"]]
    headline = [
        HeadlineRow(f"force per width, {c['model']}", c["numbers"][_FORCE], "N/mm", c["errors"].get(_FORCE))
        for c in cases
        if c["width_mm"] == own
    ]
    keys = list(dict.fromkeys(k for c in cases for k in c["numbers"]))
    rows = [
        (
            c["model"],
            c["width_mm"],
            c["size_mm"],
            *(number(c["numbers"][k], c["errors"].get(k)) if k in c["numbers"] else "" for k in keys),
            c["seconds"],
            c["outcome"],
        )
        for c in data["cases"]
    ]
    head = ("model", "width (mm)", "edges (mm)", *keys, "seconds", "outcome")
    proof = (
        "Each case is a separate press. It has numbers only if every increment satisfies Eqs. (1)-(4) of Maeno 2004, "
        "and friction opposes slip, to 1e-8. finger3d press reports the increments of a scene."
    )
    return Page(
        f"{title_of(data['scene'])}: 2D against 3D",
        headline,
        [
            PageSection("Verdict", [*data["verdict"], *([Table(numbers[0], numbers[1:])] if numbers else [])]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Every case", [proof, _BARS, Table(head, rows)]),
        ],
        [Figure("compare.png", "Force against width, tractions along x, and all quantities relative to the solid")],
        command="compare",
        outcome=data["outcome"],
        good=data["outcome"] == "converged",
        versions=data["versions"],
    )


_BARS = (
    "The number after ± is the error of mesh and increments. It is estimated, as by finger3d press, from a mesh with "
    "edges about twice as long (half as long if no coarser mesh is possible), and from more increments. Solids and "
    "sections of one width have the same edge lengths; on swept meshes the difference of their forces is therefore "
    "more accurate than either force. The verdict calls a deviation significant if it exceeds two error bars."
)
