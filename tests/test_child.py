"""Child processes: crashes, time limits, and their end with their parent, here of fTetWild."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.refinement.sizing import sizing
from finger3d.meshing.structured.snap import UnusableMeshError
from finger3d.meshing.unstructured import tetwild
from tests.bodies import CUBE, SIDES

KILLED = """
import numpy as np
from finger3d.mechanics.model import MeshOptions
from finger3d.geometry.registry import designs
from finger3d.meshing.unstructured import tetwild
from finger3d.meshing.refinement.sizing import sizing
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
