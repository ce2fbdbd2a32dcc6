"""Whether 2D would have done: deviations, their error bars, and the width at which they cross a limit."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from finger3d.analyses.compare.verdict import (
    Deviation,
    crossing_width,
    deviation,
    force_deviation,
    numbers_table,
    rounded,
    verdict,
)
from finger3d.errors import Outcome
from finger3d.mechanics.readings.columns import strain_columns
from finger3d.results.comparison import FORCE, Case
from tests.comparison_cases import case


def test_the_width_is_interpolated_in_one_over_width() -> None:
    # deviation = 40/width exactly: 5 % at 800
    found = [Deviation(w, 40.0 / w, 0.1 * 40.0 / w) for w in (200.0, 20.0, 1000.0)]
    at, low, high = crossing_width(found, narrow=False)
    assert at == pytest.approx(800.0)
    assert (low, high) == (pytest.approx(720.0), pytest.approx(880.0))


def test_narrow_enough_for_plane_stress_is_an_upper_width() -> None:
    found = [Deviation(w, -0.002 * w, 0.0) for w in (5.0, 20.0, 50.0)]
    assert crossing_width(found, narrow=True)[0] == pytest.approx(25.0)


def test_a_width_that_was_not_asked_for_is_not_made_up() -> None:
    assert crossing_width([Deviation(20.0, 0.7, 0.01), Deviation(200.0, 0.2, 0.01)], narrow=False) is None
    solids = [case("solid", w, f) for w, f in ((20.0, 10.0), (200.0, 15.0))]
    planes = [case("plane strain", w, 18.0) for w in (20.0, 200.0)]
    text = " ".join(verdict([*planes, *solids], 20.0, 50.0))
    assert re.search(r"\b5 % .*\+20 % .* 200 mm.* 800 mm", text)


def test_no_width_is_guessed_from_a_narrow_finger() -> None:
    cases = [case("solid", w, f) for w, f in ((20.0, 10.0), (50.0, 11.0))]
    cases += [case("plane strain", w, 18.0) for w in (20.0, 50.0)]
    assert "1/width" not in " ".join(verdict(cases, 20.0, 50.0))


def test_an_error_bar_that_leaves_the_widths_asked_says_on_which_side() -> None:
    forces = {"solid": (10.0, 10.4), "plane strain": (11.0, 10.8), "plane stress": (9.7, 9.0)}
    cases = [case(m, w, f, 0.15) for m, both in forces.items() for w, f in zip((20.0, 200.0), both, strict=True)]
    cases = [replace(c, mesher="ftetwild") for c in cases]
    text = " ".join(verdict(cases, 20.0, 50.0))
    assert re.search(r" from .* [\d.]+ mm \([^)]* [\d.]+ to [^)]*200\)", text)
    assert re.search(r"up to .* [\d.]+ mm \([^)]*20 to [\d.]+\)", text)


def test_within_everywhere_is_said_so() -> None:
    found = [case(m, w, 10.0 + 0.1 * (m == "plane strain")) for m in ("plane strain", "solid") for w in (20.0, 200.0)]
    assert re.search(r" within 5 % .*, 20 to 200 mm\.", " ".join(verdict(found, 20.0, 50.0)))


def test_a_deviation_carries_both_error_bars() -> None:
    d = deviation(case("plane strain", 20.0, 15.0, 0.15), case("solid", 20.0, 10.0, 0.2))
    assert (d.value, d.error) == (pytest.approx(0.5), pytest.approx(1.5 * (0.01**2 + 0.02**2) ** 0.5))


def test_on_swept_meshes_a_common_error_cancels() -> None:
    plane, solid = case("plane strain", 20.0, 15.0, 0.15), case("solid", 20.0, 10.0, 0.1)
    plane, solid = replace(plane, companion={FORCE: 15.3}), replace(solid, companion={FORCE: 10.2})
    # both change by 2 %, so the deviation does not: of the bar of two unrelated errors a quarter is kept
    apart = force_deviation(plane, replace(solid, mesher="ftetwild")).error
    assert force_deviation(plane, solid).error == pytest.approx(0.25 * apart, rel=1e-12)
    assert apart > 0.01


def test_a_deviation_within_its_error_bar_of_the_limit_is_not_significant() -> None:
    told = verdict([case("plane strain", 20.0, 10.52, 0.1), case("solid", 20.0, 10.0, 0.1)], 20.0, 50.0)[-1]
    assert "(+5.2 %)" in told


def test_an_object_that_twists_has_a_moment_that_no_section_has() -> None:
    solid = case("solid", 20.0, 10.0)
    solid.numbers["moment_y_Nmm_per_mm"] = 3.25
    for turns in (True, False):
        told = " ".join(verdict([case("plane strain", 20.0, 10.0), solid], 20.0, 50.0, turns))
        assert ("torsion" in told) == turns
        assert ("solid 3.25" in told) == turns


def test_the_numbers_of_the_models_are_a_table() -> None:
    cases = [
        replace(one, strains=strain_columns("g")[:1])
        for one in (case("plane strain", 20.0, 15.0, 0.2, gauge_g=0.01), case("solid", 20.0, 10.0, 0.1, gauge_g=0.02))
    ]
    head, force, *others = numbers_table([*cases, case("solid", 99.0, 1.0)], 20.0)
    assert head == ["", "solid", "plane strain"]
    assert force == ["normal force (N/mm)", "10.00 ± 0.10", "15.00 ± 0.20"]
    assert ["strain of gauge g", "0.02", "0.01"] in others
    assert numbers_table(cases, 50.0) == []


def test_without_a_solid_there_is_no_verdict() -> None:
    failed = Case("solid", 20.0, 2.0, "swept", Outcome.NO_CONVERGENCE)
    text = verdict([case("plane strain", 20.0, 10.0), failed], 20.0, 50.0)
    assert str(Outcome.NO_CONVERGENCE) in text[0]
    assert len(text) == 2
    assert "%" not in text[-1]


@pytest.mark.parametrize(("value", "text"), [(123.4, "120"), (8.16e2, "820"), (0.0567, "0.057")])
def test_rounded_numbers_have_no_exponent(value, text) -> None:
    assert rounded(value) == text
