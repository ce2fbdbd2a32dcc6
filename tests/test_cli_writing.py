"""Commands that help to write: a new scene, its schema, and completion."""

from __future__ import annotations

import json
import re
import subprocess

import pytest

from finger3d.cli import app, main
from finger3d.effects import effect_names
from finger3d.mechanics.model import MeshOptions
from finger3d.scene import load
from finger3d.scene.reference import reference
from finger3d.scene.schema import schema
from tests.commands import run


def test_new_says_what_to_do_next(tmp_path, capsys) -> None:
    path = tmp_path / "mine.toml"
    assert run("new", path) == 0
    assert f"finger3d press {path} --out out" in capsys.readouterr().out


def test_new_writes_a_scene_that_loads_and_is_the_papers_finger(scene) -> None:
    loaded = load(scene)
    assert loaded.design.width_mm == 20.0
    assert loaded.model().mesh == MeshOptions(1.818, 8.0, "ftetwild", gauge_refinement=2.0, stick_refinement=3.5)
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
    assert f"{scene}: " in capsys.readouterr().err
    assert scene.read_text(encoding="utf-8") == "mine"


def test_new_without_a_name_writes_scene_toml(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("new") == 0
    assert load("scene.toml").title == "Fig. 9 finger, 20 mm wide"


def test_new_in_a_folder_that_is_not_there(tmp_path, capsys) -> None:
    assert run("new", tmp_path / "no" / "scene.toml") == 2
    assert str(tmp_path / "no") in capsys.readouterr().err


def test_a_core_install_gets_a_scene_that_it_can_press(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    from finger3d import _extras

    monkeypatch.setattr(_extras, "available", lambda *modules: False)
    assert run("new", tmp_path / "core.toml") == 0
    assert load(tmp_path / "core.toml").mesh.mesher == "swept"


COMMANDS = [name for name in app if not name.startswith("-") and app[name].show]


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


def test_schema_prints_the_json_schema_of_a_scene(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == schema()
