"""Command ``python -m validation``: exit codes and what is kept."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.study_cases import STOPS, write_studies
from validation import _runner as study
from validation.__main__ import main
from validation._runner import Study


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
    assert main(["good"]) == 0
    assert "pass" in capsys.readouterr().out
    assert main(["good", "bad", "--out", str(tmp_path / "out")]) == 3
    assert "bad" in capsys.readouterr().err
    assert (tmp_path / "out" / "results" / "bad.csv").is_file()
    assert main(["goood"]) == 2
    assert "'good'" in capsys.readouterr().err


def test_quick_results_never_replace_full_ones(own_studies: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["good"]) == 0
    before = (own_studies / "results" / "good.csv").read_bytes()
    assert main(["good", "--quick"]) == 0
    assert "1.501" in capsys.readouterr().out
    assert main(["good", "--quick", "--out", str(own_studies)]) == 2
    assert (own_studies / "results" / "good.csv").read_bytes() == before


def test_an_interrupted_command_says_what_is_kept(own_studies: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["good", "stops"]) == 130
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "1 of 2 studies" in err
    assert str(own_studies) in err


def test_a_study_of_the_checkout_as_json(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    assert main(["patch_test", "--quick", "--json", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    rows = json.loads(out)["studies"]["patch_test"]
    assert rows
    assert all(row["passed"] and row["error"] >= 0.0 for row in rows)
    assert "patch_test" in err


def test_the_studies_are_listed_with_their_questions(capsys: pytest.CaptureFixture) -> None:
    assert main(["--list"]) == 0
    assert "patch_test" in capsys.readouterr().out


def test_studies_of_increments_end_with_one_line_over_all_of_them(
    own_studies: Path, tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    counting = (own_studies / "good.py").read_text().replace("[1, 2]))", "[1, 2]), settled=Settled(3, 4, 2e-9))")
    (own_studies / "good.py").write_text(counting.replace("import Result", "import Settled, Result"))
    bad = (
        (own_studies / "bad.py")
        .read_text()
        .replace('measure="at most"),))', 'measure="at most"),), settled=Settled(5, 5, 1e-9))')
    )
    (own_studies / "bad.py").write_text(bad.replace("import Result", "import Settled, Result"))
    main(["good", "bad", "--out", str(tmp_path / "out")])
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == "8 of 9 increments settle, largest residual 2.0e-09"
