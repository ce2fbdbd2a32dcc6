"""Option --tolerance."""

from __future__ import annotations

import pytest

from finger3d.cli.tolerances import parsed_tolerances
from finger3d.errors import Finger3dError


def test_names_and_numbers_are_read_and_the_last_counts() -> None:
    assert parsed_tolerances(None) == {}
    assert parsed_tolerances(["depth_mm=0.05", " nu = 1e-3", "depth_mm=0.1"]) == {"depth_mm": 0.1, "nu": 1e-3}


@pytest.mark.parametrize("text", ["depth_mm", "depth_mm=", "depth_mm=a", "depth_mm=1=2"])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(Finger3dError, match=f"--tolerance {text}: .*NAME=NUMBER"):
        parsed_tolerances([text])
