"""The cache of meshes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing import cache
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.refinement.sizing import rounded_zone
from finger3d.meshing.unstructured import tetwild
from tests.commands import loaded
from tests.designs import FIG9, OPTIONS, ZONE, make
from tests.logs import Log

BOTH = ("x", "z")


def test_the_second_time_the_mesh_comes_from_the_cache(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh, report, _ = real
    said = Log()
    again, cached = mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said)
    assert cached.from_cache
    assert not report.from_cache
    assert cached.hash == report.hash
    assert cached.cache_path == report.cache_path
    assert Path(str(cached.cache_path)).is_file()
    (line,) = said.lines
    assert str(cached.cache_path) in line
    np.testing.assert_array_equal(again.points, mesh.points)
    for label, facets in mesh.facets.items():
        np.testing.assert_array_equal(again.facets[label], facets)
    assert cached.cad_volume_mm3 == report.cad_volume_mm3
    assert not list(Path(str(cached.cache_path)).parent.glob(".*")), "a temporary file was left behind"


def test_a_warm_cache_needs_no_cad(real: tuple[Mesh, Any, list[str]]) -> None:
    program = (
        "from types import SimpleNamespace as N; from finger3d.geometry.registry import *;"
        "from finger3d.meshing.generate import *;"
        "d = designs()['clipped_cylinder'](100.0, 50.0, 36.6, 20.0);"
        "o = N(size_mm=5.0, base_size_mm=10.0, mesher='ftetwild', grading=None);"
        f"assert mesh_solid(d, o, {ZONE}, {BOTH})[1].from_cache"
    )
    assert not loaded(program, "build123d", "OCP", "pytetwild", "trimesh", "scipy", "vtk")


@pytest.fixture
def stored(tmp_path: Path) -> tuple[Path, Mesh]:
    """A small mesh in a file."""
    options = MeshOptions(size_mm=2.0, base_size_mm=4.0, mesher="swept", layers=2)
    mesh = mesh_solid(designs()["block"](5.0, 5.0, 5.0), options, (-1, 1, -1, 1))[0]
    path = tmp_path / "mesh.npz"
    assert cache.save(path, mesh, 250.0)
    return path, mesh


def test_the_cache_returns_what_was_stored(stored: tuple[Path, Mesh]) -> None:
    found = cache.load(stored[0])
    assert found is not None
    np.testing.assert_array_equal(found[0].cells, stored[1].cells)
    assert set(found[0].facets) == set(stored[1].facets)
    assert found[1] == 250.0


@pytest.mark.parametrize("volume", [math.nan, math.inf, -1.0, 0.0])
def test_a_volume_that_is_none_is_not_trusted(stored: tuple[Path, Mesh], volume: float, tmp_path: Path) -> None:
    cache.save(tmp_path / "mesh.npz", stored[1], volume)
    assert cache.load(tmp_path / "mesh.npz") is None


def test_the_cache_keeps_parts(tmp_path: Path) -> None:
    design = make("fingertip")
    options = MeshOptions(size_mm=2.0, base_size_mm=4.0, mesher="swept", layers=1)
    mesh = mesh_solid(design, options, (-1, 1, -1, 1), BOTH)[0]
    path = tmp_path / "mesh.npz"
    assert cache.save(path, mesh, design.volume_mm3)
    found = cache.load(path)
    assert found is not None
    assert found[0].part_labels == ("skin", "core")
    np.testing.assert_array_equal(found[0].part, mesh.part)
    with np.load(path) as whole:
        arrays = {name: whole[name] for name in whole.files}
    arrays["part"] = 0 * arrays["part"]
    np.savez(path, **arrays)
    assert cache.load(path) is None


@pytest.mark.parametrize("damage", ["cut", "empty", "noise", "text", "absent", "changed", "array"])
def test_a_damaged_cache_file_is_not_trusted(stored: tuple[Path, Mesh], damage: str) -> None:
    path, mesh = stored
    data = path.read_bytes()
    if damage == "absent":
        path.unlink()
    elif damage == "changed":
        with np.load(path) as whole:
            arrays = {name: whole[name] for name in whole.files}
        arrays["facets_base"] = arrays["facets_base"][:-1]
        np.savez(path, **arrays)
    elif damage == "array":  # np.load gives the array itself, which is no archive
        with path.open("wb") as stream:
            np.save(stream, np.zeros(3))
    else:
        middle = len(data) // 2
        noise = data[:middle] + bytes(b ^ 255 for b in data[middle : middle + 64]) + data[middle + 64 :]
        path.write_bytes({"cut": data[:middle], "empty": b"", "noise": noise, "text": b"not a mesh"}[damage])
    assert cache.load(path) is None
    assert cache.save(path, mesh, 250.0)
    assert cache.load(path) is not None


def test_a_damaged_file_is_meshed_again(stored: tuple[Path, Mesh], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(stored[0].parent))
    path = cache.folder() / f"{cache.key(FIG9, OPTIONS, rounded_zone(FIG9, OPTIONS, ZONE), BOTH)}.npz"
    path.parent.mkdir(parents=True)
    path.write_bytes(stored[0].read_bytes()[:-500])
    monkeypatch.setattr(tetwild, "new_mesh", lambda *_: (stored[1], 1000.0, 0.0))
    report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH)[1]
    assert not report.from_cache
    assert report.cache_path == str(path)
    assert mesh_solid(FIG9, OPTIONS, ZONE, BOTH)[1].from_cache


def test_a_cache_that_cannot_be_written_is_said_and_does_not_stop_the_work(
    stored: tuple[Path, Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(stored[0]))  # a file where a folder should be
    monkeypatch.setattr(tetwild, "new_mesh", lambda *_: (stored[1], 1000.0, 0.0))
    said = Log()
    report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said)[1]
    assert report.cache_path is None
    assert "kept" in said.lines[-1]


def test_the_key_knows_all_that_shapes_the_mesh(monkeypatch: pytest.MonkeyPatch) -> None:
    other = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0 + 1e-12)
    finer = MeshOptions(size_mm=4.0, base_size_mm=10.0)
    coarser = MeshOptions(size_mm=5.0, base_size_mm=12.0)
    keys = [
        cache.key(FIG9, OPTIONS, ZONE, BOTH),
        cache.key(other, OPTIONS, ZONE, BOTH),
        cache.key(FIG9, finer, ZONE, BOTH),
        cache.key(FIG9, coarser, ZONE, BOTH),
        cache.key(FIG9, OPTIONS, (-30.0, 30.0, -10.0, 10.0), BOTH),
        cache.key(FIG9, OPTIONS, ZONE, ("x",)),
    ]
    assert len(set(keys)) == len(keys)
    assert cache.key(FIG9, OPTIONS, ZONE, ("z", "x")) == keys[0]
    monkeypatch.setattr(cache, "source_hash", lambda folder: f"other {folder}")
    assert cache.key(FIG9, OPTIONS, ZONE, BOTH) not in keys


def test_designs_typed_at_a_prompt_share_no_mesh() -> None:
    block = designs()["block"]
    typed = [type("Own", (block,), {"name": "own", "__module__": "typed at a prompt"}) for _ in range(2)]
    first, second = (cache.key(own(5.0, 5.0, 5.0), OPTIONS, ZONE, BOTH) for own in typed)
    assert first != second


def test_near_zones_share_a_mesh() -> None:
    zone = rounded_zone(FIG9, OPTIONS, (-38.2, 38.2, -10.0, 10.0))
    assert zone == rounded_zone(FIG9, OPTIONS, (-36.9, 39.7, -10.0, 10.0)) == ZONE
    assert rounded_zone(FIG9, OPTIONS, (-49.0, 49.0, 0.0, 0.0)) == (-50.0, 50.0, 0.0, 0.0)
