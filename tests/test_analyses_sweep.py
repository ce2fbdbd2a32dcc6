"""Sweeps: their points, rows, tables, folders and interruptions."""

from __future__ import annotations

import csv
import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import finger3d
from finger3d.analyses.sweep.points import Vary, checked_points, drawn, rows_of, varied
from finger3d.analyses.sweep.store import ResultStore
from finger3d.cli import main
from finger3d.errors import Finger3dError, MissingError
from finger3d.results.journal import Journal, Row
from tests.scenes import HALF_CYLINDER, written
from tests.sweep_cases import COARSE, SETS, lines, points_of, pressed_here, table


def test_every_combination_is_a_point_and_only_the_material_makes_bodies(paper_scene) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,0.25", "material.nu=0.45,0.49", "gauge.g36.angle_deg=10,20")
    assert [p.number for p in sweep.points] == list(range(8))
    assert sweep.points[1].values == {"friction.mu": 0.06, "material.nu": 0.45, "gauge.g36.angle_deg": 20}
    assert len(sweep.bodies) == 2


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("friction.mu=0.06, 0.25,1", (0.06, 0.25, 1)),
        ("model.domain=solid,plane-strain", ("solid", "plane-strain")),
        ("effects.viscosity.prony=[[0.3,0.5]],[[0.1,1.0],[0.2,2.0]]", ([[0.3, 0.5]], [[0.1, 1.0], [0.2, 2.0]])),
        ('title="a,b",c', ("a,b", "c")),
    ],
)
def test_values_are_told_apart_by_commas_outside_brackets_and_quotes(text, values) -> None:
    assert Vary.of(text).values == values


def test_a_varied_modulus_or_silicone_replaces_what_the_scene_gives(paper_scene) -> None:
    named = ["material.silicone=Dragon Skin 20"]
    moduli = checked_points(paper_scene, named, varied(["material.E_MPa=0.3,0.5"]))
    assert [p.values["material.E_MPa"] for p in moduli.points] == [0.3, 0.5]
    assert len(moduli.bodies) == 2
    silicones = checked_points(paper_scene, (), varied(['material.silicone="Ecoflex 00-30","dragon skin 20"']))
    assert len(silicones.bodies) == 2


RANGES = ("friction.mu=0.05:1", "press.depth_mm=0.2:0.6")


def values(sample: str, seed: int = 0) -> np.ndarray:
    return np.array([v.values for v in drawn(sample, RANGES, seed)])


def test_each_part_of_a_latin_hypercube_holds_one_sample_of_every_key() -> None:
    found = values("lhs:40")
    for column, (low, high) in zip(found, ((0.05, 1.0), (0.2, 0.6)), strict=True):
        part = np.floor(40 * (column - low) / (high - low)).astype(int)
        assert sorted(part) == list(range(40))
    # the keys are independent: among 40! orders one with a correlation above 0.6 does not occur
    assert abs(np.corrcoef(found)[0, 1]) < 0.6


def test_random_samples_lie_within_their_ranges_and_depend_on_the_seed() -> None:
    mu, depth = values("random:1000")
    assert 0.05 <= mu.min() < 0.06 < 0.99 < mu.max() <= 1.0
    assert mu.mean() == pytest.approx(0.525, abs=4.0 * 0.95 / np.sqrt(12.0 * 1000.0))
    assert 0.2 <= depth.min() < depth.max() <= 0.6
    np.testing.assert_array_equal(values("random:1000"), [mu, depth])
    assert not np.array_equal(values("random:1000", 1), [mu, depth])


@pytest.mark.parametrize(
    ("sample", "ranges", "seed", "expected"),
    [
        ("lhs", RANGES, 0, "--sample"),
        ("lhs:0", RANGES, 0, "--sample"),
        ("sobol:8", RANGES, 0, "lhs:NUMBER"),
        ("lhs:8", (), 0, "--range"),
        ("lhs:8", ("friction.mu=1:0.1",), 0, "--range"),
        ("lhs:8", ("friction.mu=0:inf",), 0, "--range"),
        ("lhs:8", RANGES, -1, "--seed -1"),
    ],
)
def test_samples_that_cannot_be_drawn_are_refused(sample, ranges, seed, expected) -> None:
    with pytest.raises(Finger3dError, match=expected):
        drawn(sample, ranges, seed)


