"""A command does its work whatever becomes of the terminal, and however narrow that is."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from finger3d.cli.terminal import SafeStream, legible_width, safe_streams

SECTION = [
    "--set", "model.domain=plane-strain", "--set", "mesh.size_mm=8", "--set", "mesh.base_size_mm=16", "--set",
    "press.steps=3", "--set", "press.depth_mm=1", "--no-figures", "--no-error",
]  # fmt: skip
TITLE = "Fingerkuppe \u2028 \u00fc"


@pytest.mark.parametrize(
    "redirection", ["| head -1", "> /dev/full", ">&-", ">&- 2>&- <&-", "2>/dev/full >&-", "> ascii"]
)
def test_results_are_written_whatever_becomes_of_the_terminal(root: Path, tmp_path: Path, redirection: str) -> None:
    scene = root / "geometries" / "fig9.toml"
    command = [
        sys.executable,
        "-m",
        "finger3d",
        "press",
        str(scene),
        "--out",
        "out",
        "--set",
        'title="Kuppe \u00fc"',
        *SECTION,
    ]
    line = '"$@" ' + redirection + ("; exit ${PIPESTATUS[0]}" if "|" in redirection else "")
    env = {**os.environ, "PYTHONPATH": str(root), "PYTHONIOENCODING": "ascii", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        ["bash", "-c", line, "bash", *command], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))["outcome"] == "converged"
    assert {"contact.csv", "fields.vtu", "history.csv", "scene.toml"} <= {p.name for p in (tmp_path / "out").iterdir()}
    if redirection == "> ascii":
        assert "Kuppe \\xfc" in (tmp_path / "ascii").read_text(encoding="ascii")


def test_a_closed_descriptor_is_not_given_to_a_file(root: Path, tmp_path: Path) -> None:
    """Else what a library prints to descriptor 1 would end up in a file of results."""
    code = (
        "import os; from finger3d.cli.terminal import safe_streams\n"
        "with safe_streams():\n    file = open('data', 'w'); os.write(1, b'printed'); file.write(str(file.fileno()))"
    )
    env = {**os.environ, "PYTHONPATH": str(root)}
    line = f"'{sys.executable}' -c \"$1\" >&-"
    subprocess.run(["bash", "-c", line, "bash", code], cwd=tmp_path, env=env, check=True, stdin=subprocess.DEVNULL)
    assert int((tmp_path / "data").read_text()) > 2


class Broken(io.StringIO):
    def write(self, text: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


def test_a_stream_that_breaks_takes_no_more_output() -> None:
    stream = SafeStream(Broken())
    assert stream.write("text") == 4
    assert isinstance(stream.lost, BrokenPipeError)
    stream.flush()
    stream.writelines(["a", "b"])
    closed = io.StringIO()
    closed.close()
    stream = SafeStream(closed)
    print("text", file=stream, flush=True)
    assert isinstance(stream.lost, ValueError)


def test_what_an_encoding_lacks_is_escaped() -> None:
    raw = io.BytesIO()
    stream = SafeStream(io.TextIOWrapper(raw, encoding="ascii"))
    print(TITLE, "\udc80", file=stream, flush=True)
    assert raw.getvalue().decode("ascii") == "Fingerkuppe \\u2028 \\xfc \\udc80\n"
    assert stream.lost is None


def test_streams_are_put_back(capsys: pytest.CaptureFixture[str]) -> None:
    before = sys.stdout, sys.stderr
    with safe_streams():
        print("out")
        print("err", file=sys.stderr)
    assert (sys.stdout, sys.stderr) == before
    assert tuple(capsys.readouterr()) == ("out\n", "err\n")


@pytest.mark.parametrize("columns", ["0", "1", "2", "19"])
def test_help_ends_on_a_terminal_of_any_width(root: Path, columns: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(root), "COLUMNS": columns}
    command = [sys.executable, "-m", "finger3d", "press", "--help"]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 20
    assert "--out" in done.stdout


def test_the_width_is_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "3")
    with legible_width():
        assert os.environ["COLUMNS"] == "20"
    assert os.environ["COLUMNS"] == "3"
    monkeypatch.setenv("COLUMNS", "77")
    with legible_width():
        assert os.environ["COLUMNS"] == "77"
