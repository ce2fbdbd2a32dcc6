"""``python -m finger3d``."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from finger3d.cli import main as cli
from tests.scenes import HALF_CYLINDER


def test_python_m_runs_the_command_line(tmp_path) -> None:
    command = [sys.executable, "-m", "finger3d", "plan", "nothing.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "finger3d: nothing.toml: there is no such file\n"
    assert done.stdout == ""


def run(words: list[str], before: str = "", **settings: object) -> subprocess.CompletedProcess[str]:
    """Run finger3d in a shell, after another command in it."""
    line = f'{before} exec "$@"'
    command = ["bash", "-c", line, "bash", sys.executable, "-m", "finger3d", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **settings)


def test_a_working_folder_that_was_removed_is_told(tmp_path, root) -> None:
    scene, gone = str(root / "geometries" / "edge.toml"), tmp_path / "gone"
    gone.mkdir()
    env = {**os.environ, "PYTHONPATH": str(root)}
    for out in ("o", str(tmp_path / "o")):
        done = run(["press", scene, "--out", out], f"cd {gone}; rmdir {gone};", cwd=tmp_path, env=env)
        assert done.returncode == 2
        assert done.stderr == "finger3d: the working folder has been removed; change into one that exists\n"
        gone.mkdir()


@pytest.mark.parametrize("words", [["--out", ""], ["--out="]])
def test_an_empty_value_is_refused(words, tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli(["press", "scene.toml", *words]) == 2
    assert capsys.readouterr().err == "finger3d: the value after --out is empty; give one\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform != "linux", reason="ulimit -v")
@pytest.mark.parametrize("kilobytes", [200_000, 380_000, 420_000, 1_500_000])
def test_a_limit_of_the_address_space_ends_with_one_line_or_a_result(kilobytes, root, tmp_path) -> None:
    """OpenBLAS repeats an allocation without end, so that a press would never end."""
    scene = tmp_path / "scene.toml"
    scene.write_text(HALF_CYLINDER, encoding="utf-8")
    words = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
    env = {**os.environ, "PYTHONPATH": str(root), "OMP_NUM_THREADS": "1", "FINGER3D_CACHE": str(tmp_path)}
    env |= {"OPENBLAS_NUM_THREADS": "1"}
    done = run(words, f"ulimit -v {kilobytes};", env=env)
    assert done.returncode == (0 if kilobytes == 1_500_000 else 3), done.stderr
    if done.returncode:
        assert done.stderr.splitlines()[-1].startswith("finger3d: out of memory")
        assert "Traceback" not in done.stderr
