"""The command line: exit codes, one-line errors, and what each command prints. Presses are faked here."""

from __future__ import annotations

import json
import re
import subprocess
import sys

import pytest

import finger3d
import finger3d.analyses.press
from finger3d.cli import app
from tests.commands import loaded, run

HEAVY = ("OCP", "build123d", "vtk", "vtkmodules", "pyvista", "pytetwild", "trimesh", "scipy", "numpy", "pydantic",
         "matplotlib")  # fmt: skip
COMMANDS = [name for name in app if not name.startswith("-") and app[name].show]
COLOUR = re.compile(r"\x1b\[(?:[\d;]*;)?(?:3[0-8]|4[0-8]|9\d|10[0-7])(?:;[\d;]*)?m")


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["prss"], '"press"'),
        (["press"], "SCENE"),
        (["press", "scene.toml"], "give --out FOLDER"),
        (["press", "scene.toml", "--ouut", "out"], "--out instead of --ouut"),
        (["press", "scene.toml", "--out"], "--out"),
        (["press", "scene.toml", "--out", "out", "--fast"], "--fast"),
        (["press", "scene.toml", "more.toml", "--out", "out"], "more.toml"),
        (["plan", "scene.toml", "--set"], "--set"),
        (["new", "a.toml", "b.toml"], "b.toml"),
        (["info", "--loud"], "--loud"),
    ],
)
def test_wrong_arguments_end_with_2_and_one_line(arguments, expected, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert expected in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [["--help"], ["press", "--help"], []])
def test_help_shows_examples(arguments, capsys) -> None:
    assert run(*arguments) == 0
    assert "finger3d press scene.toml --out out" in capsys.readouterr().out


def test_version(capsys) -> None:
    assert run("--version") == 0
    assert capsys.readouterr().out.strip() == finger3d.__version__


@pytest.mark.parametrize("code", ["import finger3d", "from finger3d.cli import main; main(['--help'])"])
def test_import_and_help_load_nothing_heavy(code) -> None:
    assert not loaded(code, *HEAVY)


# --- for scripts ------------------------------------------------------------------------------------------------------


def test_plan_and_info_as_json(scene, capsys) -> None:
    override = "effects.kinetic_friction={ratio = 0.7}"
    assert run("plan", scene, "--json", "--set", override, "--set", "friction.mu=0.3") == 0
    planned = json.loads(capsys.readouterr().out)
    assert planned["effects"] == {"kinetic_friction": {"ratio": 0.7, "branch": "keep"}}
    assert planned["forecast"]["dofs"] > 1000
    assert run("info", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["versions"]["finger3d"] == finger3d.__version__
    assert told["machine"]["cores"] >= 1


# --- help, completion, colours ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_an_example_and_a_text_for_every_option(command, capsys) -> None:
    assert run(command, "--help") == 0
    shown = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert re.search(rf"Example: .*finger3d {command}\b", shown)
    bare = [
        argument.names[0]
        for argument in app[command].assemble_argument_collection(parse_docstring=True)
        if argument.show and not argument.parameter.help
    ]
    assert bare == []


def on_a_terminal(arguments: list[str], **environment: str) -> str:
    """What a command prints on a terminal of its own."""
    import os
    import pty

    main_end, terminal = pty.openpty()
    env = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR", "CI", "COLORTERM")}
    env |= {"TERM": "xterm-256color", **environment}
    command = [sys.executable, "-m", "finger3d", *arguments]
    process = subprocess.Popen(command, stdout=terminal, stderr=terminal, stdin=terminal, env=env)
    os.close(terminal)
    pieces = []
    try:
        while piece := os.read(main_end, 65536):
            pieces.append(piece)
    except OSError:  # Linux: the other end was closed
        pass
    os.close(main_end)
    assert process.wait() == 0
    return b"".join(pieces).decode()


def test_colours_only_on_a_terminal_that_wants_them() -> None:
    """A pipe gets text alone; a terminal gets colours, none with NO_COLOR; a dumb one nothing it cannot show."""
    command = ["press", "--help"]
    done = subprocess.run([sys.executable, "-m", "finger3d", *command], capture_output=True, text=True, check=True)
    assert "\x1b" not in done.stdout + done.stderr
    assert COLOUR.search(on_a_terminal(command))
    assert not COLOUR.search(on_a_terminal(command, NO_COLOR="1"))
    assert "\x1b" not in on_a_terminal(["info"], TERM="dumb")
