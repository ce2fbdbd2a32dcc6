"""The process that runs netgen: STEP and sizes in, points and tets out, and no files left behind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from finger3d._child import in_child
from finger3d.fem.mesh.simplex import Mesh, signed_volumes
from finger3d.geometry.registry import designs
from finger3d.meshing.unstructured import _meshers
from finger3d.meshing.unstructured.solids import glued_solids


def test_it_answers_with_positive_tets_that_fill_the_solid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from build123d import export_step

    block = designs()["block"](half_length_mm=2.0, height_mm=1.0, width_mm=2.0)
    export_step(glued_solids(block, ()).shape, tmp_path / "block.step")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.chdir(scratch)
    content = np.frombuffer((tmp_path / "block.step").read_bytes(), dtype=np.uint8)
    counts = []
    for size in (1.0, 0.1):
        given = {"step": content, "largest": 1.0, "rate": 0.3, "points": [[0.0, 1.0, 0.0]], "sizes": [size]}
        found = in_child(_meshers.netgen, 120.0, **given)
        points, tets = found["points"], found["tets"]
        volumes = signed_volumes(Mesh(points, tets, {}))
        assert (volumes > 0.0).all()
        np.testing.assert_allclose(volumes.sum(), 4.0 * 1.0 * 2.0, rtol=1e-9)
        counts.append(len(tets))
    assert counts[1] > 2 * counts[0]
    assert list(scratch.iterdir()) == []
