"""Files that are written whole or not at all, tables of others, and ranges of numbers."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import subprocess
import sys
import typing
from pathlib import Path
from typing import Any

import annotated_types as at
import numpy as np
import pytest

from finger3d._ranges import Modulus, at_least, at_most
from finger3d.cli import main
from finger3d.csv_table import read_table
from finger3d.effects import effect_names, effect_type
from finger3d.errors import Finger3dError, Outcome
from finger3d.geometry.design import designs
from finger3d.io import atomic, claimed, holds, write_csv, write_json
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.objects import OBJECTS
from finger3d.scene import parse
from finger3d.scene.tables import (
    FrictionTable,
    GaugeTable,
    LegTable,
    MaterialTable,
    MeshTable,
    PressTable,
    TomlTable,
    table_of,
)


def test_csv_keeps_every_digit(tmp_path: Path) -> None:
    x = np.array([0.1, 1 / 3, 1e-300, -2.5e17])
    write_csv(tmp_path / "t.csv", {"x_mm": x, "status": np.array(["open", "stick", "slip", "a,b"]), "n": np.arange(4)})
    with (tmp_path / "t.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(r["x_mm"]) for r in rows] == x.tolist()
    assert [r["status"] for r in rows] == ["open", "stick", "slip", "a,b"]
    assert [r["n"] for r in rows] == ["0", "1", "2", "3"]


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


def test_what_a_killed_process_has_left_is_removed_by_the_next_run(tmp_path: Path) -> None:
    """A process that is killed while it writes, as by kill -9, cannot tidy up."""
    program = (
        "import os, signal, sys; from finger3d.io import atomic\n"
        "blocks = [atomic(name) for name in sys.argv[1:]]\n"
        "for block in blocks: block.__enter__().write_text('half')\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    mine = [tmp_path / "out" / name for name in ("report[1].html", "fields.vtu")]
    subprocess.run([sys.executable, "-c", program, *mine], check=False, cwd=Path(__file__).parent.parent)
    (tmp_path / "out" / ".vimrc").write_text("")
    assert len(list((tmp_path / "out").iterdir())) == 3
    # another process may be writing the same file now: only what is old goes
    write_json(mine[0], {})
    (half,) = (tmp_path / "out").glob(".report*")
    os.utime(half, (0, 0))
    write_json(mine[0], {})
    assert not list((tmp_path / "out").glob(".report*"))
    with claimed(tmp_path / "out"):
        assert {p.name for p in (tmp_path / "out").iterdir()} == {".finger3d.lock", ".vimrc", "report[1].html"}


def test_links_that_lead_in_a_circle_hold_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    (tmp_path / "scene.toml").write_text("")
    (tmp_path / "link.toml").symlink_to("scene.toml")
    assert holds(tmp_path, ["x", "scene.toml"], tmp_path / "link.toml")
    assert not holds(tmp_path / "a", ["scene.toml"], tmp_path / "scene.toml")


def test_a_folder_that_cannot_be_written_is_a_users_mistake(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(Finger3dError, match=r"file/s\.json: ") as caught:
        write_json(tmp_path / "file" / "s.json", {})
    assert "\n" not in str(caught.value)


def test_a_folder_with_the_results_of_another_command_is_refused(tmp_path: Path) -> None:
    (tmp_path / "identify.json").touch()
    with claimed(tmp_path, "identify"):
        pass
    with pytest.raises(Finger3dError, match="identify"), claimed(tmp_path, "press"):
        pass


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


NAMES = ("depth_mm", "force_N")


def table(tmp_path: Path, content: str | bytes) -> tuple[list[float], list[float]]:
    path = tmp_path / "bench.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    found = read_table(path, NAMES.__contains__).numbers(NAMES)
    return found["depth_mm"].tolist(), found["force_N"].tolist()


PLAIN = "depth_mm,force_N\n0.5,1.25\n1,-2e-3\n"
COMMAS = "depth_mm;force_N\n0,5;1,25\n1;-2e-3\n"


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace(",", " , ").replace("\n", ",,\n"),
        PLAIN.replace("1.25", '"1.25"') + ",\n",
        COMMAS,
        COMMAS.replace(";", "\t"),
        'depth_mm,force_N\n"0,5","1,25"\n1,-2e-3\n',
        "sep=;\n" + COMMAS,
        "sep=|\n" + COMMAS.replace(";", "|"),
        "# bench 3\n\n" + PLAIN.replace("1,-2", "% a pause, 3\n1,-2"),
        "# " + PLAIN,
        "Operator;M\u00fcller\nSpeed;0,1;mm/s\nZero;step\n\n" + COMMAS,
        "time,force_N,note,depth_mm\n10:00,1.25,a,0.5\n10:01,-2e-3,,1\n",
        "\ufeff" + PLAIN,
        PLAIN.encode("utf-16"),
        b"\xfe\xff" + PLAIN.encode("utf-16-be"),
        PLAIN.replace("\n", ",Temp_\u00b0C\n", 1).replace("25\n", "25,20\n").replace("-3", "-3,20").encode("latin-1"),
        ("\u529b,\u4f4d\u79fb,\u538b\n" + PLAIN).encode("gb18030"),
        "depth_mm,force_N\n0.500,1.250\n1.000,-0.002\n",
        "depth_mm;force_N\n0,500;1,250\n1,000;-0,002\n",
    ],
)
def test_forms_of_one_table(tmp_path: Path, content: str | bytes) -> None:
    assert table(tmp_path, content) == ([0.5, 1.0], [1.25, -2e-3])


@pytest.mark.parametrize(
    "text", ["force_N\n1.25\n", "force_N\n1,25\n", '"force_N"\n"1,25"\n', "sep=,\nforce_N\n1.25\n"]
)
def test_the_comma_of_a_single_column_is_decimal(tmp_path: Path, text: str) -> None:
    path = tmp_path / "bench.csv"
    path.write_text(text)
    np.testing.assert_array_equal(read_table(path, NAMES.__contains__).numbers(["force_N"])["force_N"], [1.25])


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("depth_mm;force_N\n1;1,250\n2;2,500\n", r"line 2: force_N = '1,250': may be 1\.250 or 1250"),
        ("depth_mm;force_N\n0,5;1,25\n1.5;2,5\n", "'0,5': has a comma, and line 3: depth_mm = '1.5' has a point"),
        ("depth_mm;force_N\n1;1.299,5\n", r"line 2: force_N = '1\.299,5': .*thousands"),
        ("depth_mm,force_N\n0,5,1,25\n", "line 2: has 4 cells, and there are 2 columns"),
        ("depth_mm,force_N\n\n0.5\n", "line 3: has 1 cells"),
        ("# bench\ndepth_mm,force_N\n0.5,\n", "line 3: force_N is empty"),
        ("depth_mm,force_N\n(mm),(N)\n0.5,1\n", r"line 2: depth_mm = '\(mm\)': must be a finite number"),
        ("depth_mm,force_N\n1,inf\n", "line 2: force_N = 'inf'"),
        ("depth_mm,force_N\n1,1_000\n", "line 2: force_N = '1_000'"),
        ("depth_mm,force_N\n1,1e999\n", "line 2: force_N = '1e999'"),
        ("depth_mm,force_N,force_N\n1,2,3\n", 'two columns are called "force_N"'),
        ('depth_mm,force_N\n1,"2\n', "line 2: unexpected end of data"),
        ("depth_mm,force_N\n1," + "1" * 200_000, "line 2: field larger than"),
        (PLAIN.encode("utf-16")[:-1], "cut within a character of UTF-16"),
        (b"PK\x03\x04\x00\x00", "zero bytes"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, content: str | bytes, told: str) -> None:
    with pytest.raises(Finger3dError, match=told) as found:
        table(tmp_path, content)
    assert re.fullmatch(r".*bench\.csv: .*", str(found.value))


def test_a_file_that_cannot_be_opened(tmp_path: Path) -> None:
    for path, told in ((tmp_path / "none.csv", "there is no such file"), (tmp_path, "cannot be read: ")):
        with pytest.raises(Finger3dError, match=told):
            read_table(path, NAMES.__contains__)


OF_DESIGNS = [table_of(design) for design in designs().values()]
OF_EFFECTS = [table_of(effect_type(name)) for name in effect_names()]
TABLES: list[type[TomlTable]] = [
    *OF_DESIGNS, *OF_EFFECTS, *map(table_of, OBJECTS.values()),
    FrictionTable, GaugeTable, LegTable, MaterialTable, MeshTable, PressTable,
]  # fmt: skip


def numbers(hint: Any) -> list[tuple[bool, bool]]:
    """Whether every number in a type has a lower and an upper bound."""
    if typing.get_origin(hint) is typing.Annotated:
        kind, *bounds = typing.get_args(hint)
        if kind in (float, int):
            return [tuple(any(isinstance(b, kinds) for b in bounds) for kinds in ((at.Ge, at.Gt), (at.Le, at.Lt)))]
        return numbers(kind)
    if hint in (float, int):
        return [(False, False)]
    return [found for part in typing.get_args(hint) for found in numbers(part)]


def test_every_number_has_a_range() -> None:
    for table in TABLES:
        for name, hint in typing.get_type_hints(table, include_extras=True).items():
            if name != "model_config":
                assert all(low and high for low, high in numbers(hint)), (table, name)


SCENE: dict[str, Any] = {
    "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
    "material": {"E_MPa": 1.0, "nu": 0.49},
    "friction": {"mu": 0.3},
    "press": {"leg": ({"depth_mm": 1.0, "steps": 2, "duration_s": 1.0}, {"depth_mm": 1.0, "slide_x_mm": 0.1, "steps": 1,
                                                                         "duration_s": 1.0})},
    "mesh": {"size_mm": 1.0, "base_size_mm": 2.0, "mesher": "swept"},
    "gauge": ({"name": "g", "x_mm": 1.0, "y_mm": 3.0, "length_mm": 1.0},),
}  # fmt: skip


def scaled(E: float, domain: str, effect: str | None) -> tuple[Any, Any]:
    """Forces over E and gauge strains of a press with all moduli multiplied by E."""
    settings: dict[str, Any] = {
        "viscosity": {"prony": ((0.3, 0.5),), "bulk": False},
        "elastic_object": {"E_MPa": 2.0 * E, "nu": 0.5},
        "embedded_gauge": {"E_MPa": 2.0 * E, "thickness_mm": 0.02, "width_mm": 2.0},
        "large_deformation": {},
    }
    on = {} if effect is None else {"effects": {effect: settings[effect]}}
    tree = {**SCENE, **on, "material": {"E_MPa": E, "nu": 0.49}, "model": {"domain": domain}}
    frames = list(march(build(parse(tree).model())))
    assert all(frame.outcome.ok for frame in frames)
    return np.stack([f.state.force for f in frames]) / E, np.array([f.gauges["g"] for f in frames])


@pytest.mark.parametrize(
    ("domain", "effect"),
    [
        ("plane-strain", None), ("plane-strain", "viscosity"), ("plane-strain", "elastic_object"),
        ("plane-strain", "embedded_gauge"), ("plane-strain", "large_deformation"), ("solid", None),
    ],
)  # fmt: skip
def test_forces_are_proportional_to_the_modulus_from_end_to_end(domain: str, effect: str | None) -> None:
    # powers of four, of which square roots too are exact, so that the same digits are computed at every modulus: any
    # difference is an absolute tolerance; the moduli of effects are twice that of the finger
    _, low, high = typing.get_args(Modulus)
    force, strain = scaled(1.0, domain, effect)
    assert np.abs(force).max() > 0.0
    for E in (4.0 ** math.ceil(math.log(low.ge, 4)), 4.0 ** math.floor(math.log(0.5 * high.le, 4))):
        found = scaled(E, domain, effect)
        assert (found[0] == force).all()
        assert (found[1] == strain).all()


@pytest.mark.parametrize(
    "override",
    [
        "material.E_MPa=1e200", "material.E_MPa=5e-324", "press.duration_s=1e300", "press.slide_x_mm=600.0",
        "effects.viscosity={prony=[[1e308, 1.0]]}", "mesh.size_mm=1e-300", "friction.mu=1e308",
        "press.steps=100000000", "object.x_mm=1e300", "press.depth_mm=1e-300",
    ],
)  # fmt: skip
def test_an_absurd_number_is_refused_in_one_line(override, tmp_path, capsys) -> None:
    path = tmp_path / "scene.toml"
    tree = {**SCENE, "press": {"depth_mm": 1.0}, "object": {"shape": "sphere", "radius_mm": 20.0},
            "model": {"domain": "plane-strain"}}  # fmt: skip
    from finger3d.scene.tree import written

    path.write_text(written(tree), encoding="utf-8")
    assert main(["press", str(path), "--set", override, "--out", str(tmp_path / "out")]) == 2
    out_text, err = capsys.readouterr()
    assert len(err.splitlines()) == 1
    assert override.split("=")[0].split(".")[-1] in err
    assert out_text == ""


@pytest.mark.parametrize("value", [49.99745962, 1e-7 / 3, 123456.78])
def test_a_bound_holds_as_it_is_printed(value: float) -> None:
    # six digits: the printed bound is within 1e-5 of the exact one, on its inner side
    assert value * (1 - 1e-5) <= float(at_most(value)) <= value
    assert value <= float(at_least(value)) <= value * (1 + 1e-5)
    assert float(at_most(-value)) <= -value <= float(at_least(-value))


def test_a_size_as_large_as_the_refusal_allows_is_taken() -> None:
    finger = {"geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
              "width_mm": 80.0}  # fmt: skip
    tree = {**SCENE, "finger": finger, "gauge": (), "model": {"domain": "plane-strain"}}
    with pytest.raises(Finger3dError) as refused:
        parse({**tree, "mesh": {"size_mm": 60.0, "mesher": "swept"}})
    told = float(str(refused.value).split("at most ")[1].split(",")[0])
    assert parse({**tree, "mesh": {"size_mm": told, "mesher": "swept"}}).mesh.size_mm == told
