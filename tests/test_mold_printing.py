"""Mold parts as a slicer sees them, and on the bed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from finger3d.mold.body import Shell
from finger3d.mold.parts import Mold
from finger3d.mold.printing import GAP_MM, as_printed, beds, check_print, islands, thickness
from tests.bodies import box
from tests.mold_cases import BODIES, FEW, made

ALL = [
    {"seal": "tongue", "fasten": "screws", "printer": "fdm-0.4"},
    {"seal": "cord", "fasten": "screws", "printer": "sla", "cavities": 2, "screw": "M4"},
    {"seal": "none", "fasten": "bands", "printer": "fdm-0.4", "cavities": 2, "riser": 0.0},
    {"seal": "tongue", "fasten": "bands", "printer": "sla", "riser": 0.05},
    {"seal": "cord", "fasten": "bands", "printer": "fdm-0.4", "riser": 0.03, "shrinkage": 0.01},
    {"seal": "none", "fasten": "none", "printer": "sla", "pry": False},
    {"seal": "cord", "fasten": "none", "printer": "fdm-0.4", "cavities": 2},
    {"seal": "tongue", "carrier": True, "key_mm": 1.5, "pour_mm": 1.5, "riser": 0.0},
    {"seal": "cord", "carrier": True, "key_mm": 1.5, "pour_mm": 2.0, "riser": 0.0, "printer": "sla"},
]
"""Options that together hold every value of each."""

NAMES = [
    "tongue, screws, plugs",
    *(name for name in FEW if name != "insert"),
    pytest.param("insert", marks=pytest.mark.slow),
]


def check(found: Mold, layer: float = 0.5) -> None:
    """Closed, oriented, no wall below what the printer makes, nothing that begins in the air.

    3 %: rays are slanted and chords cut corners.
    """
    printed = as_printed({name: found.shell(name, 0.1, 0.3) for name in found.parts})
    for name, part in printed.items():
        seen = check_print(part.surface, layer)
        assert seen.defect == "", name
        assert seen.wall_mm >= 0.97 * found.options.machine.thinnest_mm, (name, seen)
        assert len(seen.islands) == 0, (name, seen.islands)


@pytest.mark.parametrize("name", NAMES)
def test_every_part_prints(name, molds) -> None:
    check(molds[name])


@pytest.mark.slow
@pytest.mark.parametrize("design", sorted(set(BODIES) - {"fingertip"}))
@pytest.mark.parametrize("kind", ["CAD", "STL"])
@pytest.mark.parametrize("options", ALL, ids=lambda options: "-".join(str(value) for value in options.values()))
def test_every_design_prints_with_all_options(design, kind, options) -> None:
    check(made(f"{design} as STL" if kind == "STL" else design, options))


def test_a_thin_wall_is_found() -> None:
    """A plate 0.3 mm thick: the thickness is that of the plate, but for the slant of the rays."""
    found, where = thickness(box(20.0, 10.0, 0.3, (0.0, 0.0, 0.15)))
    assert found == pytest.approx(0.3, rel=1e-3)
    assert np.abs(where[2] - 0.15) == pytest.approx(0.15, abs=1e-3)
    assert check_print(box(20.0, 10.0, 3.0, (0.0, 0.0, 1.5)), 0.5).wall_mm == pytest.approx(3.0, rel=1e-2)


def test_what_begins_in_the_air_is_found() -> None:
    """A table upside down is sound, a table with its top first is sound, a hook that hangs down is not."""
    from build123d import Box, Pos

    from finger3d.mold.body import shell

    hook = Pos(0, 0, 5) * Box(4, 4, 10) + Pos(4, 0, 9) * Box(8, 4, 2) + Pos(7, 0, 6) * Box(2, 4, 6)
    found = islands(shell(hook.solids()[0], 0.1, "hook").surface, 0.5)
    assert len(found) == 1
    np.testing.assert_allclose(found[0], [7.0, 0.0, 3.25], atol=0.26)
    assert len(islands(box(20.0, 10.0, 3.0, (0.0, 0.0, 1.5)), 0.5)) == 0


def test_an_open_surface_is_told() -> None:
    from finger3d.geometry.surface import Triangles

    whole = box(2.0, 2.0, 2.0, (0.0, 0.0, 1.0))
    assert "not closed" in check_print(Triangles(whole.points, whole.faces[1:]), 0.5).defect


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
