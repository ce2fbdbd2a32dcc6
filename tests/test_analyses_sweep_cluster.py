"""Dask clusters of a sweep."""

from __future__ import annotations

import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from finger3d.analyses.sweep import run as running
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.points import combinations
from finger3d.errors import MissingError
from tests.scenes import HALF_CYLINDER, written
from tests.sweep_cases import points_of


def test_a_scheduler_that_does_not_answer_is_left_after_the_time_limit(paper_scene, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.cluster.CONNECT_S", 1.0)
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        address = f"tcp://127.0.0.1:{deaf.getsockname()[1]}"
        start = time.monotonic()
        with pytest.raises(MissingError, match="scheduler"):
            running.sweep(points_of(paper_scene, "friction.mu=0.1"), tmp_path, scheduler=address)
        assert time.monotonic() - start < 10.0


@pytest.mark.parametrize("threads", [1, None], ids=["a worker", "here"])
def test_workers_gain_no_threads(threads, tmp_path, monkeypatch) -> None:
    """Two workers on two cores are as many as there is room for; a body pressed by this process takes them all."""
    pools = []

    class Pool(ThreadPoolExecutor):
        def __init__(self, most: int, **settings: object) -> None:
            pools.append(most)
            super().__init__(most, **settings)

    monkeypatch.setattr("finger3d.mechanics.parallel.ThreadPoolExecutor", Pool)
    monkeypatch.setattr("finger3d.mechanics.parallel.cores", lambda: 2)
    # from 1000 contact rows on presses run at once
    sweep = combinations(written(tmp_path, HALF_CYLINDER), ["mesh.size_mm=0.0045"], ["friction.mu=0.06,0.3,1"])
    (body,) = sweep.bodies.values()
    rows = worker.batch(body, sweep.points, 3) if threads else list(worker.rows(body, sweep.points))
    assert [row["point"] for row in rows] == [0, 1, 2]
    assert {row["outcome"] for row in rows} == {"converged"}
    assert pools == ([] if threads else [2])
