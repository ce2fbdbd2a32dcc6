"""Command app: it serves the page of a scene until it is interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from finger3d.cli import main
from tests.scenes import SECTION, written


def test_the_page_is_served_and_ends_on_an_interruption(tmp_path: Path) -> None:
    scene = written(tmp_path, SECTION)
    command = [sys.executable, "-m", "finger3d", "app", str(scene), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        url = next(line.split()[-1] for line in running.stdout if "http" in line)
        with urllib.request.urlopen(url, timeout=30) as page:
            assert page.status == 200
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=30)
    assert running.returncode == 130
    assert said == "finger3d: interrupted; the page is closed\n"


def test_an_effect_that_takes_seconds_is_refused_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = written(tmp_path, SECTION)
    assert main(["app", str(scene), "--set", "effects.large_deformation={}", "--no-browser"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert "large_deformation" in said[-1]
