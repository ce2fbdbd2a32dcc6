"""Places of the cavity, walls and pegs."""

from __future__ import annotations

import numpy as np

from finger3d.mold.layout import layout_of
from finger3d.mold.options import MoldOptions

LOW, HIGH = np.array([-20.0, 0.0, -10.0]), np.array([20.0, 30.0, 10.0])


def test_walls_surround_the_cavity() -> None:
    o = MoldOptions()
    at = layout_of(LOW, HIGH, o)
    wall = o.around_mm
    np.testing.assert_allclose(at.outer_low, [-20.0 - wall, 0.0, -10.0 - wall])
    np.testing.assert_allclose(at.outer_high, [20.0 + wall, 30.0 + wall, 10.0 + wall])
    assert len(at.rows) == 2


def test_a_low_finger_has_one_row_of_pegs_above_those_of_the_lid() -> None:
    o = MoldOptions()
    (row,) = layout_of(LOW, np.array([20.0, 3.0, 10.0]), o).rows
    assert row - o.peg_hole_mm / 2.0 >= o.hole_depth_mm + o.rim_mm - 1e-9
