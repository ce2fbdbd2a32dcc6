"""Mold parts as a slicer sees them, and as they lie."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.mold.body import Shell
from finger3d.mold.parts import Mold
from finger3d.mold.printing import GAP_MM, as_printed, check_print, in_a_row, islands, thickness
from tests.bodies import box
from tests.mold_cases import BODIES, FEW, made

ALL = [
    {"printer": "fdm-0.4"},
    {"printer": "sla", "screw": "M4"},
    {"printer": "sla", "screw": "none", "pour_mm": 2.0},
    {"printer": "fdm-0.4", "shrinkage": 0.01, "peg_mm": 5.0, "split": "x"},
]
"""Options that together hold every kind of value."""

NAMES = ["screws, gauges", *(name for name in FEW if name != "insert"), pytest.param("insert", marks=pytest.mark.slow)]


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


def test_parts_stand_in_a_row() -> None:
    parts = {name: Shell(box(4.0, 2.0, 1.0, (2.0, 1.0, 0.5)), 0.0, 0.0) for name in "abc"}
    placed = in_a_row(parts)
    for name, x in zip("abc", (0.0, 4.0 + GAP_MM, 8.0 + 2.0 * GAP_MM), strict=True):
        assert placed[name].surface.low == pytest.approx([x, 0.0, 0.0])


def test_outer_faces_lie_on_the_bed(paper_mold) -> None:
    """Pegs of half B and of the lid point up."""
    printed = as_printed({name: paper_mold.shell(name, 0.2, 0.4) for name in ("half_b", "lid")})
    for name, part in printed.items():
        assert part.surface.low == pytest.approx(np.zeros(3), abs=1e-9)
        top = part.surface.points[part.surface.points[:, 2] > part.extent[2] - 1e-6]
        area = np.prod(np.ptp(top[:, :2], axis=0))
        assert area > 0.0, name
    lid = printed["lid"].surface
    assert lid.normals[np.abs(lid.corners[:, :, 2]).max(axis=1) < 1e-9, 2].max() < -0.99
