"""Parts on the bed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from finger3d.mold.packing import GAP_MM, as_printed, beds
from finger3d.mold.shell import Shell
from tests.bodies import box


def _shells(*sizes: tuple[float, float, float]) -> dict[str, Shell]:
    return {f"lid_{i}": Shell(box(*s, tuple(0.5 * e for e in s)), 0.0, 0.0) for i, s in enumerate(sizes)}


def test_parts_lie_apart_on_the_bed() -> None:
    found = beds(_shells((100, 60, 5), (80, 60, 5), (60, 30, 9), (20, 20, 3), (20, 100, 3)), (200.0, 140.0, 100.0))
    assert len(found) == 1
    (bed,) = found
    assert bed.fits
    for part in bed.placed.values():
        assert (part.surface.low >= -1e-9).all()
        assert (part.surface.high[:2] <= np.array([200.0, 140.0]) + 1e-9).all()
    for a, b in itertools.combinations(bed.placed.values(), 2):
        apart = np.maximum(a.surface.low - b.surface.high, b.surface.low - a.surface.high)[:2]
        assert apart.max() >= GAP_MM - 1e-6


def test_parts_that_do_not_fit_take_another_bed() -> None:
    sizes = [(90.0, 90.0, 5.0)] * 3
    found = beds(_shells(*sizes), (100.0, 100.0, 50.0))
    assert [len(bed.placed) for bed in found] == [1, 1, 1]
    assert all(bed.fits for bed in found)
    (alone,) = beds(_shells((300.0, 20.0, 5.0)), (100.0, 100.0, 50.0))
    assert not alone.fits
    (high,) = beds(_shells((20.0, 20.0, 60.0)), (100.0, 100.0, 50.0))
    assert not high.fits


def test_a_long_part_is_turned() -> None:
    (bed,) = beds(_shells((40.0, 180.0, 5.0)), (200.0, 50.0, 50.0))
    (part,) = bed.placed.values()
    assert bed.fits
    assert part.extent == pytest.approx([180.0, 40.0, 5.0])
    assert part.surface.volume == pytest.approx(40.0 * 180.0 * 5.0)  # turned, not mirrored


def test_outer_faces_lie_on_the_bed(paper_mold) -> None:
    """Pegs of half B and of the lid, and the spigot of the riser, point up."""
    printed = as_printed({name: paper_mold.shell(name, 0.2, 0.4) for name in ("half_b", "lid", "riser")})
    for name, part in printed.items():
        assert part.surface.low == pytest.approx(np.zeros(3), abs=1e-9)
        top = part.surface.points[part.surface.points[:, 2] > part.extent[2] - 1e-6]
        area = np.prod(np.ptp(top[:, :2], axis=0))
        assert area > 0.0, name
    lid = printed["lid"].surface
    assert lid.normals[np.abs(lid.corners[:, :, 2]).max(axis=1) < 1e-9, 2].max() < -0.99
