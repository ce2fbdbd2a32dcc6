"""The fit of a response to measured values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from finger3d.analyses.identify.fit import Scale, fit


def test_a_fit_takes_the_steps_of_the_linear_problem_and_stays_within_the_bounds() -> None:
    """The minimum of (a - 0.8)^2 + 100 (b + 0.2 - a^2)^2 with b at most 0.3 is found in a few presses."""
    scales, tried = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 0.3)], list[Any]()

    def residuals(values: Any) -> Any:
        tried.append(values)
        return 1e3 * np.array([values[0] - 0.8, 10.0 * (values[1] + 0.2 - values[0] ** 2)])

    shares = fit(scales, np.array([0.1, 0.5]), residuals, lambda _: None)
    # with b = 0.3, (a - 0.8) - 200 a (0.5 - a^2) = 0
    (a,) = [r.real for r in np.roots([200.0, 0.0, -99.0, -0.8]) if r.real > 0.5]
    assert shares == pytest.approx([a, 1.0], abs=1e-3)  # the last step lowers the sum by less than a thousandth
    assert len(tried) < 30


def test_a_fit_leaves_what_the_data_do_not_determine() -> None:
    scales, seen = [Scale("a", 0.0, 1.0), Scale("b", 0.0, 1.0)], np.array([[100.0, 0.0]])
    shares = fit(scales, np.array([0.1, 0.6]), lambda v: seen @ v - 90.0, lambda _: None)
    assert shares == pytest.approx([0.9, 0.6], abs=1e-3)
