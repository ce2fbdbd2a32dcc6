"""Command ``completion``: scripts that a shell reads."""

from __future__ import annotations

import subprocess

import pytest

from finger3d.cli import app
from tests.commands import run

COMMANDS = [name for name in app if not name.startswith("-")]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(shell, capsys) -> None:
    assert run("completion", shell) == 0
    script = capsys.readouterr().out
    for command in COMMANDS:
        assert command in script


@pytest.mark.parametrize(
    ("typed", "offered"),
    [(["pre"], "press"), (["press", "scene.toml", "--no"], "--no-figures"), (["completion", "b"], "bash")],
)
def test_bash_completes_commands_options_and_choices(typed, offered, tmp_path, capsys) -> None:
    """bash reads the script, and is asked what it offers after what was typed."""
    run("completion", "bash")
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out)
    words = " ".join(["finger3d", *typed])
    ask = (
        f"source '{script}'; COMP_WORDS=({words}); COMP_CWORD={len(typed)}; COMP_LINE='{words}'; "
        'COMP_POINT=${#COMP_LINE}; f=$(complete -p finger3d | sed "s/.*-F \\([^ ]*\\).*/\\1/"); $f finger3d; '
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(["bash", "--norc", "-c", ask], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert offered in done.stdout.split()
