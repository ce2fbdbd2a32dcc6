"""The process that runs netgen: STEP and sizes in, points and tets out, and no files left behind."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from finger3d.fem.simplex import Mesh, signed_volumes
from finger3d.geometry.registry import designs
from finger3d.meshing.solids import glued_solids


def answer(step: Path, scratch: Path, size_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Points and tets of a STEP file with edges of a size at the top of a block, 1 mm elsewhere."""
    given = io.BytesIO()
    content = np.frombuffer(step.read_bytes(), dtype=np.uint8)
    np.savez(given, step=content, largest=1.0, rate=0.3, points=[[0.0, 1.0, 0.0]], sizes=[size_mm])
    done = subprocess.run(
        [sys.executable, "-P", "-m", "finger3d.meshing._netgen_child", str(os.getpid())], input=given.getvalue(),
        capture_output=True, check=True, timeout=120, env=os.environ | {"TMPDIR": str(scratch)}, cwd=scratch,
    )  # fmt: skip
    with np.load(io.BytesIO(done.stdout)) as found:
        return found["points"], found["tets"]


def test_it_answers_with_positive_tets_that_fill_the_solid(tmp_path: Path) -> None:
    from build123d import export_step

    block = designs()["block"](half_length_mm=2.0, height_mm=1.0, width_mm=2.0)
    export_step(glued_solids(block, ()).shape, tmp_path / "block.step")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    counts = []
    for size in (1.0, 0.1):
        points, tets = answer(tmp_path / "block.step", scratch, size)
        volumes = signed_volumes(Mesh(points, tets, {}))
        assert (volumes > 0.0).all()
        np.testing.assert_allclose(volumes.sum(), 4.0 * 1.0 * 2.0, rtol=1e-9)
        counts.append(len(tets))
    assert counts[1] > 2 * counts[0]
    assert list(scratch.iterdir()) == []
