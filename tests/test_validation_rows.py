"""Rows of a study: errors and verdicts."""

from __future__ import annotations

import ast
import string
import tomllib
from pathlib import Path

import pytest

from validation import _rows
from validation._rows import Row, grouped, listed

LISTS = {path.stem: tomllib.loads(path.read_text("utf-8")) for path in Path(_rows.__file__).parent.glob("*.toml")}


@pytest.mark.parametrize(
    ("measure", "wanted", "got", "error"),
    [
        ("relative", -2.0, -2.1, 0.05), ("absolute", 0.0, -0.2, 0.2), ("at most", 1.0, 0.5, 0.0),
        ("at most", 1.0, 1.2, 0.2), ("at least", 1.0, 1.5, 0.0), ("at least", 1.0, 0.7, 0.3),
    ],
)  # fmt: skip
def test_the_error_is_what_its_measure_says(measure: str, wanted: float, got: float, error: float) -> None:
    row = Row("w", "r", wanted, got, 0.1, "so", measure=measure)
    assert row.error == pytest.approx(error, abs=1e-12)
    assert row.passed == (error <= 0.1)


def test_nan_never_passes() -> None:
    for measure in ("relative", "absolute", "at most", "at least"):
        assert not Row("w", "r", 1.0, float("nan"), 1e9, "so", measure=measure).passed  # type: ignore[arg-type]


def test_a_statement_that_does_not_hold_fails_nothing() -> None:
    rows = [Row("w", "r", 79.0, got, 0.02, "about", "statement") for got in (79.5, 60.0, float("nan"))]
    assert [row.passed for row in rows] == [True, True, False]
    assert [row.verdict for row in rows] == ["holds", "does not hold", "FAIL"]


def asked(path: Path, function: str) -> list[tuple[str, set[str]]]:
    """Return the names of the listed rows that a file asks for, and the words it gives."""
    calls = [n for n in ast.walk(ast.parse(path.read_text("utf-8"))) if isinstance(n, ast.Call)]
    return [
        (ast.literal_eval(call.args[0]), {word.arg or "*" for word in call.keywords})
        for call in calls
        if ast.unparse(call.func) == function and call.args and isinstance(call.args[0], ast.Constant)
    ]


@pytest.mark.parametrize("name", [name for name, tables in LISTS.items() if "row" in tables])
def test_a_row_that_is_asked_for_is_listed_and_gets_the_words_of_its_texts(name: str) -> None:
    rows, home = LISTS[name]["row"], Path(_rows.__file__).parent
    files = home.glob("*.py") if name == "_paper" else [home / f"{name}.py"]
    found = [one for path in files for one in asked(path, "said" if name == "_paper" else "judged")]
    assert {key for key, _ in found} == set(rows)
    for key, words in found:
        texts = (rows[key][text] for text in ("what", "reference", "reason"))
        needed = {word for text in texts for _, word, _, _ in string.Formatter().parse(text) if word}
        assert "*" in words or needed <= words | {"wanted", "tolerance"}, key


def test_a_listed_row_takes_what_is_wanted_from_the_list_or_from_the_study(tmp_path: Path) -> None:
    text = '[row.force]\nwhat = "force, {name}"\nreference = "theory"\nwanted = 1.0\ntolerance = 0.1\nreason = "so"\n'
    (tmp_path / "study.toml").write_text(text + 'kind = "verification"\nmeasure = "relative"\n')
    judged = listed(str(tmp_path / "study.py"))
    assert judged("force", 1.05, name="a ball") == Row("force, a ball", "theory", 1.0, 1.05, 0.1, "so")
    assert judged("force", 1.05, 2.0, 0.5, name="a ball").wanted == 2.0


def test_lines_of_a_table_are_grouped_by_columns_among_those_that_are_meant() -> None:
    table = {"body": ["a", "b", "a", "a"], "nu": [0.3, 0.3, 0.5, 0.3], "x": [1, 2, 3, 4]}
    assert [(nu, t["x"].tolist()) for nu, t in grouped(table, "nu", body="a")] == [(0.3, [1, 4]), (0.5, [3])]
    assert [key for key, _ in grouped(table, "body", "nu")] == [("a", 0.3), ("b", 0.3), ("a", 0.5)]
