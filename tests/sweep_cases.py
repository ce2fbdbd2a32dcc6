"""A sweep of the Fig. 9 finger on a coarse mesh, and its files."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import Sweep, checked_points, varied

COARSE = ["--set", "model.domain=plane-strain", "--set", "mesh.size_mm=4", "--set", "mesh.base_size_mm=16"]
SETS = COARSE[1::2]


def points_of(scene: Path, *vary: str) -> Sweep:
    return checked_points(scene, SETS, varied(vary))


def pressed_here(sweep: Sweep) -> list[dict]:
    """Rows of all points, without Dask."""
    return [
        row
        for key, body in sweep.bodies.items()
        for row in worker.rows(body, [p for p in sweep.points if p.body == key])
    ]


def lines(out: Path) -> list[dict]:
    """Rows of the journal, without their checksums."""
    found = [json.loads(line) for line in (out / "points.jsonl").read_text().splitlines()]
    return [{name: value for name, value in row.items() if name != "checksum"} for row in found]


def table(out: Path) -> list[dict]:
    with (out / "results.csv").open(newline="") as file:
        return list(csv.DictReader(file))
