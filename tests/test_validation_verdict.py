"""The verdict on the paper's claims: every cell comes from rows of a study, and the pages say what the rows say."""

from __future__ import annotations

import pytest

from validation import _verdict
from validation._rows import Row
from validation._runner import kept_rows, studies

STUDIES = studies()
HOME = next(iter(STUDIES.values())).path.parent
KEPT = {name: kept_rows(HOME, study) for name, study in STUDIES.items()}


def row(got: float, wanted: float = 1.0, measure: str = "at most", what: str = "w") -> Row:
    return Row(what, "Maeno 2004, Fig. 7", wanted, got, 0.1, "so", "statement", measure)  # type: ignore[arg-type]


@pytest.mark.parametrize(("got", "told"), [((0.5, 1.05), "holds"), ((0.5, 1.2), "holds partly"), ((1.2, 2.0), "fails")])
def test_a_claim_holds_if_all_of_its_rows_do(got: tuple[float, ...], told: str) -> None:
    assert _verdict.verdict([row(value) for value in got]) == told


def test_a_cell_has_the_verdict_the_range_of_its_numbers_and_its_figure() -> None:
    claim = _verdict.Claim(
        "A", "Fig. 1", "m", {_verdict.STRESS: ("study", "^f.*nu = 0.4"), _verdict.WIDE: ("none", "")}
    )
    rows = (row(2.0, 4.0, "relative", "f, nu = 0.45"), row(4.2, 4.0, "relative", "f, nu = 0.49"), row(9.0, what="g"))
    assert claim.found(_verdict.STRESS, {"study": rows}) == list(rows[:2])
    cell = _verdict._cell(claim, _verdict.STRESS, {"study": rows}, "figures")
    assert cell == "**holds partly**: [0.5 to 1.05](figures/study.png)"
    assert _verdict._cell(claim, _verdict.STRAIN, {"study": rows}, "figures") == "–"


def test_every_cell_is_made_from_rows_of_a_study_with_a_figure() -> None:
    for claim in _verdict.CLAIMS:
        for column, (study, *_) in claim.rows.items():
            found = claim.found(column, KEPT)
            assert found, f"{study}: no row for {claim.text!r}, {column}"
            assert {r.measure for r in found} == {found[0].measure}
            assert (HOME / "figures" / f"{claim.figure(column)}.png").is_file()
            # a pattern that finds rows of two models would mix columns
            assert len({"large deformation" in r.what for r in found}) == 1


def test_the_table_is_the_first_in_the_index_and_each_claim_a_row_of_it() -> None:
    text = (HOME / "README.md").read_text(encoding="utf-8")
    first = text[text.index("\n| ") + 1 :].split("\n\n", 1)[0].splitlines()
    assert first == _verdict.lines(KEPT, "figures")
    assert len(first) == len(_verdict.CLAIMS) + 2
    assert _verdict.summary(KEPT) in text
