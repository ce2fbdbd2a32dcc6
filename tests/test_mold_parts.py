"""Parts of a mold."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Gauge
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import THIN, foils, mold, overlaps
from finger3d.mold.shell import shell
from tests.mold_cases import GAUGES


def test_no_part_overlaps_another(paper_mold) -> None:
    """Faces that touch share no volume; 1e-6 of the cavity is what booleans leave."""
    shared = overlaps(paper_mold)
    assert len(shared) == 6
    assert max(shared.values()) <= 1e-6 * paper_mold.silicone_mm3


def test_block_minus_finger_minus_slots_is_the_cavity(paper_mold) -> None:
    """Volumes of both halves against the block's, in closed form where there is one."""
    low, high = paper_mold.outline
    block = float(np.prod(high - low))
    slots = sum(float((slot - paper_mold.body).volume) for slot in paper_mold.slots)
    pegs = sum(float(peg.volume) for peg in paper_mold.pegs)
    holes = sum(float(hole.volume) for hole in (*paper_mold.holes, *paper_mold.lid_holes))
    halves = paper_mold.parts["half_a"].volume + paper_mold.parts["half_b"].volume
    assert halves == pytest.approx(block - paper_mold.silicone_mm3 - slots + pegs - holes, rel=1e-6)
    assert block - halves - slots + pegs - holes == pytest.approx(paper_mold.silicone_mm3, rel=1e-6)
    meshed = sum(shell(paper_mold.parts[name], 0.02, name).surface.volume for name in ("half_a", "half_b"))
    assert block - meshed - slots + pegs - holes == pytest.approx(paper_mold.silicone_mm3, rel=1e-3)


def test_the_cavity_is_larger_by_the_shrinkage(paper_mold, paper_finger) -> None:
    assert paper_mold.silicone_mm3 == pytest.approx(paper_finger.volume_mm3 / (1.0 - 0.01) ** 3, rel=1e-9)
    sizes = paper_mold.body.bounding_box(optimal=True).size
    assert [sizes.X, sizes.Z] == pytest.approx([100.0 / 0.99, 20.0 / 0.99], rel=1e-6)


def test_every_slot_is_at_its_gauges_place_and_angle(paper_mold) -> None:
    """The strip's section: centre times the scale, the foil with its gaps along the gauge and across."""
    assert len(paper_mold.slots) == 2  # two gauges share a strip
    for slot, gauge, length in zip(paper_mold.slots, GAUGES, (5.0, 4.0), strict=False):
        np.testing.assert_allclose([*slot.center()][:2], gauge.middle[:2] / 0.99, rtol=1e-9)
        corners = np.array([[*v] for v in slot.vertices()]) - [*slot.center()]
        across = np.array([-gauge.direction[1], gauge.direction[0], 0.0])
        assert np.ptp(corners @ gauge.direction) == pytest.approx(length + 0.3, rel=1e-9)
        assert np.ptp(corners @ across) == pytest.approx(0.1 + 0.3, rel=1e-9)
    # and it is open through both walls: nothing of the halves is left in it
    for slot in paper_mold.slots:
        assert all(
            (slot & paper_mold.parts[name]) is None or (slot & paper_mold.parts[name]).volume == 0
            for name in paper_mold.parts
        )


def test_pegs_fit_with_the_clearance_and_only_one_way(paper_mold) -> None:
    from build123d import Pos, Rot

    for peg, hole in zip(
        (*paper_mold.pegs, *paper_mold.lid_pegs), (*paper_mold.holes, *paper_mold.lid_holes), strict=True
    ):
        radii = [max(face.radius or 0.0 for face in solid.faces()) for solid in (peg, hole)]
        assert radii[1] - radii[0] == pytest.approx(0.2, rel=1e-9)
    low, high = paper_mold.outline
    middle = 0.5 * (low + high)

    def turned(part, about):
        return Pos(*map(float, middle)) * Rot(*(180.0 * a for a in about)) * Pos(*map(float, -middle)) * part

    # half A upside down; lid turned end for end: a peg of full size meets the thin peg's hole
    thick = math.pi * 2.0**2 * 4.0 - math.pi * (2.0 * THIN + 0.2) ** 2 * 4.0
    for part, about in (("half_a", (0, 0, 1)), ("lid", (0, 1, 0))):
        shared = turned(paper_mold.parts[part], about) & paper_mold.parts["half_b"]
        assert shared.volume >= 0.9 * thick


@pytest.mark.parametrize(
    ("gauges", "options", "told"),
    [
        ((), {"split_mm": 10.0}, "split"),
        ((), {"pour_mm": 96.0}, "base"),
        ((), {"pour_mm": 24.0}, "--pour-mm 24: "),
        (GAUGES[:1], {"split": "x"}, "lock .* x"),
        (GAUGES[:1], {"foil_length_mm": 12.0}, 'gauge "g36": .* 12 x 3 x 0.1 mm'),
        ((Gauge("out", 60.0, 10.0),), {}, 'gauge "out": '),
        ((Gauge("edge", 0.0, 20.0, z_mm=9.5),), {}, 'gauge "edge": '),
        ((GAUGES[0], replace(GAUGES[0], name="near", y_mm=39.0)), {}, 'gauge "near": '),
    ],
)
def test_molds_that_cannot_be(gauges, options, told, paper_finger) -> None:
    chosen = MoldOptions(**options)
    with pytest.raises(Finger3dError, match=told) as error:
        mold(paper_finger.solid(), foils(gauges, chosen, None), chosen)
    assert "\n" not in str(error.value)
