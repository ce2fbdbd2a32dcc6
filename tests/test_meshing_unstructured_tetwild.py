"""pytetwild guarded: checks before and after, crash, time limit, attempts; grading; cache. Two small real meshes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.mesh.quality import curved_jacobians, curved_volume
from finger3d.fem.mesh.simplex import Mesh, boundary, signed_volumes, unfold
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.snap import UnusableMeshError, check_closed
from finger3d.meshing.unstructured import tetwild
from tests.bodies import CUBE, SIDES
from tests.designs import FIG9, OPTIONS, ZONE
from tests.logs import Log
from tests.meshes import edge_lengths

BALL = designs()["hemisphere"](5.0)
BOTH = ("x", "z")


def test_a_real_mesh_lies_on_the_cad_and_fills_it(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh, report, _ = real
    assert set(mesh.facets) == {"contact", "base", "ends", "walls", "symmetry_x", "symmetry_z"}
    at = {label: mesh.points[np.unique(f)] for label, f in mesh.facets.items()}
    planes = {"base": (1, 0.0), "ends": (2, 10.0), "walls": (0, 50.0), "symmetry_x": (0, 0.0), "symmetry_z": (2, 0.0)}
    for label, (axis, value) in planes.items():
        assert (at[label][:, axis] == value).all()
    off = np.hypot(at["contact"][:, 0], at["contact"][:, 1] - FIG9.height_mm + 100.0) - 100.0
    assert np.abs(off).max() < 1e-10
    assert (signed_volumes(mesh) > 0.0).all()
    assert (curved_jacobians(mesh) > 0.0).all()
    assert report.volume_mm3 == pytest.approx(FIG9.volume_mm3, rel=1e-4)
    assert report.cad_volume_mm3 == FIG9.volume_mm3
    assert 3.0 <= report.min_dihedral_deg < 60.0
    assert (report.points, report.cells) == (len(mesh.points), len(mesh.cells))


def test_a_real_quarter_unfolds_to_a_closed_body(real: tuple[Mesh, Any, list[str]]) -> None:
    whole = unfold(real[0], (0, 2))[0]
    faces = boundary(whole.cells[:, :4], 3)
    check_closed(faces)
    assert sum(len(f) for f in whole.facets.values()) == len(faces)
    assert curved_volume(whole) == pytest.approx(FIG9.volume_mm3, rel=1e-4)


def test_a_real_mesh_is_finer_in_the_zone_than_at_the_base(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh = real[0]
    contact, length = edge_lengths(mesh, "contact")
    top = length[contact[:, :, 0].max(axis=1) < 40.0].mean()
    assert 0.7 * OPTIONS.size_mm < top < 1.3 * OPTIONS.size_mm
    assert edge_lengths(mesh, "base")[1].mean() > 1.2 * top


def test_a_hemisphere_is_meshed_off_the_middle() -> None:
    options = MeshOptions(size_mm=1.2, base_size_mm=2.0, mesher="ftetwild")
    mesh, report = mesh_solid(BALL, options, (0.0, 2.0, -1.0, 1.0), ("z",))
    assert set(mesh.facets) == {"contact", "base", "symmetry_z"}
    contact = mesh.points[np.unique(mesh.facets["contact"])]
    np.testing.assert_allclose(np.linalg.norm(contact, axis=1), 5.0, atol=1e-12)
    assert report.volume_mm3 == pytest.approx(BALL.volume_mm3, rel=1e-3)


def at(index: int, value: float) -> np.ndarray:
    points = CUBE.copy()
    points.flat[index] = value
    return points


@pytest.mark.parametrize(
    ("points", "triangles", "text"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), dtype=int), "4 triangles"),
        (CUBE[:, :2], SIDES, r"\(n, 3\) points"),
        (CUBE, np.hstack([SIDES, SIDES[:, :1]]), "triangles"),
        (CUBE, SIDES[:1], "4 triangles"),
        (at(0, math.nan), SIDES, "finite"),
        (at(0, math.inf), SIDES, "finite"),
        (CUBE, SIDES + 1, "exist"),
        (CUBE, SIDES - 1, "exist"),
        (CUBE * 1e-9, SIDES, "diagonal"),
        (CUBE * 1e9, SIDES, "diagonal"),
        (CUBE * [1.0, 1.0, 0.0], SIDES, "thin"),
        (CUBE + 1e9, SIDES, "origin"),
        (CUBE, SIDES[1:], "closed"),
        (CUBE, SIDES[:, ::-1], "outward"),
        (CUBE, np.vstack([SIDES[:1, ::-1], SIDES[1:]]), "outward"),
    ],
    ids=["empty", "flat points", "quads", "one triangle", "nan", "inf", "index high", "index low", "tiny", "huge",
         "flat", "far", "hole", "inverted", "mixed"],
)  # fmt: skip
def test_surfaces_that_crash_or_hang_pytetwild_are_refused(points: Any, triangles: Any, text: str) -> None:
    with pytest.raises(Finger3dError, match=text) as refused:
        tetwild.check_surface(points, triangles)
    assert "\n" not in str(refused.value)


def test_a_good_surface_passes() -> None:
    assert tetwild.surface_defect(CUBE, SIDES) == ""


def test_three_attempts_and_then_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path))
    calls = []

    def crash(*_: Any) -> None:
        calls.append(1)
        raise UnusableMeshError("pytetwild crashed (return code -11): no message")

    monkeypatch.setattr(tetwild, "run_child", crash)
    said = Log()
    with pytest.raises(Finger3dError, match="3 .* -11.*mesher = 'swept'") as failed:
        mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said)
    assert len(calls) == 3
    assert sum("again" in text for text in said.lines) >= 2
    assert "\n" not in str(failed.value)
    assert not list(tmp_path.rglob("*.npz"))
