"""The command line: exit codes, one-line errors, and what each command prints. Presses are faked here."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import finger3d
import finger3d.analyses.press
from finger3d.cli import app, main
from finger3d.errors import MissingError, Outcome
from finger3d.mechanics.model import MeshOptions
from finger3d.scene import load
from finger3d.scene.reference import reference
from finger3d.scene.registry import effect_names

HEAVY = ("OCP", "build123d", "vtk", "vtkmodules", "pyvista", "pytetwild", "trimesh", "scipy", "numpy", "pydantic")
STEP = {
    "depth_mm": 10.0,
    "normal_force_N": 304.5,
    "friction_sum_N": 72.0,
    "contact_half_length_mm": 36.0,
    "stick_half_length_mm": 8.5,
    "contact_area_mm2": 1460.0,
    "stick_area_mm2": 130.0,
    "residual": 3e-11,
    "gauges": {"g36": -0.0123},
    "markers": {"m1": [0.5, -2.0, 0.0]},
    "taxels": {"t1": 0.125},
    "outcome": "converged",
}


def run(*arguments: object) -> int:
    return main([str(a) for a in arguments])


@pytest.fixture
def scene(tmp_path) -> Path:
    path = tmp_path / "scene.toml"
    assert run("new", path) == 0
    return path


@pytest.fixture
def fake_press(monkeypatch):
    """Replace the driver: writes two steps, then ends as told."""
    calls = SimpleNamespace(end=Outcome.CONVERGED, scene=None, figures=None)

    def press(scene, out, report, figures=True, error=True):
        calls.scene, calls.figures = scene, figures
        steps = [{**STEP, "depth_mm": 5.0}, STEP]
        if isinstance(calls.end, Outcome) and not calls.end.ok:
            steps[1] = {**STEP, "outcome": str(calls.end)}
        summary = {"outcome": str(calls.end), "steps": steps, "cost": {"seconds": {"total": 1.5}}}
        report.stage("meshing")
        report.say("mesh taken from the cache")
        out.mkdir(exist_ok=True)
        (out / "summary.json").write_text(json.dumps(summary))
        for i in range(2):
            report.step(i + 1, 2, f"remark {i}")
        if isinstance(calls.end, BaseException):
            raise calls.end
        return SimpleNamespace(summary=lambda: summary, outcome=calls.end, out=out)

    monkeypatch.setattr(finger3d.analyses.press, "press", press)
    return calls


def test_new_says_what_to_do_next(tmp_path, capsys) -> None:
    path = tmp_path / "mine.toml"
    assert run("new", path) == 0
    assert f"finger3d press {path} --out out" in capsys.readouterr().out


def test_new_writes_a_scene_that_loads_and_is_the_papers_finger(scene) -> None:
    loaded = load(scene)
    assert loaded.design.width_mm == 20.0
    assert loaded.model().mesh == MeshOptions(2.0, 8.0, "ftetwild")
    assert [leg.depth_mm for leg in loaded.legs] == [10.0]


def test_new_explains_every_key(scene) -> None:
    text = scene.read_text(encoding="utf-8")
    keys = set(re.findall(r"^\| `(\w+)` \|", reference(), re.MULTILINE))
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
    assert f"{scene}: there already" in capsys.readouterr().err
    assert scene.read_text(encoding="utf-8") == "mine"


def test_new_without_a_name_writes_scene_toml(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("new") == 0
    assert load("scene.toml").title == "Fig. 9 finger, 20 mm wide"


def test_new_in_a_folder_that_is_not_there(tmp_path, capsys) -> None:
    assert run("new", tmp_path / "no" / "scene.toml") == 2
    assert "cannot be written" in capsys.readouterr().err


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
    for text in ("meshing", "mesh taken from the cache", "step 2 of 2: remark 1"):
        assert text in out


def test_press_without_figures(scene, tmp_path, fake_press) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--no-figures") == 0
    assert fake_press.figures is False


def test_press_that_does_not_converge_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = Outcome.NO_CONVERGENCE
    assert run("press", scene, "--out", tmp_path / "out") == 3
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert str(Outcome.NO_CONVERGENCE) in err
    assert "1 of 2 steps are kept" in err


def test_press_that_misses_something_ends_with_3(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = MissingError("no mesher; install pytetwild")
    assert run("press", scene, "--out", tmp_path / "out") == 3
    assert capsys.readouterr().err == "finger3d: no mesher; install pytetwild\n"


def test_an_interrupted_press_ends_with_130_and_says_what_is_kept(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = KeyboardInterrupt()
    assert run("press", scene, "--out", tmp_path / "out") == 130
    assert capsys.readouterr().err == f"finger3d: interrupted; 2 of 2 steps are kept in {tmp_path / 'out'}\n"


def test_an_interruption_before_the_first_step(scene, tmp_path, monkeypatch, capsys) -> None:
    def press(scene, out, report, figures=True, error=True):
        raise KeyboardInterrupt

    monkeypatch.setattr(finger3d.analyses.press, "press", press)
    assert run("press", scene, "--out", tmp_path / "out") == 130
    assert capsys.readouterr().err == "finger3d: interrupted; no step was finished, none is kept\n"


@pytest.mark.parametrize(
    ("out", "expected"),
    [("scene.toml", "is a file"), ("scene.toml/deeper", "cannot be written"), (".", "holds scene.toml")],
)
def test_press_refuses_a_folder_it_cannot_use_before_any_work(
    out, expected, scene, tmp_path, fake_press, capsys
) -> None:
    before = scene.read_bytes()
    assert run("press", scene, "--out", tmp_path / out) == 2
    printed, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert "--out" in err
    assert expected in err
    assert printed == ""
    assert fake_press.scene is None
    assert scene.read_bytes() == before


def test_plan_tells_effects_and_forecast_and_solves_nothing(scene, fake_press, capsys) -> None:
    assert run("plan", scene, "--set", "title=planned [b]") == 0
    out, err = capsys.readouterr()
    assert err == ""
    for text in ("planned [b]", "dofs", "symmetry", "x and z", "memory MB", "no [effects.kinetic_friction]"):
        assert text in out
    assert fake_press.scene is None


def test_info_names_versions_and_machine(capsys) -> None:
    assert run("info") == 0
    out = capsys.readouterr().out
    for text in ("finger3d", "numpy", "build123d", "pytetwild", "vtk", "python", "cores", "memory", "cache", "PARDISO"):
        assert text in out
    assert finger3d.__version__ in out


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["prss"], 'Did you mean "press"?'),
        (["press"], "SCENE requires an argument"),
        (["press", "scene.toml"], "--out"),
        (["press", "scene.toml", "--out"], "--out requires an argument"),
        (["press", "scene.toml", "--out", "out", "--fast"], "--fast"),
        (["press", "scene.toml", "more.toml", "--out", "out"], "more.toml"),
        (["plan", "scene.toml", "--set"], "--set requires an argument"),
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


def test_python_m_runs_the_command_line(tmp_path) -> None:
    command = [sys.executable, "-m", "finger3d", "plan", "nothing.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "finger3d: nothing.toml: there is no such file\n"
    assert done.stdout == ""


@pytest.mark.parametrize("code", ["import finger3d", "from finger3d.cli import main; main(['--help'])"])
def test_import_and_help_load_nothing_heavy(code) -> None:
    check = f"import sys; print(*sorted(set({HEAVY!r}) & set(sys.modules)), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", f"{code}\n{check}"], capture_output=True, text=True, check=True)
    assert done.stderr == "\n"


def test_the_table_prints_where_only_ascii_can_be_written() -> None:
    command = [sys.executable, "-m", "finger3d", "info"]
    environment = {"PYTHONIOENCODING": "ascii", "PATH": ""}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "PARDISO" in done.stdout


def test_every_public_name_is_there() -> None:
    for name in finger3d.__all__:
        assert getattr(finger3d, name) is not None
    assert set(finger3d.__all__) <= set(dir(finger3d))


def test_an_unknown_public_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'pres'"):
        _ = finger3d.pres


# --- for scripts ------------------------------------------------------------------------------------------------------


def test_press_as_json_prints_the_summary_alone(scene, tmp_path, fake_press, capsys) -> None:
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "step 2 of 2: remark 1" in err


def test_press_as_json_that_does_not_converge(scene, tmp_path, fake_press, capsys) -> None:
    fake_press.end = Outcome.NO_CONVERGENCE
    assert run("press", scene, "--out", tmp_path / "out", "--json") == 3
    out, err = capsys.readouterr()
    assert json.loads(out)["outcome"] == str(Outcome.NO_CONVERGENCE)
    assert "1 of 2 steps are kept" in err


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


def test_plan_info_and_validate_as_json(scene, tmp_path, capsys) -> None:
    override = "effects.kinetic_friction={ratio = 0.7}"
    assert run("plan", scene, "--json", "--set", override, "--set", "friction.mu=0.3") == 0
    planned = json.loads(capsys.readouterr().out)
    assert planned["effects"] == {"kinetic_friction": {"ratio": 0.7, "branch": "keep"}}
    assert planned["forecast"]["dofs"] > 1000
    assert run("info", "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["versions"]["finger3d"] == finger3d.__version__
    assert told["machine"]["cores"] >= 1
    assert run("validate", "patch_test", "--quick", "--json", "--out", tmp_path / "studies") == 0
    out, err = capsys.readouterr()
    rows = json.loads(out)["studies"]["patch_test"]
    assert rows
    assert all(row["passed"] and row["error"] >= 0.0 for row in rows)
    assert "patch_test" in err


def test_compare_as_json_prints_its_file(scene, tmp_path, monkeypatch, capsys) -> None:
    import finger3d.analyses.compare.run

    def compare(scene, out, widths, report):
        report.stage("plane strain")
        out.mkdir()
        (out / "compare.json").write_text(json.dumps({"verdict": ["2D would do"], "outcome": "converged"}))
        return SimpleNamespace(verdict=("2D would do",), outcome=Outcome.CONVERGED, cases=())

    monkeypatch.setattr(finger3d.analyses.compare.run, "compare", compare)
    assert run("compare", scene, "--out", tmp_path / "out", "--json") == 0
    out, err = capsys.readouterr()
    assert json.loads(out) == {"verdict": ["2D would do"], "outcome": "converged"}
    assert "plane strain" in err


@pytest.mark.parametrize("command", ["press", "compare", "plan"])
def test_a_mistake_with_json_leaves_standard_output_empty(command, tmp_path, capsys) -> None:
    out = [] if command == "plan" else ["--out", tmp_path / "out"]
    assert run(command, tmp_path / "nothing.toml", *out, "--json") == 2
    printed, err = capsys.readouterr()
    assert printed == ""
    assert len(err.splitlines()) == 1


# --- help, completion, colours ----------------------------------------------------------------------------------------

COMMANDS = [name for name in app if not name.startswith("-")]


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


COLOUR = re.compile(r"\x1b\[(?:[\d;]*;)?(?:3[0-8]|4[0-8]|9\d|10[0-7])(?:;[\d;]*)?m")


def test_colours_only_on_a_terminal_that_wants_them() -> None:
    """A pipe gets text alone; a terminal gets colours, none with NO_COLOR; a dumb one nothing it cannot show."""
    command = ["press", "--help"]
    done = subprocess.run([sys.executable, "-m", "finger3d", *command], capture_output=True, text=True, check=True)
    assert "\x1b" not in done.stdout + done.stderr
    assert COLOUR.search(on_a_terminal(command))
    assert not COLOUR.search(on_a_terminal(command, NO_COLOR="1"))
    assert "\x1b" not in on_a_terminal(["info"], TERM="dumb")
