"""pytetwild guarded: checks before and after, crash, time limit, attempts; grading; cache. Two small real meshes."""

import math
import os
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.quality import curved_jacobians, curved_volume
from finger3d.fem.simplex import Mesh, boundary, signed_volumes, unfold
from finger3d.geometry.registry import designs
from finger3d.meshing import cache, tetwild
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.sizing import forecast, rounded_zone, sizing
from finger3d.meshing.snap import UnusableMeshError, check_closed

FIG9 = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0)
BALL = designs()["hemisphere"](5.0)
OPTIONS = SimpleNamespace(size_mm=5.0, base_size_mm=10.0, mesher="ftetwild")
ZONE = (-40.0, 40.0, -10.0, 10.0)
BOTH = ("x", "z")

CUBE = np.array([[x, y, z] for x in (0.0, 10.0) for y in (0.0, 10.0) for z in (0.0, 10.0)])
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


@pytest.fixture(scope="module")
def real() -> tuple[Mesh, Any, list[str]]:
    """The Fig. 9 quarter by pytetwild, its report, and what was said."""
    said: list[str] = []
    mesh, report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said.append)
    return mesh, report, said


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
    p = mesh.points[mesh.facets["contact"][:, :3]]
    length = np.linalg.norm(p - np.roll(p, 1, axis=1), axis=2).mean(axis=1)
    top = length[p[:, :, 0].max(axis=1) < 40.0].mean()
    base = mesh.points[mesh.facets["base"][:, :3]]
    assert 0.7 * OPTIONS.size_mm < top < 1.3 * OPTIONS.size_mm
    assert np.linalg.norm(base - np.roll(base, 1, axis=1), axis=2).mean() > 1.2 * top


def test_the_second_time_the_mesh_comes_from_the_cache(real: tuple[Mesh, Any, list[str]]) -> None:
    mesh, report, _ = real
    said: list[str] = []
    again, cached = mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said.append)
    assert cached.from_cache
    assert not report.from_cache
    assert cached.hash == report.hash
    assert cached.cache_path == report.cache_path
    assert Path(str(cached.cache_path)).is_file()
    assert said == [f"mesh from the cache, {cached.cache_path}"]
    np.testing.assert_array_equal(again.points, mesh.points)
    for label, facets in mesh.facets.items():
        np.testing.assert_array_equal(again.facets[label], facets)
    assert cached.cad_volume_mm3 == report.cad_volume_mm3
    assert not list(Path(str(cached.cache_path)).parent.glob(".*")), "a temporary file was left behind"


def test_a_warm_cache_needs_no_cad(real: tuple[Mesh, Any, list[str]]) -> None:
    code = (
        "import sys; from types import SimpleNamespace as N; from finger3d.geometry.registry import *;"
        "from finger3d.meshing.generate import *;"
        "d = designs()['clipped_cylinder'](100.0, 50.0, 36.6, 20.0); o = N(size_mm=5.0, base_size_mm=10.0, mesher='');"
        f"r = mesh_solid(d, o, {ZONE}, {BOTH})[1];"
        "print(r.from_cache, {'build123d', 'OCP', 'pytetwild', 'trimesh', 'scipy', 'vtk'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "True set()"


def test_a_hemisphere_is_meshed_off_the_middle() -> None:
    options = SimpleNamespace(size_mm=1.2, base_size_mm=2.0, mesher="ftetwild")
    mesh, report = mesh_solid(BALL, options, (0.0, 2.0, -1.0, 1.0), ("z",))
    assert set(mesh.facets) == {"contact", "base", "symmetry_z"}
    contact = mesh.points[np.unique(mesh.facets["contact"])]
    np.testing.assert_allclose(np.linalg.norm(contact, axis=1), 5.0, atol=1e-12)
    assert report.volume_mm3 == pytest.approx(BALL.volume_mm3, rel=1e-3)


@pytest.fixture
def stored(tmp_path: Path) -> tuple[Path, Mesh]:
    """A small mesh in a file."""
    options = SimpleNamespace(size_mm=2.0, base_size_mm=4.0, mesher="swept", layers=2)
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
    monkeypatch.setattr(tetwild, "_new_mesh", lambda *_: (stored[1], 1000.0, 0.0))
    report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH)[1]
    assert not report.from_cache
    assert report.cache_path == str(path)
    assert mesh_solid(FIG9, OPTIONS, ZONE, BOTH)[1].from_cache


