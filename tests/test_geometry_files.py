"""Files with bodies."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.files import read_surface, welded
from finger3d.geometry.imported import imported
from finger3d.geometry.surface import Triangles
from finger3d.geometry.surface_checks import mistake
from tests.bodies import box, write_stl

DRAWN: list[Path] = []


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda p: (p / "a.stl").write_text("hello"), "a.stl: .*STL"),
        (lambda p: (p / "a.stl").write_text(""), "STL"),
        (lambda p: (p / "a.stl").write_bytes(bytes(range(256)) * 10), "STL"),
        (lambda p: (p / "a.stl").write_bytes(b"\0" * 80 + (2**31).to_bytes(4, "little")), "STL"),
        (lambda p: (p / "a.step").write_text("hello"), "a.step: .*STEP"),
        (lambda p: (p / "a.step").write_text(""), "STEP"),
        (lambda p: shutil.copy(DRAWN[0] / "two.step", p / "a.step"), "a.step: .*2 solids"),
        (lambda p: shutil.copy(DRAWN[0] / "face.step", p / "a.step"), "solid"),
        (lambda p: (p / "a.obj").write_text("v 0 0 0"), ".stl, .step or .stp"),
        (lambda p: (p / "a.stl").mkdir(), "a.stl"),
        (lambda p: None, "a.stl"),
    ],
    ids=["text", "empty", "bytes", "header", "step text", "step empty", "two solids", "face", "obj", "folder", "none"],
)
def test_files_that_hold_no_body(drawn: Path, tmp_path: Path, make, text: str) -> None:
    DRAWN[:] = [drawn]
    make(tmp_path)
    path = next(tmp_path.iterdir(), tmp_path / "a.stl")
    for read in (read_surface, imported):
        with pytest.raises(Finger3dError, match=text) as refused:
            read(path)
        assert "\n" not in str(refused.value)


def test_gaps_of_single_precision_are_closed() -> None:
    soup = box(20.0, 10.0, 6.0)
    loose = soup.corners.reshape(-1, 3) + np.random.default_rng(0).uniform(-1e-6, 1e-6, (36, 3))
    joined = welded(loose, np.arange(36).reshape(-1, 3))
    assert len(joined.points) == 8
    assert mistake(joined) == ""


def patches(surface: Triangles) -> str:
    """An STL text with a solid for each pair of triangles."""
    lines = []
    for k, pair in enumerate(surface.corners.reshape(-1, 2, 3, 3)):
        lines += [f"solid vertex of patch {k}"]
        for corners in pair:
            lines += ["facet normal 0 0 0", "outer loop", *("vertex {} {} {}".format(*p) for p in corners)]
            lines += ["endloop", "endfacet"]
        lines += [f"endsolid vertex of patch {k}"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("change", [str, str.upper, lambda t: t.replace("\n", "\r\n"), lambda t: "\ufeff\n" + t])
def test_a_text_of_several_solids_is_one_body(tmp_path: Path, change) -> None:
    (tmp_path / "a.stl").write_bytes(change(patches(box(20.0, 10.0, 6.0))).encode())
    assert read_surface(tmp_path / "a.stl").volume == pytest.approx(1200.0, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            lambda t: t[: t.rindex("endloop")],
            "11 whole facets and 36 vertices, where a facet has three: it was cut off",
        ),
        (lambda t: t[: t.rindex("endsolid")], "does not end with 'endsolid': it was cut off"),
        (lambda t: t.replace("10.0", "10,0"), "not three numbers"),
        (lambda t: "solid a\nendsolid a\n", "no triangles"),
    ],
    ids=["facet", "end", "comma", "none"],
)
def test_the_reason_of_a_refused_text_is_the_true_one(tmp_path: Path, change, reason: str) -> None:
    (tmp_path / "a.stl").write_text(change(patches(box(20.0, 10.0, 6.0))))
    with pytest.raises(Finger3dError, match=reason):
        read_surface(tmp_path / "a.stl")


def test_a_binary_file_that_was_cut_off_is_told_and_one_with_more_bytes_is_read(tmp_path: Path) -> None:
    from trimesh import Trimesh
    from trimesh.exchange.stl import export_stl

    body = box(20.0, 10.0, 6.0)
    content = b"solid" + export_stl(Trimesh(body.points, body.faces))[5:]  # as some programs begin the header
    path = tmp_path / "a.stl"
    for more in (b"", b"0123456789"):
        path.write_bytes(content + more)
        assert read_surface(path).volume == pytest.approx(1200.0, rel=1e-6)
    path.write_bytes(content[:-60])
    with pytest.raises(Finger3dError, match="announces 12 triangles, and 10 follow: it was cut off"):
        read_surface(path)


def test_a_body_that_runs_through_itself_is_no_object(tmp_path: Path) -> None:
    whole = box(10.0, 4.0, 6.0)
    points = whole.points.copy()
    points[points[:, 0] > 0.0, 1] *= -0.9  # the cross-section is a figure of eight
    write_stl(tmp_path / "eight.stl", Triangles(points, whole.faces))
    with pytest.raises(Finger3dError, match="runs through itself at .* near"):
        read_surface(tmp_path / "eight.stl")
