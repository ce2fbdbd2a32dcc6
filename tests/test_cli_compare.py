"""Command ``compare``: the verdict and its JSON."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

import finger3d.analyses.compare.run as compare_module
from finger3d.analyses.compare.cases import press_with_errors
from finger3d.cli import main
from finger3d.errors import Outcome
from finger3d.results.comparison import Case
from tests.commands import run
from tests.scenes import SWEPT_FINGER, written


@pytest.fixture
def scene(tmp_path) -> Path:
    return written(tmp_path, SWEPT_FINGER)


def test_compare_as_json_prints_its_file(scene, tmp_path, monkeypatch, capsys) -> None:
    import finger3d.analyses.compare.run

    def compare(scene, out, widths, report):
        report.stage("plane strain")
        out.mkdir()
        (out / "compare.json").write_text(json.dumps({"verdict": ["2D would do"], "outcome": "converged"}))
        return SimpleNamespace(verdict=("2D would do",), outcome=Outcome.CONVERGED, cases=())

    monkeypatch.setattr(finger3d.analyses.compare.run, "compare", compare)
    assert run("compare", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == {"verdict": ["2D would do"], "outcome": "converged"}
    assert "plane strain" in err


def test_the_command_prints_the_verdict(scene, tmp_path, capsys) -> None:
    assert main(["compare", str(scene), "--out", str(tmp_path / "out"), "--widths", "50"]) == 0
    out = capsys.readouterr().out
    assert "7 of 7" in out
    assert all(line in out for line in json.loads((tmp_path / "out" / "compare.json").read_text())["verdict"])


@pytest.mark.parametrize("widths", ["5,abc", "5,,20", "-5", "inf"])
def test_widths_that_are_none_are_refused_in_one_line(scene, tmp_path, capsys, widths) -> None:
    assert main(["compare", str(scene), "--out", str(tmp_path / "out"), f"--widths={widths}"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("finger3d: --widths")
    assert err.count("\n") == 1


def test_a_case_that_fails_is_named_and_the_others_are_kept(scene, tmp_path, monkeypatch, capsys) -> None:
    def failing(name, model):
        if name == "solid":
            return Case(name, model.design.width_mm, model.mesh.size_mm, "swept", Outcome.NO_CONVERGENCE)
        return press_with_errors(name, model)

    monkeypatch.setattr(compare_module, "press_with_errors", failing)
    assert main(["compare", str(scene), "--out", str(tmp_path / "out"), "--widths", "50"]) == 3
    captured = capsys.readouterr()
    assert "2 of 7 cases" in captured.err
    assert "solid, 20 mm wide" in captured.out
    told = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert told["outcome"] == str(Outcome.NO_CONVERGENCE)
    assert sum(bool(c["numbers"]) for c in told["cases"]) == 5


def test_an_interrupted_comparison_keeps_its_cases(scene, tmp_path, monkeypatch, capsys) -> None:
    def interrupted(name, model):
        if name == "solid":
            raise KeyboardInterrupt
        return press_with_errors(name, model)

    monkeypatch.setattr(compare_module, "press_with_errors", interrupted)
    assert main(["compare", str(scene), "--out", str(tmp_path / "out")]) == 130
    assert "2 of 16 cases" in capsys.readouterr().err
    told = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert told["outcome"].startswith("incomplete")
    assert [c["model"] for c in told["cases"]] == ["plane strain", "plane stress"]
