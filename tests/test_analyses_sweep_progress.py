"""Progress of a sweep: sizes of batches, times left, points given up."""

from __future__ import annotations

import pytest

from finger3d.analyses.sweep.progress import BodyPoints, SweepProgress, duration
from finger3d.analyses.sweep.store import ResultStore
from finger3d.progress import Progress
from tests.sweep_cases import points_of


@pytest.mark.parametrize(("seconds", "text"), [(0.2, "1 s"), (89.0, "89 s"), (180.0, "3 min"), (5400.0, "1.5 h")])
def test_durations_are_short_texts(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_a_batch_takes_about_two_seconds_and_failed_points_do_not_change_it(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.1,0.2,0.3")
    (spec,) = sweep.bodies.values()
    body = BodyPoints(spec, list(sweep.points))
    body.advance([{"point": 0, "seconds": 0.1}])
    assert (body.size, [point.number for point in body.left]) == (20, [1, 2])
    body.advance([{"point": 1, "outcome": "no mesh"}])
    assert (body.size, [point.number for point in body.left]) == (20, [2])


def test_points_that_are_given_up_are_lost_with_the_reason(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.1,0.2")
    (spec,) = sweep.bodies.values()
    with ResultStore(sweep, tmp_path).open() as store:
        SweepProgress(store, Progress()).give_up(BodyPoints(spec, list(sweep.points)), "its worker died")
        assert [row["outcome"] for row in store.lost.values()] == ["its worker died"] * 2
        assert len(store.left()) == 2
