"""VTU files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, quadratic
from finger3d.results.vtu import write_vtu
from tests.commands import loaded


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
    with pytest.raises(ValueError, match="'u'"):
        write_vtu(tmp_path / "f.vtu", triangles(), {"u": np.zeros(3)})
    assert list(tmp_path.iterdir()) == []


def test_writing_loads_neither_vtk_nor_pyvista(tmp_path: Path) -> None:
    program = (
        "import numpy as np; from finger3d.results.vtu import write_vtu; from finger3d.fem.mesh.simplex import Mesh;"
        f"write_vtu({str(tmp_path / 'f.vtu')!r}, Mesh(np.eye(3)[:, :2], np.array([[0, 1, 2]]), {{}}), {{}})"
    )
    assert not loaded(program, "vtk", "vtkmodules", "pyvista", "matplotlib")
