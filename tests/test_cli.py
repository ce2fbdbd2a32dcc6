"""The command line: what is common to all commands, streams, refusals, and commands that help to write."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import finger3d
import finger3d.analyses.press
from finger3d.cli import app, main
from finger3d.effects import effect_names
from finger3d.errors import Outcome
from finger3d.mechanics.model import MeshOptions
from finger3d.scene import load
from finger3d.scene.schema import schema
from tests.commands import loaded, refused, run
from tests.scenes import BLOCK, written

# --- the command line: exit codes, one-line errors, and what each command prints. Presses are faked here -------------


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
        (["plan", "scene.toml", "--set"], "--set"),
        (["completion", "bash"], "completion is gone: use finger3d --completion SHELL"),
        (["schema"], "schema is gone: use finger3d new --schema"),
        (["validate"], "validate is gone: use python -m validation"),
        (["design", "scene.toml", "--out", "out"], "design is gone: use finger3d optimise"),
    ],
)
def test_wrong_arguments_end_with_2_and_one_line(arguments, expected, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert expected in refused(capsys, *arguments)
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


# --- shared parts of the commands: JSON alone on standard output, folders that are checked, tables of text -----------


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


# --- A command does its work whatever becomes of the terminal, and however narrow that is ----------------------------


SECTION = [
    "--set", "model.domain=plane-strain", "--set", "mesh.size_mm=8", "--set", "mesh.base_size_mm=16", "--set",
    "press.steps=3", "--set", "press.depth_mm=1", "--no-figures", "--no-error",
]  # fmt: skip


@pytest.mark.parametrize("redirection", ["| head -1", "2>/dev/full >&- <&-", "> ascii"])
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
        "import os; from finger3d._interruption import fill_descriptors\n"
        "fill_descriptors(); file = open('data', 'w'); os.write(1, b'printed'); file.write(str(file.fileno()))"
    )
    env = {**os.environ, "PYTHONPATH": str(root)}
    line = f"'{sys.executable}' -c \"$1\" >&-"
    subprocess.run(["bash", "-c", line, "bash", code], cwd=tmp_path, env=env, check=True, stdin=subprocess.DEVNULL)
    assert int((tmp_path / "data").read_text()) > 2


def test_help_ends_on_a_terminal_of_any_width(root: Path) -> None:
    env = {**os.environ, "PYTHONPATH": str(root), "COLUMNS": "1"}
    command = [sys.executable, "-m", "finger3d", "press", "--help"]
    done = subprocess.run(command, env=env, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 20
    assert "--out" in done.stdout


# --- A refused command says one line that helps, and leaves nothing behind; --json prints JSON alone -----------------


@pytest.fixture
def block(tmp_path: Path) -> Path:
    return written(tmp_path, BLOCK)


@pytest.mark.parametrize(
    "arguments",
    [
        ["press", "--set", "friction.mu=-1"],
        ["compare", "--widths", "3,-1"],
        ["calibrate", "--gauge", "no such"],
        ["sweep", "--vary", "friction.mu=-1,2"],
        ["export", "--mold", "--pour-mm", "-3"],
    ],
    ids=" ".join,
)
def test_a_refused_command_leaves_no_folder(
    arguments: list[str], block: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *options = arguments
    assert main([command, str(block), *options, "--out", str(tmp_path / "deep" / "out")]) == 2
    assert len([line for line in capsys.readouterr().err.splitlines() if line.startswith("finger3d: ")]) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["scene.toml"]


def test_a_finger_from_a_file_that_is_not_there_is_told_before_the_keys_of_the_old_design(
    block: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    err = refused(capsys, "plan", block, "--set", "finger.geometry=nosuch.step")
    assert f"--set finger.geometry: finger.geometry: {tmp_path / 'nosuch.step'}: " in err
    assert "half_length_mm" not in err


def test_beside_a_file_that_is_there_the_keys_of_a_design_are_told(
    block: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "finger.stl").touch()
    assert main(["plan", str(block), "--set", "finger.geometry=finger.stl"]) == 2
    err = capsys.readouterr().err
    for text in ("finger.half_length_mm = 10.0: no such key beside this file, take it out",
                 "[finger] takes geometry, scale, up)", "and 2 more mistakes"):  # fmt: skip
        assert text in err


# --- commands that help to write: a new scene, its schema, and completion --------------------------------------------


def test_new_writes_a_scene_that_loads_and_is_the_papers_finger(scene) -> None:
    loaded = load(scene)
    assert loaded.design.width_mm == 20.0
    assert loaded.model().mesh == MeshOptions(1.818, 8.0, "ftetwild", gauge_refinement=2.0, stick_refinement=3.5)
    assert [leg.depth_mm for leg in loaded.legs] == [10.0]


def test_new_explains_every_key(scene, root) -> None:
    text, page = scene.read_text(encoding="utf-8"), (root / "docs" / "scenes.md").read_text(encoding="utf-8")
    names = re.findall(r"^\| (`.*?`) \|", page.split("<!-- from the tables")[1], re.MULTILINE)
    keys = {key for cell in names for key in re.findall(r"`(\w+)`", cell)}
    assert {"depth_mm", "prony", "tolerance"} <= keys
    assert not [key for key in keys if not re.search(rf"\b{key}\b", text)]
    assert not [name for name in effect_names() if f"\n# [effects.{name}]\n" not in text]


@pytest.mark.parametrize("name", effect_names())
def test_an_effect_of_the_new_scene_is_switched_on_by_uncommenting_it(scene, name) -> None:
    before, block = scene.read_text(encoding="utf-8").split(f"# [effects.{name}]\n")
    keys = re.match(r"(?:# \w+ = .*\n)*", block)[0].replace("# ", "", 1).replace("\n# ", "\n")
    text = before.replace("length_mm = 0.0", "length_mm = 2.0").replace("[press]", "[press]\nduration_s = 1.0", 1)
    scene.write_text(f"{text}\n[effects.{name}]\n{keys}\n", encoding="utf-8")
    assert set(load(scene).effects) == {name}


def test_new_leaves_a_file_alone_that_is_there(scene, capsys) -> None:
    scene.write_text("mine", encoding="utf-8")
    assert run("new", scene) == 2
    assert f"{scene}: " in capsys.readouterr().err
    assert scene.read_text(encoding="utf-8") == "mine"


def test_a_core_install_gets_a_scene_that_it_can_press(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    from finger3d import _extras

    monkeypatch.setattr(_extras, "available", lambda *modules: False)
    assert run("new", tmp_path / "core.toml") == 0
    assert load(tmp_path / "core.toml").mesh.mesher == "swept"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(shell, capsys) -> None:
    assert run("--completion", shell) == 0
    script = capsys.readouterr().out
    for command in COMMANDS:
        assert command in script


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["pre"], "press"),
        (["press", "scene.toml", "--no"], "--no-figures"),
        (["export", "scene.toml", "--solver", "c"], "calculix"),
    ],
)
def test_bash_completes_commands_options_and_choices(typed, offered, tmp_path, capsys) -> None:
    """bash reads the script, and is asked what it offers after what was typed."""
    run("--completion", "bash")
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


def test_schema_prints_the_json_schema_of_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "--schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()


# --- command ``info``: versions, machine and folders -----------------------------------------------------------------


def test_info_names_versions_and_machine(capsys) -> None:
    assert run("info") == 0
    out = capsys.readouterr().out
    for text in ("finger3d", "numpy", "build123d", "pytetwild", "vtk", "python", "cores", "memory", "cache", "PARDISO"):
        assert text in out
    assert finger3d.__version__ in out
