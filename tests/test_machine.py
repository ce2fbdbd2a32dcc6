"""The machine, child processes, and optional packages."""

from __future__ import annotations

import json
import os
import platform
import re
import subprocess
import sys
import time
import tomllib
from importlib import metadata
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d import _extras
from finger3d._machine import (
    PACKAGES,
    child_environment,
    cores,
    versions,
)
from finger3d.errors import MissingError
from finger3d.geometry.design import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.sizing import sizing
from finger3d.meshing.unstructured import tetwild
from finger3d.meshing.unstructured.snap import UnusableMeshError
from tests.bodies import CUBE, SIDES


def test_versions_are_those_installed_and_absent_packages_are_left_out() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == metadata.version("numpy")
    assert set(found) <= {"python", *PACKAGES}


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no processor affinity")
def test_only_cores_that_may_be_used_count() -> None:
    allowed = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)


def test_a_child_imports_the_same_package(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-c", "import finger3d; print(finger3d.__file__)"]
    done = subprocess.run(command, env=child_environment(), cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()) == Path(finger3d.__file__)


@pytest.mark.skipif(sys.platform != "linux", reason="only the Linux kernel ends a child with its parent")
def test_a_child_ends_with_a_parent_that_is_killed() -> None:
    child = "import os, time; from finger3d._machine import end_with; end_with(os.getppid()); print(1); time.sleep(60)"
    parent = (
        "import subprocess, sys; child = subprocess.Popen([sys.executable, '-c', sys.argv[1]], stdout=subprocess.PIPE);"
        "child.stdout.readline(); print(child.pid, flush=True); child.wait()"
    )
    with subprocess.Popen([sys.executable, "-c", parent, child], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        pid = int(process.stdout.readline())
        process.kill()
    deadline = time.monotonic() + 20.0
    while _runs(pid):
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


KILLED = """
import numpy as np
from finger3d.mechanics.model import MeshOptions
from finger3d.geometry.design import designs
from finger3d.meshing.unstructured import tetwild
from finger3d.meshing.sizing import sizing
from tests.bodies import CUBE, SIDES
low, high = np.array([-5.0, 0, -5]), np.array([5.0, 10, 5])
options = MeshOptions(size_mm=0.3, base_size_mm=0.3)
field = sizing(designs()["block"](5.0, 10.0, 10.0), options, (-5, 5, -5, 5), low, high)
print("meshing", flush=True)
tetwild.run_child(CUBE, SIDES, field, 1e-3, 60.0)
"""


def fine() -> Any:
    block = designs()["block"](5.0, 10.0, 10.0)
    options = MeshOptions(size_mm=4.0, base_size_mm=5.0)
    return sizing(block, options, (-5, 5, -5, 5), np.array([-5.0, 0, -5]), np.array([5.0, 10, 5]))


def test_a_crash_of_the_child_is_told_by_its_signal() -> None:
    # A body without volume was seen to end pytetwild with a segmentation fault.
    with pytest.raises(UnusableMeshError, match=r"pytetwild crashed \(SIGSEGV, Segmentation fault\)"):
        tetwild.run_child(CUBE * [1.0, 0.0, 1.0] + [0.0, 5.0, 0.0], SIDES, fine(), 1e-3, 60.0)


def test_a_child_that_takes_too_long_is_ended() -> None:
    with pytest.raises(UnusableMeshError, match="0 s"):
        tetwild.run_child(CUBE, SIDES, fine(), 1e-3, 0.05)


@pytest.mark.skipif(sys.platform != "linux", reason="relies on prctl and /proc")
def test_the_child_ends_with_its_parent_and_leaves_no_folder(root: Path, tmp_path: Path) -> None:
    env = {**os.environ, "TMPDIR": str(tmp_path), "PYTHONPATH": str(root)}
    running = subprocess.Popen([sys.executable, "-c", KILLED], cwd=root, env=env, stdout=subprocess.PIPE)
    assert running.stdout is not None
    assert running.stdout.readline() == b"meshing\n"
    children = Path(f"/proc/{running.pid}/task/{running.pid}/children")
    end = time.monotonic() + 60.0
    # it is at work once its working folder is a removed one in the temporary folder
    while not (found := children.read_text().split()) or "(deleted)" not in os.readlink(f"/proc/{found[0]}/cwd"):
        assert time.monotonic() < end
        time.sleep(0.02)
    assert str(tmp_path) in os.readlink(f"/proc/{found[0]}/cwd")
    running.kill()
    running.wait()
    end = time.monotonic() + 20.0
    while Path(f"/proc/{found[0]}").exists():
        assert time.monotonic() < end, "the child goes on without its parent"
        time.sleep(0.02)
    assert not list(tmp_path.iterdir())


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


@pytest.mark.slow
def test_a_solid_is_pressed_and_drawn_without_any_extra(paper_scene, tmp_path) -> None:
    words = ["press", str(paper_scene), "--out", "o", "--set", "mesh.mesher=swept", "--set", "mesh.size_mm=8"]
    words += ["--set", "mesh.base_size_mm=16", "--set", "press.steps=2"]
    (said,) = run_without(set(_extras.EXTRAS), words, cwd=tmp_path)
    assert said.endswith("exit code 0"), said
    names = {path.name for path in (tmp_path / "o").iterdir()}
    assert {"report.html", "finger.png", "fields.vtu", "summary.json"} <= names
    assert '"solver": "superlu"' in (tmp_path / "o" / "summary.json").read_text()
