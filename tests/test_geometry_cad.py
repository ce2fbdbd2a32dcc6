"""CAD of designs: labels of faces, cuts, and what is no finger."""

from __future__ import annotations

from collections import Counter

import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import cut, extruded, labelled_faces, sound
from finger3d.geometry.section import block_section, cylinder_section


def test_faces_are_labelled_by_place_and_normal() -> None:
    solid = extruded(block_section(4.0, 3.0), 2.0, "block")
    assert Counter(f.label for f in labelled_faces(solid)) == {"contact": 1, "base": 1, "walls": 2, "ends": 2}
    assert solid.volume == pytest.approx(8.0 * 3.0 * 2.0)
    round_ = extruded(cylinder_section(5.0, 5.0, 0.0), 2.0, "round")
    # half a cylinder without walls
    assert Counter(f.label for f in labelled_faces(round_)) == {"contact": 1, "base": 1, "ends": 2}


@pytest.mark.parametrize("symmetry", [("x",), ("z",), ("x", "z")])
def test_a_cut_halves_the_volume_and_labels_its_plane(symmetry: tuple[str, ...]) -> None:
    solid = extruded(block_section(4.0, 3.0), 2.0, "block")
    part = cut(solid, symmetry)
    assert part.volume == pytest.approx(solid.volume / 2 ** len(symmetry))
    labels = {f.label for f in labelled_faces(part)}
    assert {label for label in labels if "symmetry" in label} == {f"symmetry_{axis}" for axis in symmetry}
    assert cut(solid, ()) is solid


def test_two_solids_and_a_solid_without_a_base_are_refused() -> None:
    from build123d import Box, Compound, Pos

    two = Compound([Pos(0.0, 1.0, 0.0) * Box(2.0, 2.0, 2.0), Pos(5.0, 1.0, 0.0) * Box(2.0, 2.0, 2.0)])
    with pytest.raises(Finger3dError, match="made 2 solids"):
        sound(two, "two")
    with pytest.raises(Finger3dError, match="y = 0"):
        sound(Pos(0.0, 5.0, 0.0) * Box(2.0, 2.0, 2.0), "hovering")
