"""The wheel, built of the sdist, installed into an empty environment outside the repository, and used there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1200)]

MOST_CORE_BYTES = 0.5e9


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command with nothing of the checkout on its path, and return its standard output."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")} | {"FINGER3D_CACHE": str(cwd / "cache")}
    done = subprocess.run([str(word) for word in command], cwd=cwd, env=env, capture_output=True, text=True)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def built(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the sdist, and with the wheel that pip builds of it."""
    folder = tmp_path_factory.mktemp("built")
    run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", folder, cwd=root)
    (sdist,) = folder.glob("*.tar.gz")
    options = ("-q", "--no-deps", "--no-build-isolation", "-w", folder)
    run(sys.executable, "-m", "pip", "wheel", *options, sdist, cwd=folder)
    assert sdist.stat().st_size < 100e6
    return folder


def environment(root: Path, folder: Path, *requirements: str | Path) -> Path:
    """Return the folder of programs of a new virtual environment with some requirements, at the pinned versions."""
    run(sys.executable, "-m", "venv", folder, cwd=folder.parent)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    install = (programs / "python", "-m", "pip", "install", "-q", "-c", root / "constraints.txt")
    run(*install, "hatchling", cwd=folder)
    run(*install, "--no-build-isolation", *requirements, cwd=folder)
    return programs


def size_of(folder: Path) -> int:
    """Return the size of a folder's files in bytes."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if path.is_file())


def test_the_core_is_small_and_presses_calibrates_and_exports_from_an_empty_folder(
    built: Path, root: Path, tmp_path: Path
) -> None:
    (file,) = built.glob("*.whl")
    programs, work = environment(root, tmp_path / "venv", file), tmp_path / "work"
    work.mkdir()
    where = run(programs / "python", "-c", "import finger3d; print(finger3d.__file__, *finger3d.designs())", cwd=work)
    assert str(tmp_path / "venv") in where
    assert "clipped_cylinder" in where
    finger3d = programs / "finger3d"
    run(finger3d, "new", "scene.toml", cwd=work)
    coarse = ("--set", "mesh.mesher=swept", "--set", "mesh.size_mm=6", "--set", "mesh.base_size_mm=12")
    run(finger3d, "press", "scene.toml", *coarse, "--out", "press", cwd=work)
    assert "plotly.js" in (work / "press" / "report.html").read_text(encoding="utf-8")
    assert (work / "press" / "finger.png").stat().st_size > 10_000
    flat = ("--set", "model.domain=plane-strain", "--set", "mesh.size_mm=4", "--set", "effects.auto=false")
    run(finger3d, "calibrate", "scene.toml", *flat, "--gauge", "g36", "--out", "calibration", cwd=work)
    assert json.loads((work / "calibration" / "calibration.json").read_text())
    run(finger3d, "sweep", "scene.toml", *flat, "--vary", "material.nu=0.3,0.45", "--out", "sweep", cwd=work)
    assert (work / "sweep" / "results.csv").exists()
    run(finger3d, "export", "scene.toml", *coarse, "--solver", "calculix", "--out", "export", cwd=work)
    assert list((work / "export").glob("*.inp"))
    assert size_of(programs.parent) < MOST_CORE_BYTES
    found = json.loads(run(finger3d, "info", "--json", cwd=work))
    assert "vtk" not in found["versions"]


def test_the_full_wheel_presses_and_exports_a_mold(built: Path, root: Path, tmp_path: Path) -> None:
    (file,) = built.glob("*.whl")
    programs = environment(root, tmp_path / "venv", f"{file}[full]")
    work = tmp_path / "work"
    work.mkdir()
    finger3d = programs / "finger3d"
    run(finger3d, "new", "scene.toml", cwd=work)
    run(finger3d, "press", "scene.toml", "--set", "mesh.size_mm=6", "--out", "press", cwd=work)
    assert json.loads((work / "press" / "summary.json").read_text())["cost"]["solver"] in (
        "pardiso",
        "mumps",
        "superlu",
    )
    run(finger3d, "export", "scene.toml", "--mold", "--out", "mold", cwd=work)
    assert (work / "mold" / "finger.step").exists()
    assert size_of(programs.parent) < 2.8e9
