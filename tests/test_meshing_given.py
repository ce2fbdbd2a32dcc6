"""Fingers that are mesh files: read, written, checked, put on their base, bisected."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.mesh import Mesh, curved_volume, quadratic
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.given import GivenMesh, given_mesh
from finger3d.meshing.mesh_files import read_contents, write_mesh_vtu
from tests.given_meshes import GMSH, cube, refused, vtu_of
from tests.meshes import part_volume

# Gmsh 4.15 writes the middles of a tetrahedron's last two edges in the other order than VTK: (2, 3), then (1, 3)
TET10 = (GMSH / "tetrahedron.msh").read_text(encoding="ascii")


def test_quadratic_cells_of_gmsh_come_into_the_order_of_vtk(tmp_path: Path) -> None:
    path = tmp_path / "one.msh"
    path.write_text(TET10, encoding="ascii")
    found = read_contents(path)
    corners = found.points[found.cells[0]]
    for node, ends in zip(range(4, 10), [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], strict=True):
        np.testing.assert_array_equal(corners[node], corners[list(ends)].mean(axis=0))
    assert found.label.tolist() == ["base", "contact"]
    assert found.part.tolist() == ["skin"]


@pytest.mark.parametrize("name", ["text.msh", "binary.msh"])
def test_both_kinds_of_files_of_gmsh_are_read(name: str) -> None:
    found = read_contents(GMSH / name)
    assert found.cells.shape[1] == 10
    assert set(found.label) == {"base", "contact"}
    assert set(found.part) == {"core", "body"}


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (TET10.replace("4.1 0 8", "2.2 0 8"), r" 2\.2 .*4\.1: gmsh -format msh41"),
        ("solid x\n", r"\$MeshFormat"),
        (TET10[:-60], "damaged or incomplete"),
        (TET10.replace("3 1 0 10\n", "3 1 1 10\n"), "Mesh.SaveParametric = 0"),
        (TET10.replace("3 1 11 1\n3 1 2 3 4 5 6 7 8 9 10", "3 1 5 1\n3 1 2 3 4 5 6 7 8"), "1 of type hexahedron"),
        (
            TET10.replace("3 3 1 3\n", "2 2 1 2\n").split("3 1 11 1")[0] + "$EndElements\n",
            "no tetrahedra; .*physical group",
        ),
        (TET10.replace("0.5 0.5 0\n", "nan 0.5 0\n"), "coordinate .*finite"),
    ],
)
def test_other_files_of_gmsh_are_refused(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "body.msh"
    path.write_text(text, encoding="ascii")
    assert re.search(told, refused(lambda: read_contents(path)))


def test_every_name_that_gmsh_writes_is_read(tmp_path: Path) -> None:
    path = tmp_path / "one.msh"
    changes = {
        "a reversed surface": ("1 1 1 1 0\n2", "1 1 1 -1 0\n2", ["base", "contact"], "skin"),
        "a volume named as a surface": ('3 7 "skin"', '3 7 "base"', ["base", "contact"], "base"),
        "a quotation mark": ('"skin"', '"the "soft" skin"', ["base", "contact"], 'the "soft" skin'),
        "two groups": ("1 1 1 1 7 0", "1 1 1 2 9 7 0", ["base", "contact"], "skin"),
    }
    for what, (old, new, labels, part) in changes.items():
        assert old in TET10
        path.write_text(TET10.replace(old, new), encoding="ascii")
        found = read_contents(path)
        assert found.label.tolist() == labels, what
        assert found.part.tolist() == [part], what


def stack(groups: Sequence[tuple[str, set[int]]]) -> str:
    """A file of three tetrahedra on one facet each, each a volume, and groups of them in the order of their numbers."""
    numbers = {tag: [k for k, (_, members) in enumerate(groups, 1) if tag in members] for tag in (1, 2, 3)}
    entities = [f"{tag} 0 0 0 1 1 1 {len(own)} {' '.join(map(str, own))} 0" for tag, own in numbers.items()]
    points = ["0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 1 1", "2 1 1"]
    cells = ["3 1 4 1", "1 1 2 3 4", "3 2 4 1", "2 2 3 4 5", "3 3 4 1", "3 3 4 5 6"]
    names = [f'3 {k} "{name}"' for k, (name, _) in enumerate(groups, 1)]
    sections = {
        "MeshFormat": ["4.1 0 8"],
        "PhysicalNames": [str(len(names)), *names],
        "Entities": ["0 0 0 3", *entities],
        "Nodes": ["1 6 1 6", "3 1 0 6", *map(str, range(1, 7)), *points],
        "Elements": ["3 3 1 3", *cells],
    }
    return "".join("\n".join([f"${name}", *lines, f"$End{name}\n"]) for name, lines in sections.items())


@pytest.mark.parametrize(
    ("groups", "parts"),
    [
        ({"all": {1, 2, 3}, "core": {1}}, ["core", "", ""]),
        ({"all": {1, 2, 3}, "core": {1}, "skin": {2, 3}}, ["core", "skin", "skin"]),
        ({"all": {1, 2, 3}, "core": {1, 2}, "bone": {1}}, ["bone", "core", ""]),
        ({"finger": {1, 2, 3}, "all": {1, 2, 3}}, ["all", "all", "all"]),
        ({"core": {1, 2}, "left": {2, 3}}, None),
        ({"core": {1}, "bone": {1}}, None),
    ],
)
def test_the_innermost_of_nested_volumes_names_a_part(
    groups: dict[str, set[int]], parts: list[str] | None, tmp_path: Path
) -> None:
    path = tmp_path / "stack.msh"
    for order in itertools.permutations(groups.items()):
        path.write_text(stack(order), encoding="ascii")
        if parts is None:
            assert re.search("a volume is named both '.*' and '.*'", refused(lambda: read_contents(path)))
        else:
            assert read_contents(path).part.tolist() == parts


@pytest.mark.parametrize(("name", "encoding"), [("K\u00f6rper", "latin-1"), ("\u529b", "gb18030")])
def test_names_may_have_any_letters(name: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "one.msh"
    path.write_bytes(TET10.replace("skin", name).encode(encoding))
    assert read_contents(path).part.tolist() == [name]
    text = vtu_of(tmp_path / "one.vtu", cube(1), parts=["xyz"], text=True).read_bytes()
    assert b"120 121 122 " in text
    letters = b" ".join(b"%d" % letter for letter in name.encode(encoding))
    (tmp_path / "one.vtu").write_bytes(text.replace(b"120 121 122 ", letters + b" "))
    assert set(read_contents(tmp_path / "one.vtu").part) == {name}


@pytest.mark.parametrize("degree", [2, 3])
def test_lagrange_cells_of_vtk_are_read_up_to_degree_2(degree: int, tmp_path: Path) -> None:
    import pyvista

    path = tmp_path / "body.vtu"
    write_mesh_vtu(path, quadratic(cube(1)))
    expected, grid = read_contents(path), pyvista.read(path)
    types = np.select([np.isin(grid.celltypes, [10, 24]), True], [71, 69]).astype(np.uint8)
    cells = np.append(grid.cells, [20, *np.arange(20) % 4]) if degree == 3 else grid.cells
    lagrange = pyvista.UnstructuredGrid(cells, np.append(types, [71] * (degree == 3)).astype(np.uint8), grid.points)
    if degree == 3:
        lagrange.save(path)
        assert "1 of type 71 of VTK with 20 nodes" in refused(lambda: read_contents(path))
        return
    lagrange.GetCellData().ShallowCopy(grid.GetCellData())
    lagrange.GetFieldData().ShallowCopy(grid.GetFieldData())
    lagrange.save(path)
    found = read_contents(path)
    for name in ("points", "cells", "triangles", "label", "part"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_a_file_of_gmsh_with_cells_of_no_group_is_read(tmp_path: Path) -> None:  # Mesh.SaveAll = 1
    text = TET10.replace("0 0 2 1\n", "0 0 3 1\n").replace("1 2 0\n", "1 2 0\n3 0 0 0 1 1 1 0 0\n")
    text = text.replace("3 3 1 3\n", "4 4 1 4\n").replace("3 1 11 1\n", "2 3 9 1\n4 1 2 4 5 10 8\n3 1 11 1\n")
    path = tmp_path / "one.msh"
    path.write_text(text, encoding="ascii")
    assert read_contents(path).label.tolist() == ["base", "contact"]


def test_every_negative_number_is_no_name(tmp_path: Path) -> None:
    import pyvista

    path = vtu_of(tmp_path / "a.vtu", cube(1), parts=["", "bone"], numbers=True)
    expected, grid = read_contents(path), pyvista.read(path)
    label = np.asarray(grid.cell_data["label"])
    grid.cell_data["label"] = np.where(label < 0, -5, label)
    grid.save(path)
    found = read_contents(path)
    assert found.label.tolist() == expected.label.tolist()
    np.testing.assert_array_equal(found.triangles, expected.triangles)


def test_names_are_texts_or_numbers_of_field_data(tmp_path: Path) -> None:
    mesh = cube(1)
    texts = read_contents(vtu_of(tmp_path / "a.vtu", mesh, parts=["", "bone"]))
    numbers = read_contents(vtu_of(tmp_path / "b.vtu", mesh, parts=["", "bone"], numbers=True))
    for found in (texts, numbers):
        assert set(found.label) == {"contact", "base"}
        assert set(found.part) == {"", "bone"}
    np.testing.assert_array_equal(texts.cells, numbers.cells)
    np.testing.assert_array_equal(texts.part, numbers.part)


def test_other_files_of_vtk_are_refused(tmp_path: Path) -> None:
    mesh = cube(1)
    assert "unstructured grid" in refused(lambda: read_contents(_file(tmp_path / "a.vtu", b"<VTKFile>")))
    whole = vtu_of(tmp_path / "b.vtu", mesh).read_bytes()
    assert "unstructured grid" in refused(lambda: read_contents(_file(tmp_path / "c.vtu", whole[: len(whole) // 2])))
    assert "'label_names'" in refused(
        lambda: read_contents(vtu_of(tmp_path / "d.vtu", mesh, numbers=True, names=False))
    )
    assert "1 of type 12 of VTK" in refused(lambda: read_contents(vtu_of(tmp_path / "e.vtu", mesh, hexahedron=True)))
    assert "there is no such file" in refused(lambda: read_contents(tmp_path / "f.vtu"))


def test_vtk_prints_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(Finger3dError):
        read_contents(_file(tmp_path / "a.vtu", b'<VTKFile type="UnstructuredGrid"><Piece>'))
    assert capfd.readouterr() == ("", "")


def _file(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


RADIUS, MIDDLE = 20.0, -12.0  # of the dome's arc, mm
EVERYWHERE = (-99.0, 99.0, -99.0, 99.0)


def made(tmp_path: Path, mesh: Mesh, **options: object) -> GivenMesh:
    """A mesh that was written and read."""
    return given_mesh(vtu_of(tmp_path / "body.vtu", mesh, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["text.msh", "binary.msh"])
def test_a_mesh_of_gmsh_is_a_finger(name: str) -> None:
    body = given_mesh(GMSH / name)
    angle = np.arcsin(10.0 / RADIUS)
    segment = RADIUS**2 * (angle - np.sin(angle) * np.cos(angle))
    exact = 8.0 * (20.0 * (RADIUS * np.cos(angle) + MIDDLE) + segment)
    assert body.name == name
    # edges of 5 mm on an arc of 20 mm: chords leave h^2 / (12 R^2) of the cap's height, curved edges the square of that
    assert body.volume_mm3 == pytest.approx(exact, rel=1e-4)
    assert body.height_mm == pytest.approx(8.0, abs=1e-9)
    assert body.half_length_mm == pytest.approx(10.0, abs=1e-9)
    assert body.width_mm == pytest.approx(8.0, abs=1e-9)
    assert body.part_labels == ("core",)
    assert part_volume(body.mesh, 1) == pytest.approx(10.0 * 3.0 * 8.0, rel=1e-9)
    x, z = np.array([-7.3, 0.0, 4.1]), np.array([1.0, -2.0, 3.9])
    np.testing.assert_allclose(body.top(x, z), np.sqrt(RADIUS**2 - x**2) + MIDDLE, atol=0.01)
    assert np.isnan(body.top(np.array([10.5]), np.zeros(1)))[0]
    assert {label: len(f) > 0 for label, f in body.mesh.facets.items()} == {
        "contact": True, "base": True, "walls": True, "ends": False,
    }  # fmt: skip


def test_linear_cells_become_quadratic_with_straight_edges(tmp_path: Path) -> None:
    body = made(tmp_path, cube())
    assert body.mesh.element.is_quadratic
    assert body.volume_mm3 == pytest.approx(64.0, rel=1e-12)
    assert len(body.surface.faces) == 48
    assert body.top(np.array([0.3]), np.array([-1.0]))[0] == pytest.approx(4.0, abs=1e-12)
    assert body.part_labels == ()
    assert body.mirrors() == ()
    assert "STEP" in refused(body.solid)


def test_the_middle_of_the_base_becomes_the_origin(tmp_path: Path) -> None:
    mesh = cube()
    body = made(tmp_path, replace(mesh, points=mesh.points + [30.0, -7.0, 2.0]))
    np.testing.assert_allclose(body.mesh.points[body.mesh.vertices], mesh.points, atol=1e-12)
    assert (body.mesh.points[np.unique(body.mesh.facets["base"]), 1] == 0.0).all()


def test_parts_are_named(tmp_path: Path) -> None:
    mesh = cube()
    assert made(tmp_path, mesh, parts=["", "bone"]).part_labels == ("bone",)
    assert made(tmp_path, mesh, parts=["body", "bone", "skin"], numbers=True).part_labels == ("bone", "skin")
    assert made(tmp_path, mesh, parts=["silicone"]).part_labels == ()  # one name for all is no part of them


def test_edges_are_halved_where_shorter_ones_are_asked_for() -> None:
    body = given_mesh(GMSH / "binary.msh")
    kept, report = mesh_solid(body, MeshOptions(body.size_mm, body.base_size_mm), EVERYWHERE)
    assert kept is body.mesh
    assert report.cells == len(body.mesh.cells)
    near, _ = mesh_solid(body, MeshOptions(0.5 * body.size_mm, body.base_size_mm), (-2.0, 2.0, -4.0, 4.0))
    every, _ = mesh_solid(body, MeshOptions(0.5 * body.size_mm, 0.5 * body.base_size_mm), EVERYWHERE)
    assert len(body.mesh.cells) < len(near.cells) < len(every.cells)
    for finer in (near, every):
        assert curved_volume(finer) == pytest.approx(body.volume_mm3, rel=1e-12)
        assert set(np.unique(finer.part)) == {0, 1}
    coarser = MeshOptions(2.0 * body.size_mm, 2.0 * body.base_size_mm)
    assert f" {body.size_mm:g} mm" in refused(lambda: mesh_solid(body, coarser, EVERYWHERE))


def _with(mesh: Mesh, **facets: np.ndarray) -> Mesh:
    return replace(mesh, facets={**mesh.facets, **facets})


def _two_cubes() -> Mesh:
    one = cube(1)
    points = np.vstack([one.points, one.points + [9.0, 0.0, 0.0]])
    count = len(one.points)
    facets = {label: np.vstack([f, f + count]) for label, f in one.facets.items()}
    return Mesh(points, np.vstack([one.cells, one.cells + count]), facets)


def _without(label: str) -> Mesh:
    return replace(cube(), facets={key: f for key, f in cube().facets.items() if key != label})


def _inverted() -> Mesh:
    cells = cube().cells.copy()
    cells[6] = cells[6][[1, 0, 2, 3]]
    return replace(cube(), cells=cells)


def _tilted() -> Mesh:
    mesh = cube()
    return replace(mesh, points=mesh.points + np.outer(mesh.points[:, 0], [0.0, 0.1, 0.0]))


@pytest.mark.parametrize(
    ("mesh", "told"),
    [
        (_without("contact"), r"'contact' .*'label'.* 'base'"),
        (_without("base"), r"'base' .*'label'.* 'contact'"),
        (_inverted(), r"1 of 48 tetrahedra .* 7, near \("),
        (_two_cubes(), "2 bodies"),
        (_tilted(), r"y = -0\.2 to 0\.2 mm"),
        (replace(cube(), points=cube().points * [1.0, -1.0, -1.0]), "4 mm below .*'base'"),
        (replace(cube(), points=1e-3 * cube().points), r" 0\.2 to 5000 mm"),
        (_with(cube(), symmetry_x=cube().facets["base"]), "'symmetry_x'"),
        (_with(cube(), contact=cube().facets["base"]), "'base' and 'contact'|'contact' and 'base'"),
        (_with(cube(), contact=cube().cells[:1, :3] * 0 + [[0, 13, 26]]), r"facet \d+ .*'contact'"),
    ],
)
def test_a_mesh_that_is_no_finger_is_refused(mesh: Mesh, told: str, tmp_path: Path) -> None:
    assert re.search(told, refused(lambda: made(tmp_path, mesh)))


def test_a_mesh_comes_back(tmp_path: Path) -> None:
    mesh = given_mesh(GMSH / "binary.msh").mesh
    write_mesh_vtu(tmp_path / "again.vtu", mesh)
    back = given_mesh(tmp_path / "again.vtu").mesh
    np.testing.assert_array_equal(back.points, mesh.points)
    assert back.part_labels == mesh.part_labels
    np.testing.assert_array_equal(back.part, mesh.part)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    for label, facets in mesh.facets.items():
        assert {frozenset(f) for f in back.facets[label].tolist()} == {frozenset(f) for f in facets.tolist()}
