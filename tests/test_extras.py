"""Optional packages: every one has an extra that brings it, and whoever lacks it reads one line."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path
from types import SimpleNamespace

import pytest

from finger3d import _extras
from finger3d.errors import MissingError

WITHOUT = """
import sys
from importlib.abc import MetaPathFinder
names = {names!r}
class Refuse(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in names:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Refuse())
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: None if name.split(".")[0] in names else found(name, package)
import json
from finger3d.cli import main
for words in json.loads(sys.argv[1]):
    sys.stderr.write(f"exit code {{main(words)}}\\n")
"""
"""Runs commands, one after another, as if some packages were not installed."""


def run_without(names: set[str], *commands: list[str], cwd: Path) -> list[str]:
    """Return what each command writes on standard error, with its exit code in the last line."""
    code = WITHOUT.format(names=names)
    done = subprocess.run(
        [sys.executable, "-c", code, json.dumps(commands)], capture_output=True, text=True, cwd=cwd, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return re.findall(r"(.*?exit code \d+)\n", done.stderr, flags=re.DOTALL)


def test_every_optional_module_comes_with_its_extra(root: Path) -> None:
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(_extras.EXTRAS.values()) <= set(extras)
    owners = packages_distributions()
    direct = {"pypardiso", "casadi", "cffi", "build123d", "pytetwild", "pyvista"}
    direct |= {"distributed", "pandas", "pyarrow", "netgen", "dash"}
    for module in direct & set(owners):
        named = {re.match(r"[\w-]+", requirement)[0] for requirement in extras[_extras.EXTRAS[module]]}
        assert named & {name.replace("_", "-") for name in owners[module]}, module


def test_a_requirement_names_command_extra_and_a_way_around(monkeypatch: pytest.MonkeyPatch) -> None:
    _extras.require("here", "pyvista")
    monkeypatch.setattr(_extras, "find_spec", lambda module: None)
    with pytest.raises(MissingError, match=r'^show needs pyvista: .* -m pip install .*\[view\]", or add --png FILE$'):
        _extras.require("show", "pyvista", instead="add --png FILE")


def test_an_import_that_fails_inside_an_installed_package_is_no_missing_extra() -> None:
    assert _extras.absent(ModuleNotFoundError("No module named 'pyvista.odd'", name="pyvista.odd")) is None
    assert _extras.absent(ModuleNotFoundError("No module named 'other'", name="other")) is None
    assert _extras.absent(ImportError("cannot load", name="pyvista")) is None


@pytest.mark.parametrize(
    ("record", "said"),
    [
        ('{"url": "file:///home/a%20b/finger3d", "dir_info": {}}', '"/home/a b/finger3d[cad]"'),
        ('{"url": "file:///tmp/finger3d-0.1.0-py3-none-any.whl"}', '"/tmp/finger3d-0.1.0-py3-none-any.whl[cad]"'),
        (None, '"finger3d[cad]"'),
    ],
)
def test_the_hint_of_an_installed_package_names_what_it_came_from(record, said, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(_extras, "__file__", str(tmp_path / "site-packages" / "finger3d" / "_extras.py"))
    monkeypatch.setattr(_extras, "distribution", lambda name: SimpleNamespace(read_text=lambda file: record))
    assert _extras.install("cad") == f"{sys.executable} -m pip install {said}"


def test_the_full_extra_brings_what_the_readme_shows(root: Path) -> None:
    extras = tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    text = (root / "README.md").read_text(encoding="utf-8")
    shown = {
        "pandas": "to_dataframe()",
        "pyvista": "to_pyvista()",
        "dash": "`app`",
        "build123d": "`export`",
    }
    assert all(words in text for words in shown.values())
    own = re.findall(r"\w+", extras["full"][0].partition("[")[2])
    brought = {re.match(r"[\w-]+", line)[0] for name in own for line in extras[name]}
    brought |= {re.match(r"[\w-]+", line)[0] for line in extras["full"][1:]}
    assert set(shown) <= brought


def test_a_command_that_lacks_its_extra_ends_with_one_line(root, paper_scene, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path / "cache"))  # a mesh from the cache needs no mesher
    scene = str(paper_scene)
    cases = [
        (["press", scene, "--out", "o", "--set", "mesh.mesher=ftetwild"], "cad"),
        (["press", scene, "--out", "o", "--set", "mesh.mesher=netgen"], "cad"),
        (["export", scene, "--out", "o"], "cad"),
        (["sweep", scene, "--vary", "friction.mu=1", "--out", "o", "--scheduler", "tcp://127.0.0.1:1"], "cluster"),
        (["app", scene], "app"),
    ]
    said = run_without(set(_extras.EXTRAS), *(words for words, _ in cases), cwd=tmp_path)
    assert len(said) == len(cases)
    for (words, extra), text in zip(cases, said, strict=True):
        *_, line, code = text.splitlines()
        assert code == "exit code 3", (words, text)
        assert line.startswith("finger3d: ")
        assert f'{sys.executable} -m pip install --editable "{root}[{extra}]"' in line
        assert "Traceback" not in text


def test_a_solid_is_pressed_and_drawn_without_any_extra(paper_scene, tmp_path) -> None:
    words = ["press", str(paper_scene), "--out", "o", "--set", "mesh.mesher=swept", "--set", "mesh.size_mm=8"]
    words += ["--set", "mesh.base_size_mm=16", "--set", "press.steps=2"]
    (said,) = run_without(set(_extras.EXTRAS), words, cwd=tmp_path)
    assert said.endswith("exit code 0"), said
    names = {path.name for path in (tmp_path / "o").iterdir()}
    assert {"report.html", "finger.png", "fields.vtu", "summary.json"} <= names
    assert '"solver": "superlu"' in (tmp_path / "o" / "summary.json").read_text()
