"""Progress: a bar on a terminal, lines elsewhere."""

from __future__ import annotations

import io
import re

import pytest

from finger3d.progress import BarProgress, PlainProgress, Progress, reporter


def work(report: Progress) -> Progress:
    with report:
        report.stage("meshing")
        report.say("mesh taken from the cache [quickly]")
        report.stage("pressing")
        report.step(1, 2, "force 1 N")
        report.remark("2 N at a depth of 1 mm")  # directly after a line
        report.step(2, 2)
    return report


def test_plain_report_writes_a_line_per_event() -> None:
    stream = io.StringIO()
    report = work(PlainProgress(stream))
    lines = [re.sub(r"^\[ *[\d.]+ s\] ", "", line) for line in stream.getvalue().splitlines()]
    assert lines == [
        "meshing",
        "mesh taken from the cache [quickly]",
        "pressing",
        "1 of 2: force 1 N",
        "2 of 2",
    ]
    assert (report.steps_done, report.steps_total) == (2, 2)


def test_the_silent_report_still_counts(capsys) -> None:
    report = work(Progress())
    assert (report.steps_done, report.steps_total) == (2, 2)
    assert capsys.readouterr() == ("", "")


def test_bar_report_keeps_what_is_said(capsys) -> None:
    report = work(BarProgress())
    assert report.steps_done == 2
    assert "mesh taken from the cache [quickly]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("terminal", "environment", "kind"),
    [
        (True, {"TERM": "xterm"}, BarProgress),
        (True, {"TERM": "dumb"}, PlainProgress),
        (True, {"TERM": "xterm", "CI": "true"}, PlainProgress),
        (False, {"TERM": "xterm"}, PlainProgress),
    ],
)
def test_reporter_fits_the_place(terminal, environment, kind, monkeypatch) -> None:
    for name in ("TERM", "CI"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr("sys.stdout.isatty", lambda: terminal)
    assert type(reporter()) is kind
