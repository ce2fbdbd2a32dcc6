"""Options of a mold, and lengths of screws."""

from __future__ import annotations

import pytest

from finger3d.errors import Finger3dError
from finger3d.mold.options import MoldOptions, standard_length


def test_the_longest_screw_that_stays_inside_is_chosen() -> None:
    assert standard_length(43.6) == 40.0
    assert standard_length(45.0) == 45.0
    assert standard_length(3.0) == 6.0


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"wall_mm": 4.0}, "--wall-mm 4.0 .* 6.8"),
        ({"wall_mm": float("nan")}, "--wall-mm nan"),
        ({"clearance_mm": -0.1}, "--clearance-mm -0.1"),
        ({"clearance_mm": 0.5}, "--clearance-mm 0.5"),
        ({"shrinkage": 1.0}, "--shrinkage 1.0"),
        ({"shrinkage": -0.01}, "--shrinkage -0.01"),
        ({"peg_mm": 0.0}, "--peg-mm 0.0"),
        ({"lid_mm": 0.5}, "--lid-mm 0.5"),
        ({"pour_mm": -1.0}, "--pour-mm -1.0"),
        ({"wall_mm": 1e6}, "--wall-mm 1000000.0 .* at most 200"),
        ({"lid_mm": 1e4}, "--lid-mm 10000.0 .* at most 100"),
        ({"peg_mm": 100.0}, "--peg-mm 100.0 .* at most 50"),
        ({"printer": "laser"}, "--printer laser"),
        ({"screw": "M7"}, "--screw M7"),
        ({"pour_order": "core"}, "--pour-order core .* --parts"),
    ],
)
def test_choices_that_make_no_mold(options, told) -> None:
    with pytest.raises(Finger3dError) as error:
        MoldOptions(**options)
    head, _, tail = told.partition(" .* ")
    assert str(error.value).startswith(head)
    assert tail in str(error.value)
    assert "\n" not in str(error.value)


def test_a_preset_sets_what_is_not_given() -> None:
    sla = MoldOptions(printer="sla")
    assert (sla.gap_mm, sla.rim_mm) == (0.1, 1.0)
    assert sla.machine.tolerance_mm < MoldOptions().machine.tolerance_mm
    assert MoldOptions(printer="sla", clearance_mm=0.15).gap_mm == 0.15
    # a peg of 10 mm and a gap on either side, a rim on either side
    assert MoldOptions(printer="sla", peg_mm=10.0).around_mm == pytest.approx(2 * 1.0 + 10.2)
