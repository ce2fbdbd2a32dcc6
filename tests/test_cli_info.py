"""Command ``info``: versions, machine and folders."""

from __future__ import annotations

import subprocess
import sys

import finger3d
import finger3d.analyses.press
from tests.commands import run


def test_info_names_versions_and_machine(capsys) -> None:
    assert run("info") == 0
    out = capsys.readouterr().out
    for text in ("finger3d", "numpy", "build123d", "pytetwild", "vtk", "python", "cores", "memory", "cache", "PARDISO"):
        assert text in out
    assert finger3d.__version__ in out


def test_the_table_prints_where_only_ascii_can_be_written() -> None:
    command = [sys.executable, "-m", "finger3d", "info"]
    environment = {"PYTHONIOENCODING": "ascii", "PATH": ""}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "PARDISO" in done.stdout