def test_a_cache_that_cannot_be_written_is_said_and_does_not_stop_the_work(
    stored: tuple[Path, Mesh], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(stored[0]))  # a file where a folder should be
    monkeypatch.setattr(tetwild, "_new_mesh", lambda *_: (stored[1], 1000.0, 0.0))
    said: list[str] = []
    report = mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said.append)[1]
    assert report.cache_path is None
    assert "could not be kept" in said[-1]


def test_the_key_knows_all_that_shapes_the_mesh() -> None:
    other = designs()["clipped_cylinder"](100.0, 50.0, 36.6, 20.0 + 1e-12)
    finer = SimpleNamespace(size_mm=4.0, base_size_mm=10.0)
    coarser = SimpleNamespace(size_mm=5.0, base_size_mm=12.0)
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


def test_near_zones_share_a_mesh() -> None:
    zone = rounded_zone(FIG9, OPTIONS, (-38.2, 38.2, -10.0, 10.0))
    assert zone == rounded_zone(FIG9, OPTIONS, (-36.9, 39.7, -10.0, 10.0)) == ZONE
    assert rounded_zone(FIG9, OPTIONS, (-49.0, 49.0, 0.0, 0.0)) == (-50.0, 50.0, 0.0, 0.0)


def test_sizing_is_fine_in_the_zone_and_grows_at_its_rate() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    options = SimpleNamespace(size_mm=1.0, base_size_mm=8.0)
    field = sizing(FIG9, options, (-30.0, 30.0, -10.0, 10.0), low, high)
    depth = np.array([0.0, 2.0, 12.4, 40.0])
    h = field.at(np.stack([np.zeros(4), FIG9.height_mm - depth, np.zeros(4)], axis=1))
    np.testing.assert_allclose(h, [1.0, 1.0, 1.0 + 0.3 * (12.4 - 2.4), 8.0], rtol=0.02)
    points, tets, values = field.background()
    volume = np.abs(signed_volumes(Mesh(points, tets, {}))).sum()
    assert volume == pytest.approx(np.prod(np.ptp(points, axis=0)), rel=1e-12)
    assert (points.min(axis=0) < low).all()
    assert (points.max(axis=0) > high).all()
    assert len(np.unique(points[:, 2])) == 2  # a zone over the full width: the field does not depend on z
    assert values.min() == 1.0
    assert values.max() == 8.0


def test_a_zone_narrower_than_the_finger_is_refined_along_z_too() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    options = SimpleNamespace(size_mm=0.5, base_size_mm=8.0)
    points, _, values = sizing(FIG9, options, (-3.0, 3.0, -3.0, 3.0), low, high).background()
    near = np.abs(points - [0.0, FIG9.height_mm, 0.0]).max(axis=1) < 2.0
    end = np.abs(points - [0.0, FIG9.height_mm, 10.0]).max(axis=1) < 2.0
    assert values[near].max() < values[end].min()


def test_the_forecast_of_tets_matches_what_was_measured() -> None:
    low, high = np.array([-50.0, 0.0, -10.0]), np.array([50.0, FIG9.height_mm, 10.0])
    for size, measured in ((2.0, 17_000), (1.0, 50_725), (0.5, 218_607)):  # tets that pytetwild made
        field = sizing(FIG9, SimpleNamespace(size_mm=size, base_size_mm=10.0), (-44, 44, -10, 10), low, high)
        assert 0.9 < forecast(FIG9, field) / measured < 2.0  # too high where the grading is steep, never low


@pytest.mark.parametrize(
    ("size", "text"), [(30.0, "larger than the finger"), (0.05, "tetrahedra, forecast .* GB; allowed: at most")]
)
def test_sizes_that_hang_pytetwild_are_refused_before_cad(size: float, text: str) -> None:
    options = SimpleNamespace(size_mm=size, base_size_mm=30.0, mesher="ftetwild")
    with pytest.raises(Finger3dError, match=text):
        mesh_solid(FIG9, options, ZONE, BOTH)


