"""Command ``validate``: exit codes and what is kept."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d import cli
from finger3d.analyses import validate as study
from finger3d.analyses.validate import Study
from tests.study_cases import STOPS, write_studies


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_studies(tmp_path / "validation")


@pytest.fixture
def own_studies(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(study, "studies", lambda: {n: Study(n, folder / f"{n}.py") for n in ("bad", "good", "stops")})
    (folder / "stops.py").write_text(STOPS)
    return folder


def test_the_command_tells_verdicts_by_its_exit_code(
    own_studies: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    assert cli.main(["validate", "good"]) == 0
    assert "pass" in capsys.readouterr().out
    assert cli.main(["validate", "good", "bad", "--out", str(tmp_path / "out")]) == 3
    assert "bad" in capsys.readouterr().err
    assert (tmp_path / "out" / "results" / "bad.csv").is_file()
    assert cli.main(["validate", "goood"]) == 2
    assert "'good'" in capsys.readouterr().err


def test_quick_results_never_replace_full_ones(own_studies: Path, capsys: pytest.CaptureFixture) -> None:
    assert cli.main(["validate", "good"]) == 0
    before = (own_studies / "results" / "good.csv").read_bytes()
    assert cli.main(["validate", "good", "--quick"]) == 0
    assert "1.501" in capsys.readouterr().out
    assert cli.main(["validate", "good", "--quick", "--out", str(own_studies)]) == 2
    assert (own_studies / "results" / "good.csv").read_bytes() == before


def test_an_interrupted_command_says_what_is_kept(own_studies: Path, capsys: pytest.CaptureFixture) -> None:
    assert cli.main(["validate", "good", "stops"]) == 130
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "1 of 2 studies" in err
    assert str(own_studies) in err


def test_the_names_of_the_studies_are_listed_and_none_runs(own_studies: Path, capsys: pytest.CaptureFixture) -> None:
    assert cli.main(["validate", "--list"]) == 0
    said = capsys.readouterr().out
    assert "good" in said
    assert "results" not in said
