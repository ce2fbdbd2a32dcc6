"""CSV files of spreadsheets, loggers and testing machines are read, or refused for what is wrong with them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from finger3d.csv_table import read_table
from finger3d.errors import Finger3dError

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
