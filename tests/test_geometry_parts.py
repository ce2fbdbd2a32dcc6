"""Solids glued along the faces where they touch, their triangles, and STEP files of several solids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import cut_part
from finger3d.geometry.files import read_step
from finger3d.geometry.imported import imported
from finger3d.geometry.parts import OUTSIDE, glue
from finger3d.geometry.surface_checks import mistake
from finger3d.geometry.tessellate import tessellate, tessellate_parts
from tests.bodies import step_of
from tests.designs import make

FINGERTIP = make("fingertip")


def file_of(path: Path, **solids: Any) -> Path:
    """A STEP file of solids with these labels, an underscore for none."""
    from build123d import Compound

    for label, solid in solids.items():
        solid.label = label.strip("_")
    return step_of(path, Compound(children=list(solids.values())))


@pytest.mark.parametrize("symmetry", [(), ("x",), ("x", "z")])
def test_glued_parts_share_their_faces(symmetry: tuple[str, ...]) -> None:
    solids = {label: cut_part(solid, symmetry) for label, solid in FINGERTIP.solids().items()}
    glued = glue(solids, "fingertip")
    assert glued.labels == ("", "skin", "core")
    assert sum(glued.volumes_mm3) == pytest.approx(FINGERTIP.volume_mm3 / 2 ** len(symmetry), rel=1e-12)
    sides = [(f.inside, f.outside) for f in glued.faces]
    assert sides.count((0, 1)) == 1  # the arc
    assert sides.count((0, 2)) == (3 if not symmetry else 2)  # the core's upper side and its walls
    body = tessellate_parts(glued, 1e-3)
    assert body.part_labels == ("skin", "core")
    assert body.volume_mm3 == pytest.approx(sum(glued.volumes_mm3), rel=1e-4)
    for number, volume in enumerate(glued.volumes_mm3):
        assert mistake(body.part(number)) == ""
        assert body.part(number).volume == pytest.approx(volume, rel=1e-4)
    assert {f.label for f in body.faces if f.outside != OUTSIDE} == {""}
    corners = {tuple(c) for c in np.round(np.abs(body.corners), 6).tolist()}
    assert (3.0, 6.0, 8.0) in corners  # of the core
    assert len(corners) == (5 if not symmetry else 9 if symmetry == ("x",) else 18)


def test_solids_that_overlap_are_refused() -> None:
    from build123d import Box, Pos

    with pytest.raises(Finger3dError, match="^two: .*overlap"):
        glue({"": Box(4.0, 4.0, 4.0), "core": Pos(1.0, 0.0, 0.0) * Box(4.0, 4.0, 4.0)}, "two")


def test_solids_of_a_step_file_are_parts_with_their_names(tmp_path: Path) -> None:
    from build123d import Pos, Rot

    where = Rot(0.0, 0.0, 30.0) * Pos(5.0, 3.0, 1.0)
    parts = {label or "_": where * solid for label, solid in FINGERTIP.solids().items()}
    path = file_of(tmp_path / "finger.step", **parts)
    assert sorted(read_step(path).labels) == ["", "core", "skin"]
    upright = file_of(tmp_path / "upright.step", **{label or "_": s for label, s in FINGERTIP.solids().items()})
    body = imported(upright)
    assert set(body.part_labels) == {"skin", "core"}
    assert body.volume_mm3 == pytest.approx(FINGERTIP.volume_mm3, rel=1e-4)
    for label, area in FINGERTIP.section().areas_mm2.items():
        assert body.solids()[label].volume == pytest.approx(area * FINGERTIP.width_mm, rel=1e-9)
    assert body.mirrors() == ("x", "z")
    assert sum(s.volume for s in body.solids().values()) == pytest.approx(body.solid().volume, rel=1e-9)
    with pytest.raises(Finger3dError, match="no base"):
        imported(path)


def test_a_part_off_the_middle_leaves_no_symmetry(tmp_path: Path) -> None:
    from build123d import Box, Pos

    core = Pos(1.0, 1.0, 0.0) * Box(2.0, 2.0, 2.0)
    path = file_of(tmp_path / "finger.step", _=Pos(0.0, 2.0, 0.0) * Box(8.0, 4.0, 8.0) - core, core=core)
    assert imported(path).mirrors() == ("z",)


@pytest.mark.parametrize(
    ("shift", "text"),
    [(9.0, "2 solids .*2 bodies.* 1 mm apart"), (8.0005, " 0.0005 mm apart near "), (3.0, "two.step: .*overlap")],
)
def test_step_files_of_solids_that_do_not_fit_together(tmp_path: Path, shift: float, text: str) -> None:
    from build123d import Box, Pos

    path = file_of(tmp_path / "two.step", _=Box(8.0, 4.0, 8.0), core=Pos(shift, 0.0, 0.0) * Box(8.0, 4.0, 8.0))
    with pytest.raises(Finger3dError, match=text) as refused:
        imported(path)
    assert "\n" not in str(refused.value)


def test_a_core_with_clearance_in_its_pocket_is_told_with_the_place(tmp_path: Path) -> None:
    from build123d import Box, Pos

    outer = Pos(0.0, 3.0, 0.0) * Box(20.0, 6.0, 10.0)
    for gap in (0.005, 5e-5, 0.2):
        pocket = Pos(0.0, 1.0, 0.0) * Box(10.0 + 2.0 * gap, 2.0, 4.0)
        core = Pos(0.0, 1.0, 0.0) * Box(10.0, 2.0, 4.0)
        path = file_of(tmp_path / "finger.step", _=outer - pocket, core=core)
        if gap > 0.1:  # a slot that can be meshed
            assert imported(path).part_labels == ("core",)
            continue
        with pytest.raises(Finger3dError, match=rf"not touch, but are {gap:.2g} mm apart near \(-?5(\.\d+)?, "):
            imported(path)


def test_a_thin_part_between_two_others_is_no_gap(tmp_path: Path) -> None:
    from build123d import Box, Pos

    low, foil, high = (Pos(0.0, y, 0.0) * Box(20.0, h, 10.0) for y, h in ((1.0, 2.0), (2.0025, 0.005), (3.005, 2.0)))
    body = imported(file_of(tmp_path / "finger.step", _=low, foil=foil, top=high))
    assert set(body.part_labels) == {"foil", "top"}


def test_solids_with_one_name_are_one_body(tmp_path: Path) -> None:
    from build123d import Box, Pos

    path = file_of(tmp_path / "two.step", _=Box(8.0, 4.0, 8.0), __=Pos(8.0, 0.0, 0.0) * Box(8.0, 4.0, 8.0))
    body = imported(path)
    assert body.part_labels == ()
    assert body.volume_mm3 == pytest.approx(512.0)


def test_the_faces_of_a_void_are_a_cavity(tmp_path: Path) -> None:
    from build123d import Box, Pos, Sphere

    hollow = (Pos(0.0, 5.0, 0.0) * Box(10.0, 10.0, 10.0) - Pos(0.0, 5.0, 0.0) * Sphere(2.0)).solids()[0]
    labels = [f.label for f in tessellate(hollow, 0.01).faces]
    assert sorted(labels) == ["base", "cavity", "contact", "ends", "ends", "walls", "walls"]
    body = imported(step_of(tmp_path / "hollow.step", hollow))
    assert body.volume_mm3 == pytest.approx(hollow.volume, rel=1e-3)
    assert body.height_mm == pytest.approx(10.0)
