"""Rows that a worker returns."""

from __future__ import annotations

from dataclasses import replace

import pytest

from finger3d.analyses.sweep import worker
from finger3d.errors import Finger3dError
from tests.sweep_cases import points_of, pressed_here


def test_a_body_that_cannot_be_built_and_a_point_that_fails_are_rows(paper_scene, monkeypatch) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")

    def fails(*arguments: object, **settings: object) -> None:
        raise Finger3dError("no mesh")

    monkeypatch.setattr(worker, "SharedBody", fails)
    assert [row["outcome"] for row in pressed_here(sweep)] == ["no mesh", "no mesh"]

    class Weak:
        seconds = 0.0

        def presses(self, variants: list, most: int | None) -> list:
            return [MemoryError() for _ in variants]

    monkeypatch.setattr(worker, "SharedBody", lambda *a, **k: Weak())
    assert [row["outcome"] for row in pressed_here(sweep)] == ["MemoryError: no further information"] * 2


def test_a_worker_with_other_source_presses_nothing(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06")
    (spec,) = sweep.bodies.values()
    with pytest.raises(Finger3dError, match="not the one that the sweep was started with"):
        worker.batch(replace(spec, key="other"), sweep.points, 1)
    assert worker.batch(spec, sweep.points, 1)[0]["outcome"] == "converged"
