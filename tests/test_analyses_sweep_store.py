"""Results of a sweep as they are kept, what is refused, and what is told of the progress."""

from __future__ import annotations

import errno
import json
import os

import pytest

from finger3d.analyses.sweep.points import combinations
from finger3d.analyses.sweep.store import BodyPoints, ResultStore, SweepProgress, duration
from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError
from finger3d.progress import Progress
from finger3d.results.journal import Journal, Row
from tests.sweep_cases import COARSE, SETS, lines, points_of, pressed_here


def test_a_torn_line_is_dropped_and_its_point_done_again(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        kept.add(rows[0])
    journal = tmp_path / "points.jsonl"
    whole = journal.read_text()
    journal.write_text(whole + json.dumps(rows[1])[:50])
    with ResultStore(sweep, tmp_path).open() as kept:
        assert kept.left() == [sweep.points[1]]
        kept.add(rows[1])
    assert lines(tmp_path) == rows


def test_a_journal_edited_by_hand_is_one_line(paper_scene, tmp_path, capsys) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        for row in rows:
            kept.add(row)
    journal, before = tmp_path / "points.jsonl", (tmp_path / "points.jsonl").read_text()
    command = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)]
    edited = before.splitlines()[1].replace('"point": 1', '"point": 0')
    journal.write_text(before.splitlines()[0] + "\n" + edited + "\n")
    assert main(command) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert f"{journal}: line 2: " in err
    assert journal.read_text().splitlines()[1] == edited  # nothing is lost
    journal.unlink()
    journal.mkdir()
    assert main(command) == 2
    assert str(journal) in capsys.readouterr().err


def test_a_damaged_sweep_json_is_one_line(paper_scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(paper_scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    path = tmp_path / "sweep.json"
    whole = json.loads(path.read_text())
    vary = [None, 5, [], "a", {"friction.mu": 5}, {"friction.mu": [5]}, {"friction.mu": None}]
    texts = ["", "{", "null", "5", "[]", '"a"', "{}", "[" * 100_000, *(json.dumps({**whole, "vary": v}) for v in vary)]
    for data in [*(text.encode() for text in texts), b'{"vary": "\xe9"}']:
        path.write_bytes(data)
        for command in (
            ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)],
            ["show", str(tmp_path), "--png", str(tmp_path / "a.png")],
        ):
            assert main(command) == 2, data
            err = capsys.readouterr().err
            assert len(err.splitlines()) == 1, err
            assert str(tmp_path) in err
        assert path.read_bytes() == data


@pytest.mark.parametrize("data", [b"point\n\xe9", b'point\n"' + b"a" * 200_000])
def test_a_damaged_table_is_one_line(data, tmp_path, capsys) -> None:
    (tmp_path / "sweep.json").write_text('{"vary": {"friction.mu": ["0.1", "0.2"]}}')
    (tmp_path / "results.csv").write_bytes(data)
    assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert str(tmp_path / "results.csv") in err


def test_a_folder_of_another_sweep_is_refused(paper_scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(paper_scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    arguments = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,2", "--out", str(tmp_path)]
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert 'friction.mu is ["0.06", "1"]' in err


@pytest.mark.parametrize(
    ("vary", "expected"),
    [
        (["friction.mu=0.06,1", "material.nu=0.4"], "material.nu"),
        (["material.nu=0.4"], "friction.mu"),
    ],
)
def test_what_makes_it_another_sweep_is_named(vary, expected, paper_scene, tmp_path) -> None:
    with ResultStore(points_of(paper_scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    with pytest.raises(Finger3dError, match=expected), ResultStore(points_of(paper_scene, *vary), tmp_path).open():
        pass
    other = combinations(paper_scene, [*SETS, "press.steps=3"], ["friction.mu=0.06,1"])
    with pytest.raises(Finger3dError, match="another scene"), ResultStore(other, tmp_path).open():
        pass


@pytest.mark.parametrize("name", ["points.jsonl", "results.parquet"])
def test_a_full_disk_is_one_line_that_says_what_is_kept(name, paper_scene, tmp_path, monkeypatch) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    kept = ResultStore(sweep, tmp_path)
    with kept.open():
        kept.add(rows[0])
        if name == "results.parquet":
            real = os.replace

            def full(source: object, target: object) -> None:
                if str(target).endswith(".parquet"):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                real(source, target)

            monkeypatch.setattr(os, "replace", full)
            act = kept.write
        else:

            def append(journal: Journal, row: Row) -> None:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

            monkeypatch.setattr(Journal, "append", append)
            act = lambda: kept.add(rows[1])  # noqa: E731
        with pytest.raises(MissingError, match=r"; 1 of 2 points") as told:
            act()
    assert name in str(told.value)
    with ResultStore(sweep, tmp_path).open() as again:
        assert again.left() == [sweep.points[1]]


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