def at(index: int, value: float) -> np.ndarray:
    points = CUBE.copy()
    points.flat[index] = value
    return points


@pytest.mark.parametrize(
    ("points", "triangles", "text"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3), dtype=int), "at least 4 triangles"),
        (CUBE[:, :2], SIDES, r"\(n, 3\) points"),
        (CUBE, np.hstack([SIDES, SIDES[:, :1]]), "triangles"),
        (CUBE, SIDES[:1], "at least 4 triangles"),
        (at(0, math.nan), SIDES, "not finite"),
        (at(0, math.inf), SIDES, "not finite"),
        (CUBE, SIDES + 1, "does not exist"),
        (CUBE, SIDES - 1, "does not exist"),
        (CUBE * 1e-9, SIDES, "diagonal"),
        (CUBE * 1e9, SIDES, "diagonal"),
        (CUBE * [1.0, 1.0, 0.0], SIDES, "thin"),
        (CUBE + 1e9, SIDES, "from the origin"),
        (CUBE, SIDES[1:], "not closed"),
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


def fine() -> Any:
    block = designs()["block"](5.0, 10.0, 10.0)
    options = SimpleNamespace(size_mm=4.0, base_size_mm=5.0)
    return sizing(block, options, (-5, 5, -5, 5), np.array([-5.0, 0, -5]), np.array([5.0, 10, 5]))


def test_a_crash_of_the_child_is_told_by_its_return_code() -> None:
    # A body without volume was seen to end pytetwild with a segmentation fault.
    with pytest.raises(UnusableMeshError, match="crashed .return code -11"):
        tetwild._child(CUBE * [1.0, 0.0, 1.0] + [0.0, 5.0, 0.0], SIDES, fine(), 1e-3, 60.0)


def test_a_child_that_takes_too_long_is_ended() -> None:
    with pytest.raises(UnusableMeshError, match="did not finish within 0 s"):
        tetwild._child(CUBE, SIDES, fine(), 1e-3, 0.05)


KILLED = """
import numpy as np
from types import SimpleNamespace
from finger3d.geometry.registry import designs
from finger3d.meshing import tetwild
from finger3d.meshing.sizing import sizing
from tests.test_meshing_tetwild import CUBE, SIDES
low, high = np.array([-5.0, 0, -5]), np.array([5.0, 10, 5])
options = SimpleNamespace(size_mm=0.3, base_size_mm=0.3)
field = sizing(designs()["block"](5.0, 10.0, 10.0), options, (-5, 5, -5, 5), low, high)
print("meshing", flush=True)
tetwild._child(CUBE, SIDES, field, 1e-3, 60.0)
"""


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
    end = time.monotonic() + 5.0
    while Path(f"/proc/{found[0]}").exists():
        assert time.monotonic() < end, "the child goes on without its parent"
        time.sleep(0.02)
    assert not list(tmp_path.iterdir())


def test_three_attempts_and_then_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path))
    calls = []

    def crash(*_: Any) -> None:
        calls.append(1)
        raise UnusableMeshError("pytetwild crashed (return code -11): no message")

    monkeypatch.setattr(tetwild, "_child", crash)
    said: list[str] = []
    with pytest.raises(Finger3dError, match="3 attempts .*return code -11.*mesher = 'swept'") as failed:
        mesh_solid(FIG9, OPTIONS, ZONE, BOTH, said.append)
    assert len(calls) == 3
    assert sum("meshing again" in text for text in said) >= 2
    assert "\n" not in str(failed.value)
    assert not list(tmp_path.rglob("*.npz"))


@pytest.mark.parametrize(
    ("tets", "volume", "text"),
    [
        (np.zeros((0, 4), dtype=int), 1.0, "no cells"),
        (np.array([[0, 1, 2, 4]]), 1000.0 / 6.0, "inverted"),
        (np.array([[0, 2, 1, 4]]), 200.0, "volume"),
    ],
)
def test_tets_that_are_no_mesh_of_the_body_are_refused(tets: Any, volume: float, text: str) -> None:
    with pytest.raises(UnusableMeshError, match=text):
        tetwild.check_tets(CUBE, tets, volume)
