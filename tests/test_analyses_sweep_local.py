"""Worker processes of a sweep: rows, deaths, and what cannot be pressed."""

from __future__ import annotations

import os
import signal

import pytest

from finger3d.analyses.sweep import local
from finger3d.analyses.sweep.progress import BodyPoints, SweepProgress
from finger3d.analyses.sweep.store import ResultStore
from finger3d.errors import MissingError
from finger3d.progress import Progress
from tests.sweep_cases import points_of, pressed_here


def test_a_worker_returns_the_rows_of_a_press_here_and_its_death_is_told(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,0.1")
    (body,) = sweep.bodies.values()
    process = local.WorkerProcess()
    try:
        rows = process.batch(body, sweep.points, 2)
        here = pressed_here(sweep)
        assert [row["normal_force_N"] for row in rows] == [row["normal_force_N"] for row in here]
        with pytest.raises(RuntimeError, match="AttributeError: 'NoneType'"):
            process.batch(None, sweep.points, 1)
        os.kill(process._process.pid, signal.SIGKILL)
        with pytest.raises(EOFError):
            process.batch(body, sweep.points, 1)
        assert process.death() == "signal SIGKILL"
    finally:
        process.end()


def test_a_body_that_kills_every_worker_is_given_up_and_others_are_pressed(paper_scene, tmp_path, monkeypatch) -> None:
    sweep = points_of(paper_scene, "material.nu=0.3,0.4")
    deadly, started = sweep.points[0].body, []
    real = local.WorkerProcess.batch

    class Worker(local.WorkerProcess):
        def __init__(self) -> None:
            started.append(self)
            super().__init__()

        def batch(self, spec, points, size):
            if points[0].body == deadly:
                self._process.kill()
            return real(self, spec, points, size)

    monkeypatch.setattr(local, "WorkerProcess", Worker)
    with ResultStore(sweep, tmp_path).open() as store:
        bodies = [BodyPoints(sweep.bodies[point.body], [point]) for point in sweep.points]
        local.press(bodies, SweepProgress(store, Progress()), 1)
        assert list(store.rows) == [1]
        assert "every worker that was given this body died (signal SIGKILL)" in store.lost[0]["outcome"]
    assert len(started) == local.ATTEMPTS + 1


def test_a_worker_that_cannot_be_started_is_one_line(paper_scene, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(local.sys, "executable", str(tmp_path / "none"))
    sweep = points_of(paper_scene, "material.nu=0.3,0.4")
    with ResultStore(sweep, tmp_path / "out").open() as store:
        bodies = [BodyPoints(sweep.bodies[point.body], [point]) for point in sweep.points]
        with pytest.raises(MissingError, match="no worker could be started"):
            local.press(bodies, SweepProgress(store, Progress()), 2)
