"""Parts of a mold."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.mechanics.model import Gauge
from finger3d.mold.body import shell
from finger3d.mold.fasteners import THIN, half_pegs, lid_pegs
from finger3d.mold.foils import foils
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import mold, overlaps
from finger3d.mold.solids import common
from tests.mold_cases import GAUGES, made


def test_no_part_overlaps_another(paper_mold) -> None:
    """Faces that touch share no volume; 1e-6 of the cavity is what booleans leave."""
    shared = overlaps(paper_mold)
    assert {"half_a, half_b", "half_a, lid", "half_a, sensor", "lid, sensor"} <= set(shared)
    assert max(shared.values()) <= 1e-6 * paper_mold.silicone_mm3


def test_block_minus_finger_is_the_cavity() -> None:
    """Volumes of both halves without screws against the block's, in closed form."""
    found = made("half_cylinder", {"screw": "none", "shrinkage": 0.01})
    block = float(np.prod(found.layout.outer_high - found.layout.outer_low))
    between, lid = half_pegs(found.layout, found.options), lid_pegs(found.layout, found.options)
    pegs = sum(float(peg.volume) for peg in between.add["half_b"])
    holes = sum(float(hole.volume) for hole in (*between.cut["half_a"], *lid.cut["half_a"]))
    halves = found.parts["half_a"].volume + found.parts["half_b"].volume
    assert halves == pytest.approx(block - found.silicone_mm3 + pegs - holes, rel=1e-6)
    meshed = sum(shell(found.parts[name], 0.02, name).surface.volume for name in ("half_a", "half_b"))
    assert block - meshed + pegs - holes == pytest.approx(found.silicone_mm3, rel=5e-3)


def test_the_cavity_is_larger_by_the_shrinkage(paper_mold, paper_finger) -> None:
    assert paper_mold.silicone_mm3 == pytest.approx(paper_finger.volume_mm3 / (1.0 - 0.01) ** 3, rel=1e-9)
    low, high = paper_mold.body.box
    assert list((high - low)[[0, 2]]) == pytest.approx([100.0 / 0.99, 20.0 / 0.99], rel=1e-6)


def test_a_mold_of_triangles_is_that_of_cad(molds) -> None:
    """The same halves, but for chords of 0.1 mm on the arc: their area is some percent of 91 ml's surface."""
    found, exact = molds["triangles"], made("clipped_cylinder", {})
    assert list(found.parts) == list(exact.parts)
    for name in ("half_a", "half_b"):
        volumes = found.shell(name, 0.05, 0.2).surface.volume, exact.parts[name].volume
        assert volumes[0] == pytest.approx(volumes[1], rel=2e-3)


def test_parts_fit_only_one_way(paper_mold) -> None:
    from build123d import Pos, Rot

    middle = 0.5 * (paper_mold.layout.outer_low + paper_mold.layout.outer_high)

    def turned(part, about):
        return Pos(*map(float, middle)) * Rot(*(180.0 * a for a in about)) * Pos(*map(float, -middle)) * part

    # half A upside down; lid turned end for end: a peg of full size meets the thin peg's hole. The chamfer of the tip
    # takes away a ninth of the ring that is shared.
    thick = math.pi * 2.0**2 * 4.0 - math.pi * (2.0 * THIN + 0.2) ** 2 * 4.0
    for part, about in (("half_a", (0, 0, 1)), ("lid", (0, 1, 0))):
        shared = turned(paper_mold.parts[part], about) & paper_mold.parts["half_b"]
        assert sum(solid.volume for solid in shared.solids()) >= 0.8 * thick


@pytest.mark.parametrize(
    ("gauges", "options", "told"),
    [
        ((), {"split_mm": 10.0}, "--split-mm 10"),
        ((), {"pour_mm": 96.0}, "--pour-mm 96"),
        ((), {"pour_mm": 24.0}, "--pour-mm 24"),
        (GAUGES[:1], {"split": "x"}, "--split x"),
        (GAUGES[:1], {"foil_length_mm": 12.0}, 'gauge "g36".* 12 x 3 x 0.1 mm'),
        ((Gauge("out", 60.0, 10.0),), {}, 'gauge "out"'),
        ((Gauge("edge", 0.0, 20.0, z_mm=9.5),), {}, 'gauge "edge"'),
        ((GAUGES[0], replace(GAUGES[0], name="near", y_mm=39.0)), {}, 'gauge "near".*g36'),
    ],
)
def test_molds_that_cannot_be(gauges, options, told, paper_finger) -> None:
    chosen = MoldOptions(**options)
    with pytest.raises(Finger3dError, match=told) as error:
        mold(paper_finger.solid(), foils(gauges, chosen, None), chosen)
    assert "\n" not in str(error.value)


def test_the_lid_fills_a_recess_in_the_base() -> None:
    from build123d import Box, Cylinder, Pos, Rot

    block = Pos(0.0, 6.0, 0.0) * Box(20.0, 12.0, 20.0)
    hole = Pos(-3.0, 2.5, 0.0) * Rot(90.0, 0.0, 0.0) * Cylinder(3.0, 5.0)
    plain, cast = (mold(body.solids()[0], [], MoldOptions()) for body in (block, block - hole))
    for name in ("half_a", "half_b"):
        assert cast.parts[name].volume == pytest.approx(plain.parts[name].volume, rel=1e-9)
    assert common(cast.parts["lid"], hole) == pytest.approx(45.0 * np.pi, rel=1e-6)
    assert cast.silicone_mm3 == pytest.approx(4800.0 - 45.0 * np.pi, rel=1e-6)
    wide = hole + Pos(-3.0, 4.5, 0.0) * Rot(90.0, 0.0, 0.0) * Cylinder(4.0, 1.0)
    with pytest.raises(Finger3dError, match=r"the recess in the base near \(-3, .*, an undercut of 1 mm"):
        mold((block - wide).solids()[0], [], MoldOptions())
