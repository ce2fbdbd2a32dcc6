"""The protocol of studies: judging, keeping, resuming, the index, and the command."""

from __future__ import annotations

from pathlib import Path

import pytest

import finger3d
from finger3d.errors import Finger3dError
from tests.study_cases import BAD, STOPS, write_studies
from validation import _runner as study
from validation._runner import chosen, kept_rows, run_studies, studies

PACKAGE = Path(finger3d.__file__).parent


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_studies(tmp_path / "validation")


def ran(home: Path, name: str) -> float:
    return (home / "results" / f"{name}.json").stat().st_mtime_ns


def test_results_are_kept_to_the_last_digit_and_indexed(folder: Path) -> None:
    known = studies(folder)
    found = run_studies(chosen(["good"], known), False, folder, known=known)
    assert kept_rows(folder, known["good"]) == found["good"]
    assert (folder / "results" / "good_table.csv").read_text().splitlines()[2] == f"2,{1 / 3!r}"
    assert (folder / "figures" / "good.png").read_bytes().startswith(b"\x89PNG")
    index = (folder / "README.md").read_text()
    assert "Is one and a half what it was?" in index
    assert "[rows](results/good.csv)" in index
    assert "yet: bad" in index
    run_studies(chosen(["bad"], known), False, folder, known=known)
    index = (folder / "README.md").read_text()
    assert "[good](good.py)" in index, "running one study keeps the rows of the others"
    assert index.count("**FAIL**") == 1


def test_a_run_of_all_leaves_out_what_is_up_to_date(folder: Path) -> None:
    known = studies(folder)
    run_studies(list(known.values()), False, folder, known=known)
    before = ran(folder, "good"), ran(folder, "bad")
    again = run_studies(list(known.values()), False, folder, resume=True, known=known)
    assert (ran(folder, "good"), ran(folder, "bad")) == before
    assert not again["bad"][0].passed, "a failure is not forgotten because it is old"
    (folder / "bad.py").write_text(BAD.replace("2e-8", "3e-8"))
    run_studies(list(known.values()), False, folder, resume=True, known=known)
    assert ran(folder, "good") == before[0]
    assert ran(folder, "bad") > before[1]


def test_a_changed_helper_makes_those_old_that_use_it(folder: Path) -> None:
    known = studies(folder)
    before = {name: known[name].stamp() for name in known}
    (folder / "_shared.py").write_text("VALUE = 1.4\n")
    assert {name for name in known if known[name].stamp() != before[name]} == {"good"}


def test_comments_and_docstrings_make_no_results_old(folder: Path) -> None:
    good = studies(folder)["good"]
    before = good.stamp()
    (folder / "_shared.py").write_text('"""A value."""\n\n# one and a half\nVALUE = 1.5\n"""In mm."""\n')
    assert good.stamp() == before
    (folder / "_shared.py").write_text("VALUE = 1.25\n")
    assert good.stamp() != before


def test_results_are_out_of_date_under_another_version_of_a_library(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = studies(folder)["good"]
    before = good.stamp()
    monkeypatch.setattr(study, "versions", lambda: {"scipy": "0.1"})
    assert good.stamp() != before


def test_what_shapes_numbers_makes_results_old() -> None:
    for name in ("io.py", "__init__.py", "scene/tables.py", "fem/solvers/condense.py", "effects/viscosity.py"):
        assert PACKAGE / name in study.sources(PACKAGE)


def test_an_interruption_keeps_the_studies_that_are_done(folder: Path) -> None:
    (folder / "stops.py").write_text(STOPS)
    known = studies(folder)
    report = study.Progress()
    with pytest.raises(KeyboardInterrupt):
        run_studies(chosen(["good", "stops", "bad"], known), False, folder, report, known=known)
    assert report.steps_done == 1
    assert kept_rows(folder, known["good"])
    assert not kept_rows(folder, known["bad"])


def test_a_study_that_times_the_machine_runs_in_full_only_by_name(folder: Path) -> None:
    (folder / "timed.py").write_text((folder / "good.py").read_text() + "\nBY_NAME = True\n")
    known = studies(folder)
    assert [s.name for s in chosen([], known)] == ["bad", "good"]
    assert [s.name for s in chosen([], known, quick=True)] == ["bad", "good", "timed"]
    assert [s.name for s in chosen(["timed"], known)] == ["timed"]


def test_an_unknown_name_is_answered_with_the_nearest(folder: Path) -> None:
    with pytest.raises(Finger3dError, match=r"'godd'.*'good'.* bad, good$"):
        chosen(["godd"], studies(folder))
