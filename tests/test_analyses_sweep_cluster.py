"""Dask clusters of a sweep."""

from __future__ import annotations

import socket
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from finger3d.analyses.sweep import run as running
from finger3d.analyses.sweep import worker
from finger3d.analyses.sweep.cluster import Cluster
from finger3d.analyses.sweep.points import combinations
from finger3d.analyses.sweep.store import BodyPoints, ResultStore, SweepProgress
from finger3d.errors import MissingError
from finger3d.progress import Progress
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
            running.press_points(points_of(paper_scene, "friction.mu=0.1"), tmp_path, scheduler=address)
        assert time.monotonic() - start < 60.0


@pytest.mark.parametrize("threads", [1, None], ids=["a worker", "here"])
@pytest.mark.slow
def test_workers_gain_no_threads(threads, tmp_path, monkeypatch) -> None:
    """Two workers on two cores are as many as there is room for; a body pressed by this process takes them all."""
    pools = []

    class Pool(ThreadPoolExecutor):
        def __init__(self, most: int, **settings: object) -> None:
            pools.append(most)
            super().__init__(most, **settings)

    monkeypatch.setattr("finger3d.mechanics.march.parallel.ThreadPoolExecutor", Pool)
    monkeypatch.setattr("finger3d.mechanics.march.parallel.cores", lambda: 2)
    # from 1000 contact rows on presses run at once
    sweep = combinations(written(tmp_path, HALF_CYLINDER), ["mesh.size_mm=0.0045"], ["friction.mu=0.06,0.3,1"])
    (body,) = sweep.bodies.values()
    rows = worker.batch(body, sweep.points, 3) if threads else list(worker.rows(body, sweep.points))
    assert [row["point"] for row in rows] == [0, 1, 2]
    assert {row["outcome"] for row in rows} == {"converged"}
    assert pools == ([] if threads else [2])


class Restarted:
    """A cluster whose worker has been started again at another address after the first batch of a body."""

    status = "running"

    def __init__(self) -> None:
        self.workers, self.sent = {"tcp://old:1": 1}, []

    def nthreads(self) -> dict[str, int]:
        return self.workers

    def who_has(self, futures):
        return {f.key: ("tcp://old:1",) for f in futures}

    def cancel(self, futures, force: bool) -> None:
        for future in futures:
            future.cancelled = True

    def submit(self, task, spec, left, size, *, pure, workers, allow_other_workers):
        stranded = bool(self.sent)
        self.sent.append(workers)
        if len(self.sent) == 2:  # the worker dies while it presses this one
            self.workers = {"tcp://new:2": 1}
        reached = workers is None or not stranded
        return Batch(
            f"batch {len(self.sent)}", [{"point": p.number, "outcome": "converged"} for p in left[:1]], reached
        )


class Batch:
    """A future of Dask, which is there at once, or never if its worker is gone."""

    status = "finished"

    def __init__(self, key, rows, reached: bool) -> None:
        self.key, self.rows, self.reached, self.cancelled = key, rows, reached, False

    def add_done_callback(self, told) -> None:
        if self.reached:
            told(self)

    def result(self):
        return self.rows


def test_a_batch_whose_worker_is_gone_is_sent_to_any(paper_scene, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("finger3d.analyses.sweep.cluster._POLL_S", 0.01)
    sweep = points_of(paper_scene, "friction.mu=0.1,0.2,0.3")
    client = Restarted()
    with ResultStore(sweep, tmp_path).open() as store:
        (spec,) = sweep.bodies.values()
        kept = Cluster(client, SweepProgress(store, Progress()))
        monkeypatch.setattr(kept.progress, "add", lambda row: None)
        kept.press([BodyPoints(spec, list(sweep.points))])
    assert client.sent[:3] == [None, ["tcp://old:1"], None]
