"""Command ``press``: its table, its JSON, its exit codes. Presses are faked."""

from __future__ import annotations

import json

import pytest

import finger3d
import finger3d.analyses.press
from finger3d.errors import MissingError, Outcome
from tests.commands import run


def test_press_prints_the_closing_table(scene, tmp_path, fake_press, capsys) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--set", "friction.mu=0.5", "--set=press.steps=2") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert fake_press.figures is True
    assert fake_press.scene.model().friction.mu == 0.5
    assert fake_press.scene.legs[0].steps == 2
    for text in (
        "converged",
        "304.5 N",
        "72 mm",
        "17 mm",
        "3.0e-11",
        "-0.0123",
        "0.125 MPa",
        "summary.json",
        "Fig. 9 finger",
    ):
        assert text in out
    for text in ("meshing", "mesh taken from the cache", "2 of 2: remark 1"):
        assert text in out


def test_press_without_figures(scene, tmp_path, fake_press) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--no-figures") == 0
    assert fake_press.figures is False


def test_press_that_does_not_converge_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = Outcome.NO_CONVERGENCE
    assert run("press", scene, "--out", tmp_path / "out") == 3
    out, err = capsys.readouterr()
    assert "5 mm, increment 1 " in out  # the numbers of the one that converged
    assert len(err.splitlines()) == 1
    assert str(Outcome.NO_CONVERGENCE) in err
    assert "1 of 2 increments" in err


def test_press_that_misses_something_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = MissingError("no mesher; install pytetwild")
    assert run("press", scene, "--out", tmp_path / "out") == 3
    assert capsys.readouterr().err == "finger3d: no mesher; install pytetwild\n"


def test_an_interrupted_press_ends_with_130_and_says_what_is_kept(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = KeyboardInterrupt()
    assert run("press", scene, "--out", tmp_path / "out") == 130
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert "2 of 2 increments" in err
    assert str(tmp_path / "out") in err


def test_an_interruption_before_the_first_step(scene, tmp_path, monkeypatch, capsys) -> None:
    def press(scene, out, report, figures=True, error=True, least_grip=False):
        raise KeyboardInterrupt

    monkeypatch.setattr(finger3d.analyses.press, "press", press)
    assert run("press", scene, "--out", tmp_path / "out") == 130
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert err.startswith("finger3d: interrupted")
    assert str(tmp_path / "out") not in err  # nothing is kept there


@pytest.mark.parametrize(
    ("out", "expected"),
    [
        ("scene.toml", "is a file"), ("scene.toml/deeper", "deeper"), (".", "scene.toml"),
        ("circle", "circle is a link that leads nowhere"), ("circle/deeper", "circle is a link that leads nowhere"),
    ],
)  # fmt: skip
def test_press_refuses_a_folder_it_cannot_use_before_any_work(
    out, expected, scene, tmp_path, fake_press, capsys
) -> None:
    before = scene.read_bytes()
    (tmp_path / "circle").symlink_to("circle")
    assert run("press", scene, "--out", tmp_path / out) == 2
    printed, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert "--out" in err
    assert expected in err
    assert printed == ""
    assert fake_press.scene is None
    assert scene.read_bytes() == before


def test_press_as_json_prints_the_summary_alone(scene, tmp_path, fake_press, capsys) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "2 of 2: remark 1" in err


def test_press_as_json_that_does_not_converge(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = Outcome.NO_CONVERGENCE
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 3
    out, err = capsys.readouterr()
    assert json.loads(out)["outcome"] == str(Outcome.NO_CONVERGENCE)
    assert "1 of 2 increments" in err
