"""Memory that runs out: one line and exit 3, by whatever part of the program finds it out."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from finger3d.errors import OUT_OF_MEMORY
from tests.scenes import FIG9

SCENE = (
    FIG9
    + """
[material]
E_MPa = 1.0
nu = 0.49
[press]
depth_mm = 10.0
steps = 1
[mesh]
size_mm = 1.5
base_size_mm = 6.0
mesher = "swept"
"""
)

LIMITED = """
import resource, sys
import finger3d.cli, finger3d.analyses.press, finger3d.scene
resource.setrlimit(resource.RLIMIT_AS, ({limit}, resource.getrlimit(resource.RLIMIT_AS)[1]))
sys.exit(finger3d.cli.main(sys.argv[1:]))
"""


# bytes of address space that are left to 19 000 unknowns: too few for MKL's libraries, and for its factor.  With fewer,
# OpenBLAS may wait for ever for a buffer that it cannot map.
@pytest.mark.parametrize("limit", [300_000_000, 450_000_000])
def test_one_line_and_exit_3(limit: int, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    command = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
    run = subprocess.run(
        [sys.executable, "-c", LIMITED.format(limit=limit), *command], capture_output=True, text=True, timeout=100
    )
    assert run.returncode == 3, run.stderr
    assert run.stderr == f"finger3d: {OUT_OF_MEMORY}\n"
