"""Error bars by name."""

from __future__ import annotations

import math

import pytest

from finger3d.accuracy.error_bars import ErrorBars, with_error


def test_an_error_bar_is_the_sum_of_both_errors() -> None:
    bars = ErrorBars(discretisation={"normal_force_N": 0.3, "gauge_g": 0.1}, steps={"normal_force_N": 0.2})
    assert bars.totals() == {"normal_force_N": 0.5, "gauge_g": 0.1}
    assert bars.total("friction_sum_N") is None
    assert ErrorBars.of_summary({"error_estimate": bars.as_dict()}) == bars
    assert ErrorBars.of_summary({"error_estimate": None}).totals() == {}


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (304.36368, 1.9, "304.4 ± 1.9"),
        (304.4123, 12.3, "304 ± 12"),
        (1234.5, 234.5, "1230 ± 230"),
        (0.0324, 0.00331, "0.0324 ± 0.0033"),
        (1.0, 9.99e-3, "1.0000 ± 0.0100"),
        (3.4e-8, 1e-9, "(3.40 ± 0.10) 1e-8"),
        (304.36368, None, "304.36"),
        (304.36368, math.nan, "304.36"),
        (3.0, 0.0, "3 ± 0"),
        (math.nan, 0.1, "nan"),
    ],
)
def test_a_number_and_its_error_end_at_the_second_digit_of_the_error(
    value: float, error: float | None, text: str
) -> None:
    assert with_error(value, error) == text


def test_digits_and_sign_are_chosen() -> None:
    assert with_error(0.034024128, digits=3) == "0.034"
    # where all sticks, an error may be a millionth of a millionth of a number above 1
    assert with_error(5.0, 1e-8) == "5.000000000 ± 0.000000010"
    assert with_error(0.5, 1e-9) == "(5.000000000 ± 0.000000010) 1e-1"
    assert with_error(2.0, 1e-300) == "2 ± 0"
    assert with_error(2.0, 0.5, sign="+-") == "2.00 +- 0.50"
