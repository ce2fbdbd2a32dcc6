"""``python -m finger3d``."""

from __future__ import annotations

import subprocess
import sys


def test_python_m_runs_the_command_line(tmp_path) -> None:
    command = [sys.executable, "-m", "finger3d", "plan", "nothing.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "finger3d: nothing.toml: there is no such file\n"
    assert done.stdout == ""
