"""Options of a mold."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"wall_mm": 4.0}, "--wall-mm 4.0: .* 6.8"),
        ({"wall_mm": float("nan")}, "--wall-mm nan"),
        ({"clearance_mm": -0.1}, "--clearance-mm -0.1: .* 0"),
        ({"clearance_mm": 0.5}, "--clearance-mm 0.5: .* 0"),
        ({"shrinkage": 1.0}, "--shrinkage 1.0: "),
        ({"shrinkage": -0.01}, "--shrinkage -0.01"),
        ({"peg_mm": 0.0}, "--peg-mm 0.0"),
        ({"lid_mm": 0.5}, "--lid-mm 0.5"),
        ({"pour_mm": -1.0}, "--pour-mm -1.0"),
        ({"slot_gap_mm": 3.0}, "--slot-gap-mm 3.0"),
        ({"bed": "220x220"}, "--bed 220x220: "),
        ({"bed": "0x220x250"}, "--bed 0x220x250"),
    ],
)
def test_choices_that_make_no_mold(options, told) -> None:
    with pytest.raises(Finger3dError, match="^" + told.replace(".", r"\.")) as error:
        MoldOptions(**options)
    assert "\n" not in str(error.value)