def test_the_rows_of_a_table_are_points_in_their_order(paper_scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("\ufefffriction.mu, material.nu\n0.3,0.45\n\n0.1,0.49\n0.2,0.45\n", encoding="utf-8")
    sweep = checked_points(paper_scene, SETS, rows_of(path), "--points")
    assert [p.values for p in sweep.points] == [
        {"friction.mu": 0.3, "material.nu": 0.45},
        {"friction.mu": 0.1, "material.nu": 0.49},
        {"friction.mu": 0.2, "material.nu": 0.45},
    ]
    assert len(sweep.bodies) == 2
    path.write_text("Operator;Max\nfriction.mu;material.nu\n0,3;0,45\n0,1;0,49\n0,2;0,45\n", encoding="utf-16")
    assert checked_points(paper_scene, SETS, rows_of(path), "--points").points == sweep.points


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "line of names"),
        ("friction.mu,\n0.1,2\n", "line 2: has 2 cells"),
        ("friction.mu\n", "no row"),
        ("friction.mu\n0.1\n-2\n", "friction.mu = -2"),
        ("frictoin.mu\n0.1\n", "friction"),
        (None, "there is no such file"),
    ],
)
def test_a_bad_table_is_refused_in_one_line(text, expected, paper_scene, tmp_path, capsys) -> None:
    path = tmp_path / "points.csv"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    assert main(["sweep", str(paper_scene), "--points", str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "points" in line
    assert expected in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words", [[], ["--vary", "friction.mu=1", "--sample", "lhs:3"], ["--points", "a", "--sample", "b"]]
)
def test_points_are_given_in_one_way(words, paper_scene, tmp_path, capsys) -> None:
    assert main(["sweep", str(paper_scene), *words, "--out", str(tmp_path / "out")]) == 2
    assert "one of --vary, --points and --sample" in capsys.readouterr().err


def test_a_sampled_sweep_continues_and_its_page_shows_points(tmp_path: Path, monkeypatch, capsys) -> None:
    scene, out = written(tmp_path, HALF_CYLINDER), tmp_path / "out"
    words = ["sweep", str(scene), "--sample", "lhs:6", "--range", RANGES[0], "--range", RANGES[1], "--out", str(out)]
    assert main(words) == 0
    before = (out / "points.jsonl").read_text(encoding="utf-8")
    (out / "points.jsonl").write_text("".join(before.splitlines(keepends=True)[:4]), encoding="utf-8")
    assert main(words) == 0
    kept = lines(out)
    assert [row["point"] for row in kept] == list(range(6))
    assert [row["normal_force_N"] for row in kept[:4]] == [float(r["normal_force_N"]) for r in table(out)[:4]]
    mu = [float(row["friction.mu"]) for row in table(out)]
    np.testing.assert_array_equal(mu, drawn("lhs:6", RANGES, 0)[0].values)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "6 values from" in page
    assert '"joined": false' in page.replace('"joined":false', '"joined": false')
    capsys.readouterr()
    assert main([*words, "--seed", "1"]) == 2
    assert "another task" in capsys.readouterr().err


def test_python_takes_tables_samples_scenes_and_dicts(tmp_path: Path) -> None:
    path = written(tmp_path, HALF_CYLINDER)
    scene = finger3d.load(path, ["press.steps=2"])
    (tmp_path / "p.csv").write_text("friction.mu,press.depth_mm\n0.1,0.3\n0.3,0.5\n", encoding="utf-8")
    found = finger3d.sweep(dict(scene.given), tmp_path / "p.csv", tmp_path / "table")
    assert found.columns["friction.mu"] == [0.1, 0.3]
    assert found.columns["press.depth_mm"] == [0.3, 0.5]
    assert found.failed == 0
    drawn_ones = finger3d.sweep(scene, {"friction.mu": (0.1, 0.3)}, tmp_path / "lhs", sample="lhs:3", seed=5)
    assert len(drawn_ones.columns["point"]) == 3
    assert drawn_ones.failed == 0


def test_every_marker_of_a_grid_is_a_column(tmp_path: Path) -> None:
    path = written(tmp_path, HALF_CYLINDER + "[marker_grid]\nspacing_mm = 2.5\n")
    swept = finger3d.sweep(path, {"friction.mu": [0.25, 0.6]}, tmp_path / "out")
    markers = finger3d.press(path, error=False).to_dataframe("markers")
    last = markers[markers["step"] == markers["step"].max()]
    assert len(last) >= 3
    for _, marker in last.iterrows():
        for axis in "xyz":
            own = swept.columns[f"marker_{marker['marker']}_{axis}_mm"][0]
            assert own == pytest.approx(marker[f"displacement_{axis}_mm"], rel=1e-9, abs=1e-12)
    with (tmp_path / "out" / "marker_grid.csv").open(newline="") as file:
        places = {row["marker"]: [float(row[f"{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)}
    assert places == {m["marker"]: [m["x_mm"], m["y_mm"], m["z_mm"]] for _, m in last.iterrows()}


def test_a_dot_has_one_name_whatever_the_size_of_the_finger(tmp_path: Path) -> None:
    """Places are multiples of the spacing on a section whose half length is its radius."""
    path = written(tmp_path, HALF_CYLINDER + "[marker_grid]\nspacing_mm = 2.0\n")
    sweep = checked_points(path, ["gauge.0.y_mm=3.0"], varied(["finger.radius_mm=4,6", "marker_grid.spacing_mm=2,3"]))
    grids = [{m.name: m.x_mm for m in sweep.bodies[point.body].grid} for point in sweep.points]
    assert [[*grid.values()] for grid in grids] == [
        [-4.0, -2.0, 0.0, 2.0, 4.0],
        [-3.0, 0.0, 3.0],
        [-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0],
        [-6.0, -3.0, 0.0, 3.0, 6.0],
    ]
    assert len({(name, x) for grid in grids for name, x in grid.items()}) == 9  # names, and places
    assert len({name for grid in grids for name in grid}) == 9


def test_rows_become_a_table_in_the_scenes_own_names(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1", "contact.rule=projection,paper")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        for row in rows[:3]:
            kept.add(row)
        kept.lose(sweep.points[3], "its worker died")
        kept.write()
        assert kept.left() == [sweep.points[3]]
    found = pq.read_table(tmp_path / "results.parquet").to_pylist()
    assert [row["point"] for row in found] == [0, 1, 2, 3]
    assert found[2]["friction.mu"] == 1.0
    assert found[1]["contact.rule"] == "paper"
    assert found[0]["normal_force_N"] == rows[0]["normal_force_N"] > 0.0
    assert {"gauge_g36", "outcome", "residual", "seconds"} <= set(found[0])
    assert found[3]["outcome"] == "its worker died"
    assert found[3]["normal_force_N"] != found[3]["normal_force_N"]
    # the CSV keeps every digit
    assert float(table(tmp_path)[0]["normal_force_N"]) == rows[0]["normal_force_N"]


def test_a_sweep_of_one_body_needs_neither_dask_nor_matplotlib(paper_scene, tmp_path) -> None:
    code = "import sys; from finger3d.cli import main; main(sys.argv[1:]); "
    code += "sys.exit(repr({'matplotlib', 'distributed'} & set(sys.modules)))"
    words = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.1,0.2", "--out", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, timeout=120)
    assert done.stderr.splitlines()[-1] == "set()"
    assert 'class="chart"' in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_point_whose_row_is_written_at_an_interruption_is_counted(paper_scene, tmp_path, monkeypatch, capsys) -> None:
    append = Journal.append

    def interrupted(journal: Journal, row: Row) -> None:
        append(journal, row)
        if len(journal.rows) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "append", interrupted)
    words = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.1,0.2,0.3", "--out", str(tmp_path)]
    assert main(words) == 130
    assert "2 of 3 points" in capsys.readouterr().err
    assert len(lines(tmp_path)) == len(table(tmp_path)) == 2


def test_one_worker_is_this_process(paper_scene, tmp_path, monkeypatch) -> None:
    """It needs no shared memory, which a container may lack."""

    def none(*arguments: object) -> None:
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("finger3d.analyses.sweep.local._pool", none)
    vary = ["material.nu=0.3,0.4"]
    with pytest.raises(MissingError, match="Read-only file system; --workers 1 "):
        finger3d.sweep(paper_scene, vary, tmp_path, SETS, workers=2)
    assert finger3d.sweep(paper_scene, vary, tmp_path, SETS, workers=1).columns["point"] == [0, 1]


def test_a_torn_line_is_dropped_and_its_point_done_again(paper_scene, tmp_path) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        kept.add(rows[0])
    journal = tmp_path / "points.jsonl"
    whole = journal.read_text()
    journal.write_text(whole + json.dumps(rows[1])[:50])
    with ResultStore(sweep, tmp_path).open() as kept:
        assert kept.left() == [sweep.points[1]]
        kept.add(rows[1])
    assert lines(tmp_path) == rows


def test_a_journal_edited_by_hand_is_one_line(paper_scene, tmp_path, capsys) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    with ResultStore(sweep, tmp_path).open() as kept:
        for row in rows:
            kept.add(row)
    journal, before = tmp_path / "points.jsonl", (tmp_path / "points.jsonl").read_text()
    command = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)]
    edited = before.splitlines()[1].replace('"point": 1', '"point": 0')
    journal.write_text(before.splitlines()[0] + "\n" + edited + "\n")
    assert main(command) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert f"{journal}: line 2: " in err
    assert journal.read_text().splitlines()[1] == edited  # nothing is lost
    journal.unlink()
    journal.mkdir()
    assert main(command) == 2
    assert str(journal) in capsys.readouterr().err


def test_a_damaged_sweep_json_is_one_line(paper_scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(paper_scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    path = tmp_path / "sweep.json"
    whole = json.loads(path.read_text())
    vary = [5, {"friction.mu": 5}]
    texts = ["", "[]", "{}", "[" * 100_000, *(json.dumps({**whole, "vary": v}) for v in vary)]
    for data in [*(text.encode() for text in texts), b'{"vary": "\xe9"}']:
        path.write_bytes(data)
        for command in (
            ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,1", "--out", str(tmp_path)],
            ["show", str(tmp_path), "--png", str(tmp_path / "a.png")],
        ):
            assert main(command) == 2, data
            err = capsys.readouterr().err
            assert len(err.splitlines()) == 1, err
            assert str(tmp_path) in err
        assert path.read_bytes() == data


def test_a_damaged_table_is_one_line(tmp_path, capsys) -> None:
    (tmp_path / "sweep.json").write_text('{"vary": {"friction.mu": ["0.1", "0.2"]}}')
    (tmp_path / "results.csv").write_bytes(b"point\n\xe9")
    assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert str(tmp_path / "results.csv") in err


def test_a_folder_of_another_sweep_is_refused(paper_scene, tmp_path, capsys) -> None:
    with ResultStore(points_of(paper_scene, "friction.mu=0.06,1"), tmp_path).open():
        pass
    arguments = ["sweep", str(paper_scene), *COARSE, "--vary", "friction.mu=0.06,2", "--out", str(tmp_path)]
    assert main(arguments) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 1
    assert 'friction.mu is ["0.06", "1"]' in err


@pytest.mark.parametrize("name", ["points.jsonl", "results.parquet"])
def test_a_full_disk_is_one_line_that_says_what_is_kept(name, paper_scene, tmp_path, monkeypatch) -> None:
    sweep = points_of(paper_scene, "friction.mu=0.06,1")
    rows = pressed_here(sweep)
    kept = ResultStore(sweep, tmp_path)
    real = os.replace

    def full(source: object, target: object) -> None:
        if str(target).endswith(".parquet"):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(source, target)

    def fill() -> None:
        with kept.open():
            kept.add(rows[0])
            if name == "results.parquet":
                monkeypatch.setattr(os, "replace", full)
                kept.write()
            else:
                kept._journal.close()
                kept._journal._file = open("/dev/full", "ab", buffering=0)
                kept.add(rows[1])

    with pytest.raises(MissingError, match=r"; 1 of 2 points") as told:
        fill()
    assert name in str(told.value)
    with ResultStore(sweep, tmp_path).open() as again:
        assert again.left() == [sweep.points[1]]
