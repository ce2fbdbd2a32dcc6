"""Pictures drawn beside the computation: in a child, here if it fails, and to the end when interrupted."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from finger3d.plotting.worker import PlotWorker


@pytest.fixture(autouse=True)
def _matplotlib_not_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "matplotlib", raising=False)


note_process = partial(shutil.copyfile, "/proc/self/stat")
"""A function that a child can import too, and that writes who called it."""


def process(path: Path) -> int:
    return int(path.read_text().split()[0])


def known_only_here(path: Path) -> None:
    """No child finds this module: the child ends at once."""
    path.write_text("drawn")


def test_a_child_draws_while_this_process_goes_on(tmp_path: Path) -> None:
    with PlotWorker() as artist:
        artist.draw(note_process, tmp_path / "a")
        artist.draw(note_process, tmp_path / "b")
        artist.begin()
        artist.finish()
    assert process(tmp_path / "a") == process(tmp_path / "b") != os.getpid()


def test_what_a_failed_child_did_not_draw_is_drawn_here(tmp_path: Path) -> None:
    with PlotWorker() as artist:
        artist.draw(known_only_here, tmp_path / "a")
        artist.begin()
        artist.finish()
    assert (tmp_path / "a").read_text() == "drawn"


def test_an_error_of_a_picture_is_raised_here(tmp_path: Path) -> None:
    with PlotWorker() as artist:
        artist.draw(note_process, tmp_path / "no folder" / "a")
        artist.begin()
        with pytest.raises(FileNotFoundError):
            artist.finish()


def test_to_begin_does_not_wait_for_a_child_that_is_loading(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = tmp_path / "begun"
    (tmp_path / "loads_until_begun.py").write_text(
        "import time\nfrom pathlib import Path\nend = time.monotonic() + 20.0\n"
        f"while not Path({str(begun)!r}).exists():\n    assert time.monotonic() < end\n    time.sleep(0.01)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    with PlotWorker(module="loads_until_begun") as artist:
        artist.draw(len, bytes(2**20))  # more than a pipe holds
        artist.draw(note_process, tmp_path / "a")
        artist.begin()
        begun.touch()
        artist.finish()
    assert process(tmp_path / "a") != os.getpid()


def test_pictures_that_were_begun_are_finished_when_interrupted(tmp_path: Path) -> None:
    def interrupted() -> None:
        with PlotWorker() as artist:
            artist.draw(note_process, tmp_path / "a")
            artist.begin()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert (tmp_path / "a").exists()


@pytest.mark.parametrize("wanted", [True, False])
def test_nothing_to_draw_leaves_nothing_running(wanted: bool) -> None:
    with PlotWorker(wanted) as artist:
        child = artist._child
    assert (child is not None) == wanted
    if child:
        assert child.wait(20) is not None


def test_where_matplotlib_is_loaded_no_child_is_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", os)
    with PlotWorker() as artist:
        artist.draw(note_process, tmp_path / "a")
        artist.begin()
        artist.finish()
    assert process(tmp_path / "a") == os.getpid()


def test_a_press_does_not_load_matplotlib_itself(tmp_path: Path) -> None:
    code = (
        "import sys; from finger3d.cli import main; main(['press', sys.argv[1], '--out', sys.argv[2]]); "
        "print({'matplotlib', 'OCP', 'vtk', 'urllib.request'} & set(sys.modules), file=sys.stderr)"
    )
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[finger]\ngeometry = "half_cylinder"\nradius_mm = 50\nwidth_mm = 20\n[material]\nE_MPa = 1.0\nnu = 0.45\n'
        '[friction]\nmu = 0.25\n[press]\ndepth_mm = 1.0\nsteps = 2\n[model]\ndomain = "plane-strain"\n'
        "[mesh]\nsize_mm = 3.0\n"
    )
    command = [sys.executable, "-c", code, str(scene), str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert done.stderr == "set()\n"
    assert {"finger.png", "contact.png", "force.png", "report.html"} <= {p.name for p in (tmp_path / "out").iterdir()}
