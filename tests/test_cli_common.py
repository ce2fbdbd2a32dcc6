"""Shared parts of the commands: JSON alone on standard output, folders that are checked, tables of text."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest

import finger3d
import finger3d.analyses.press
from finger3d.errors import Outcome
from tests.commands import run


def test_what_a_job_prints_does_not_spoil_the_json(scene, tmp_path, monkeypatch, capsys) -> None:
    def press(scene, out, report, **options):
        print("a stray remark")
        summary = {"outcome": "converged", "warnings": ["Wärme"]}
        return SimpleNamespace(summary=lambda: summary, outcome=Outcome.CONVERGED)

    monkeypatch.setattr(finger3d.analyses.press, "press", press)
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["warnings"] == ["Wärme"]
    assert "a stray remark" in err
    assert "warning: Wärme" in err


@pytest.mark.parametrize("command", ["press", "compare", "plan"])
def test_a_mistake_with_json_leaves_standard_output_empty(command, tmp_path, capsys) -> None:
    out = [] if command == "plan" else ["--out", tmp_path / "out"]
    assert run(command, tmp_path / "nothing.toml", *out, "--json") == 2
    printed, err = capsys.readouterr()
    assert printed == ""
    assert len(err.splitlines()) == 1
