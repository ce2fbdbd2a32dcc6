"""The page of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from finger3d.report.build import Figure, HeadlineRow, PageSection, Table, number, write_page
from finger3d.report.scene import how_modelled
from finger3d.results.summary import read_json, title_of

_FORCE = "force_N_per_mm"


def compare_page(folder: str | Path) -> Path:
    """Write report.html of a comparison from what is in its folder.

    Raises
    ------
    Finger3dError
        If there is no compare.json to read, or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "compare.json")
    own = data["scene"]["finger"].get("width_mm")
    cases = [c for c in data["cases"] if c["numbers"]]
    headline = [
        HeadlineRow(f"force per width, {c['model']}", c["numbers"][_FORCE], "N/mm", c["errors"].get(_FORCE))
        for c in cases
        if c["width_mm"] == own and c["model"] != "solid, ends held"
    ]
    keys = list(dict.fromkeys(k for c in cases for k in c["numbers"]))
    rows = [
        (c["model"], c["width_mm"], c["size_mm"], *(_with_error(c, k) for k in keys), c["seconds"], c["outcome"])
        for c in data["cases"]
    ]
    head = ("model", "width (mm)", "edges (mm)", *keys, "seconds", "outcome")
    proof = (
        "Each case is a press of its own. It has numbers only if every step of it met Eqs. (1)-(4) of the paper and "
        "friction opposing slip to 1e-8; press the scene for its steps."
    )
    return write_page(
        folder,
        f"{title_of(data['scene'])}: 2D against 3D",
        headline,
        [
            PageSection("Verdict", list(data["verdict"])),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Every case", [proof, _BARS, Table(head, rows)]),
        ],
        [Figure("compare.png", "Force against width, tractions along x, and every quantity beside the solid's")],
        command="compare",
        outcome=data["outcome"],
        good=data["outcome"] == "converged",
        versions=data["versions"],
    )


_BARS = (
    "After ±: the error by mesh and increments, estimated as finger3d press does: from a mesh with edges about twice "
    "as long (half as long where none is coarser), and from more increments. Solids and sections of one width share "
    "their edge lengths, so on swept meshes the deviation of their forces is known better than either force. The "
    "verdict calls a deviation told from the limit where it is two bars away."
)


def _with_error(case: Mapping[str, Any], key: str) -> str:
    if key not in case["numbers"] or case["numbers"][key] is None:
        return ""
    return number(case["numbers"][key], case["errors"].get(key))
