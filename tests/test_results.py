"""Files of results: the journal, states, summaries and fields."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from finger3d._machine import made_with
from finger3d.contact.zones import zone_area
from finger3d.errors import Finger3dError, MissingError
from finger3d.fem.mesh import Mesh, quadratic
from finger3d.results import journal
from finger3d.results.journal import Journal, Row, number_in, opened
from finger3d.results.states import load_states, write_vtu
from finger3d.results.summary import read_json
from tests.commands import loaded

TASK = {"scene": {"mu": 0.5}, "points": 3}


def rows_of(folder: Path, *more: Row, task: dict = TASK) -> list[Row]:
    """Open the journal, append rows, and return all of them."""
    with opened(folder / "rows.jsonl", folder / "task.json", task) as kept:
        for row in more:
            kept.append(row)
        return kept.rows


def test_the_same_task_continues_after_its_rows(tmp_path) -> None:
    assert rows_of(tmp_path, {"n": 0}, {"n": 1 / 3}) == [{"n": 0}, {"n": 1 / 3}]
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 1 / 3}, {"n": 2}]
    assert math.isnan(number_in(rows_of(tmp_path, {"n": math.nan})[-1], "n"))


def test_a_line_that_was_cut_short_is_removed(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    path = tmp_path / "rows.jsonl"
    path.write_text(path.read_text() + '{"n": 1, "na')
    assert rows_of(tmp_path, {"n": 2}) == [{"n": 0}, {"n": 2}]
    assert [json.loads(line)["n"] for line in path.read_text().splitlines()] == [0, 2]


def test_another_task_is_refused_and_its_rows_stay(tmp_path) -> None:
    rows_of(tmp_path, {"n": 0})
    with pytest.raises(Finger3dError, match="task"):
        rows_of(tmp_path, task={**TASK, "points": 4})
    (tmp_path / "task.json").unlink()
    with pytest.raises(Finger3dError, match=r"rows.jsonl .*task.json"):
        rows_of(tmp_path)
    assert [json.loads(line)["n"] for line in (tmp_path / "rows.jsonl").read_text().splitlines()] == [0]


@pytest.mark.parametrize(
    ("line", "edit"),
    [
        (2, lambda a, b, c: [a, "[1]\n", c]),
        (2, lambda a, b, c: [a, "[" * 100_000 + "\n", c]),
        (2, lambda a, b, c: [a, b.replace("0.25", "NaN"), c]),
        (2, lambda a, b, c: [a, b[:-9] + "\n", c]),
        (2, lambda a, b, c: [a, c, b]),
        (1, lambda a, b, c: [b, c]),
        (4, lambda a, b, c: [a, b, c, "\n"]),
    ],
)
def test_the_first_damaged_line_is_named_and_nothing_is_lost(line: int, edit: Callable, tmp_path) -> None:
    rows_of(tmp_path, {"n": 0}, {"n": 0.25}, {"n": 2, "x": [math.nan, None]})
    path = tmp_path / "rows.jsonl"
    before = path.read_text()
    path.write_text("".join(edit(*before.splitlines(keepends=True))))
    damaged = path.read_text()
    with pytest.raises(Finger3dError, match=rf"rows.jsonl: line {line}: .*remove it and all lines below"):
        rows_of(tmp_path)
    assert path.read_text() == damaged
    # as the message says
    path.write_text("".join(damaged.splitlines(keepends=True)[: line - 1]))
    assert [row["n"] for row in rows_of(tmp_path)] == [0, 0.25, 2][: line - 1]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"files": {"/finger.step": "2"}}, "/finger.step has changed since"),
        ({"files": {"/finger.step": "1", "/coin.stl": "1"}}, "/coin.stl has changed since"),
        ({"points": 4}, "another task;"),
    ],
)
def test_what_has_changed_is_named(changes: dict, said: str, tmp_path) -> None:
    task = {**TASK, "files": {"/finger.step": "1"}}
    rows_of(tmp_path, {"n": 0}, task=task)
    with pytest.raises(Finger3dError, match=said):
        rows_of(tmp_path, task={**task, **changes})


def test_rows_made_with_other_source_are_refused(tmp_path, monkeypatch) -> None:
    name = "the source of finger3d and its designs"
    rows_of(tmp_path, {"n": 0})
    monkeypatch.setattr(journal, "made_with", lambda: {**made_with(), name: "other"})
    with pytest.raises(Finger3dError, match=f"{name} has changed since"):
        rows_of(tmp_path)


def test_a_full_disk_is_an_error_of_the_row_that_does_not_fit() -> None:
    full = Journal(Path("/dev/full"), [])
    with pytest.raises(MissingError, match="/dev/full: No space left on device; make room"):
        full.append({"n": 0})
    assert not full.rows
    full.close()


def test_steps_hold_the_last_state_of_the_other_files(solid: Path) -> None:
    import pyvista

    states, grid = load_states(solid / "steps.npz"), pyvista.read(solid / "fields.vtu")
    with (solid / "contact.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert states.step.tolist() == [1, 2, 3, 4]
    assert np.allclose(states.target[:, 0], [0.125, 0.25, 0.375, 0.5])
    # single precision: 6e-8 of the largest value
    assert np.allclose(states.points, grid.points, atol=1e-5)
    assert np.allclose(states.displacement[-1], grid["displacement"], atol=1e-6)
    assert np.allclose(states.pressure[-1], [float(row["pressure_MPa"]) for row in table], atol=1e-6)
    assert [("open", "stick", "slip")[s] for s in states.status[-1]] == [row["status"] for row in table]
    assert np.array_equal(states.on_points("status", -1), grid["status"])


def test_every_kept_step_is_the_finger_at_that_depth(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    for k, (depth, *_) in enumerate(states.target):
        at = states.points[states.nodes] + states.displacement[k][states.nodes]
        # vertices that touch lie on the plane up to the weighting of the gap over their facets, h^2 / 8 R, twice
        touching = states.status[k] != 0
        assert touching.any()
        assert np.abs(at[touching, 1] - (5.0 - depth)).max() < 2 * 0.5**2 / (8 * 5.0)
        assert np.abs(states.gap[k][touching]).max() < 1e-6


def test_zones_of_kept_steps_have_the_areas_of_the_summary(solid: Path, section: Path) -> None:
    for folder in (solid, section):
        states, steps = load_states(folder / "steps.npz"), json.loads((folder / "summary.json").read_text())["steps"]
        facets = states.contact_facets[(states.contact_facets >= 0).all(axis=1)]
        corners = states.points[states.nodes][facets].astype(float)
        arms = corners[:, 1:] - corners[:, :1]
        width = np.ptp(load_states(solid / "steps.npz").points[:, 2])
        if states.dim == 3:
            area = 0.5 * np.linalg.norm(np.cross(arms[:, 0], arms[:, 1]), axis=1)
        else:
            area = width * np.linalg.norm(arms[:, 0], axis=1)
        for k, step in enumerate(states.step):
            for zone, name in zip(states.zones(k), ("contact", "stick"), strict=True):
                # single precision
                assert zone_area(facets, area, zone) == pytest.approx(steps[step - 1][f"{name}_area_mm2"], rel=1e-4)


def test_damaged_steps_are_one_line_that_names_the_file(section: Path, tmp_path: Path) -> None:
    """A checksum covers every array."""
    raw = (section / "steps.npz").read_bytes()
    with np.load(section / "steps.npz") as stored:
        arrays = dict(stored)
    turned, single = bytearray(raw), io.BytesIO()
    turned[len(raw) // 2] ^= 0xFF
    np.save(single, np.arange(3.0))
    cases = [b"", raw[: len(raw) // 2], raw[:-1], b"steps", b"\x80\x04N.", single.getvalue(), bytes(turned)]
    for name, a in arrays.items():
        others = {k: v for k, v in arrays.items() if k != name}
        changed = [] if name == "checksum" else [np.full(a.shape, "x"), a[..., None], a.astype(complex), a[:0]]
        for content in (others, *({**others, name: value} for value in changed)):
            stream = io.BytesIO()
            np.savez(stream, **content)
            cases.append(stream.getvalue())
    path = tmp_path / "steps.npz"
    for data in cases:
        path.write_bytes(data)
        with pytest.raises(Finger3dError, match="press") as refused:
            load_states(path)
        assert str(refused.value).startswith(f"{path}: ")
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("text", "told"), [("", "summary.json"), ("{", "summary.json"), ("[]", "JSON")])
def test_a_damaged_summary_is_refused(text: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text(text)
    with pytest.raises(Finger3dError, match=told) as error:
        read_json(tmp_path / "summary.json")
    assert str(tmp_path / "summary.json") in str(error.value)


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


def test_writing_loads_neither_vtk_nor_pyvista(tmp_path: Path) -> None:
    program = (
        "import numpy as np; from finger3d.results.states import write_vtu; from finger3d.fem.mesh import Mesh;"
        f"write_vtu({str(tmp_path / 'f.vtu')!r}, Mesh(np.eye(3)[:, :2], np.array([[0, 1, 2]]), {{}}), {{}})"
    )
    assert not loaded(program, "vtk", "vtkmodules", "pyvista", "matplotlib")
