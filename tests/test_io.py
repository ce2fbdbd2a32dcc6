"""Files are whole, exact, and read by the programs they are made for."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError, Outcome
from finger3d.fem.simplex import Mesh, quadratic
from finger3d.io import atomic, claimed, write_csv, write_json
from finger3d.results.vtu import write_vtu


def tetrahedra() -> Mesh:
    """Two linear tetrahedra that share a face."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    return Mesh(points, np.array([[0, 1, 2, 3], [1, 4, 2, 3]]), {})


def triangles() -> Mesh:
    """The unit square in two linear triangles."""
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    return Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]), {})


@pytest.mark.parametrize(
    ("mesh", "kind"),
    [(tetrahedra(), 10), (quadratic(tetrahedra()), 24), (triangles(), 5), (quadratic(triangles()), 22)],
)
def test_vtu_is_read_back_identical(tmp_path: Path, mesh: Mesh, kind: int) -> None:
    import pyvista

    rng = np.random.default_rng(1)
    n, d = mesh.points.shape
    fields = {
        "displacement (mm)": rng.normal(size=(n, d)),
        'pressure "p" <MPa>': np.where(np.arange(n) < 2, np.nan, rng.normal(size=n)),
        "stress (MPa)": rng.normal(size=(n, d, d)),
        "status": np.arange(n, dtype=np.int8),
        "held": np.arange(n) % 2 == 0,
    }
    volume = rng.normal(size=len(mesh.cells))
    write_vtu(tmp_path / "f.vtu", mesh, fields, {"volume": volume})
    grid = pyvista.read(tmp_path / "f.vtu")

    np.testing.assert_array_equal(grid.points[:, :d], mesh.points)
    np.testing.assert_array_equal(grid.points[:, d:], 0.0)
    np.testing.assert_array_equal(grid.cells.reshape(len(mesh.cells), -1)[:, 1:], mesh.cells)
    assert set(grid.celltypes) == {kind}
    np.testing.assert_array_equal(grid["displacement (mm)"][:, :d], fields["displacement (mm)"])
    assert grid["displacement (mm)"].shape == (n, 3)
    np.testing.assert_array_equal(grid['pressure "p" <MPa>'], fields['pressure "p" <MPa>'])
    np.testing.assert_array_equal(grid["stress (MPa)"].reshape(n, 3, 3)[:, :d, :d], fields["stress (MPa)"])
    np.testing.assert_array_equal(grid["status"], fields["status"])
    np.testing.assert_array_equal(grid["held"], fields["held"])
    np.testing.assert_array_equal(grid.cell_data["volume"], volume)


def test_vtk_measures_the_same_volume_on_quadratic_cells(tmp_path: Path) -> None:
    import pyvista

    write_vtu(tmp_path / "f.vtu", quadratic(tetrahedra()), {})
    # The two tetrahedra hold 1/6 and 2/6 of the unit cube.
    assert pyvista.read(tmp_path / "f.vtu").volume == pytest.approx(0.5, rel=1e-12)


def test_vtu_refuses_a_field_of_another_length(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="'u' has shape"):
        write_vtu(tmp_path / "f.vtu", triangles(), {"u": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []


def test_writing_loads_neither_vtk_nor_pyvista(tmp_path: Path) -> None:
    code = (
        "import sys, numpy as np; from finger3d.results.vtu import write_vtu; from finger3d.fem.simplex import Mesh;"
        f"write_vtu({str(tmp_path / 'f.vtu')!r}, Mesh(np.eye(3)[:, :2], np.array([[0, 1, 2]]), {{}}), {{}});"
        "sys.exit(any(m.split('.')[0] in ('vtk', 'vtkmodules', 'pyvista', 'matplotlib') for m in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_csv_keeps_every_digit(tmp_path: Path) -> None:
    x = np.array([0.1, 1 / 3, 1e-300, -2.5e17])
    write_csv(tmp_path / "t.csv", {"x_mm": x, "status": np.array(["open", "stick", "slip", "a,b"]), "n": np.arange(4)})
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(r["x_mm"]) for r in rows] == x.tolist()
    assert [r["status"] for r in rows] == ["open", "stick", "slip", "a,b"]
    assert [r["n"] for r in rows] == ["0", "1", "2", "3"]


def test_csv_refuses_columns_of_different_length(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="differ in shape"):
        write_csv(tmp_path / "t.csv", {"a": np.zeros(3), "b": np.zeros(2)})
    assert list(tmp_path.iterdir()) == []


def test_json_takes_arrays_and_has_no_nan(tmp_path: Path) -> None:
    data = {"a": np.array([1.5, np.nan]), "b": np.float64(1 / 3), "c": (np.int64(2), Outcome.CONVERGED), "d": None}
    write_json(tmp_path / "s.json", data)
    text = (tmp_path / "s.json").read_text()
    assert json.loads(text) == {"a": [1.5, None], "b": 1 / 3, "c": [2, "converged"], "d": None}
    assert "NaN" not in text


def test_atomic_leaves_the_old_file_when_the_block_fails(tmp_path: Path) -> None:
    target = tmp_path / "result.txt"
    target.write_text("old")

    def write_half() -> None:
        with atomic(target) as temporary:
            temporary.write_text("half")
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        write_half()
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_atomic_replaces_and_keeps_usual_permissions(tmp_path: Path) -> None:
    target = tmp_path / "new" / "result.txt"
    for text in ("one", "two"):
        with atomic(target) as temporary:
            assert temporary.suffix == ".txt"
            temporary.write_text(text)
    plain = tmp_path / "plain"
    plain.touch()
    assert target.read_text() == "two"
    assert list(target.parent.iterdir()) == [target]
    assert os.stat(target).st_mode == os.stat(plain).st_mode


def test_a_folder_that_cannot_be_written_is_a_users_mistake(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(Finger3dError, match=r"cannot write .*file/s\.json: .*; choose another place") as caught:
        write_json(tmp_path / "file" / "s.json", {})
    assert "\n" not in str(caught.value)


def test_a_folder_into_which_nothing_was_written_goes_with_those_made_for_it(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    with claimed(mine / "a" / "b") as folder:
        assert folder.is_dir()
    assert list(mine.iterdir()) == []
    # one that was there stays, and so does one that holds something
    with claimed(mine):
        pass
    with claimed(mine / "c") as folder:
        (folder / "result").touch()
    assert mine.is_dir()
    assert (mine / "c" / "result").exists()
