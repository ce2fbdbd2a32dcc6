"""Worker processes of a sweep: rows, deaths, and what cannot be pressed."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

from finger3d.analyses.sweep import local, worker
from finger3d.analyses.sweep.points import Sweep
from finger3d.analyses.sweep.store import BodyPoints, ResultStore, SweepProgress
from finger3d.progress import Progress
from tests.sweep_cases import points_of, pressed_here


def pressed(sweep: Sweep, folder: Path, workers: int) -> ResultStore:
    with ResultStore(sweep, folder).open() as store:
        bodies = [BodyPoints(spec, [p for p in sweep.points if p.body == key]) for key, spec in sweep.bodies.items()]
        local.press(bodies, SweepProgress(store, Progress()), workers)
        return store


def test_workers_return_the_rows_of_a_press_here(paper_scene: Path, tmp_path: Path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,0.1", "material.nu=0.3,0.4")
    store = pressed(sweep, tmp_path, 2)
    here = {row["point"]: row["normal_force_N"] for row in pressed_here(sweep)}
    assert {number: row["normal_force_N"] for number, row in store.rows.items()} == here


def killed_by(nu: str) -> Any:
    """A batch that kills its process if the body has this Poisson's ratio.

    `worker` is looked up where it runs: `worker.batch` itself would be pickled with the body that this process holds.
    """

    def batch(spec: Any, points: Any, size: int) -> Any:
        if spec.given["material"]["nu"] == float(nu):
            os.kill(os.getpid(), signal.SIGKILL)
        return worker.batch(spec, points, size)

    return batch


@pytest.mark.slow
def test_a_body_that_kills_every_worker_is_given_up_and_others_are_pressed(
    paper_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(local.worker, "batch", killed_by("0.3"))
    store = pressed(points_of(paper_scene, "material.nu=0.3,0.4"), tmp_path, 2)
    assert list(store.rows) == [1], store.lost
    assert "SIGKILL" in store.lost[0]["outcome"]


def test_what_a_worker_raises_is_told_with_the_points_that_are_lost(
    paper_scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def batch(spec: Any, points: Any, size: int) -> Any:
        raise LookupError("no such body")

    monkeypatch.setattr(local.worker, "batch", batch)
    store = pressed(points_of(paper_scene, "material.nu=0.3,0.4"), tmp_path, 1)
    assert not store.rows
    assert all(row["outcome"] == "LookupError: no such body" for row in store.lost.values())
