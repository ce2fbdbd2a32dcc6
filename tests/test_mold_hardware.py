"""Lengths of screws."""

from __future__ import annotations

from finger3d.mold.hardware import standard_length


def test_the_longest_screw_that_stays_inside_is_chosen() -> None:
    assert standard_length(43.6) == 40.0
    assert standard_length(45.0) == 45.0
    assert standard_length(3.0) == 6.0
