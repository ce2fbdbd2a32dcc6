"""Every design in geometries/: its rules, its closed forms against its CAD, its labels."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from finger3d.geometry.cad import cut, labelled_faces
from tests.designs import GOOD, make


@pytest.mark.parametrize("name", GOOD)
def test_the_solid_has_the_stated_volume_extent_and_labels(name: str) -> None:
    design = make(name)
    solid = design.solid()
    assert solid.volume == pytest.approx(design.volume_mm3, rel=1e-12)
    box = solid.bounding_box()
    half = 0.5 * design.width_mm
    np.testing.assert_allclose([*box.min], [-design.half_length_mm, 0.0, -half], atol=1e-6)
    np.testing.assert_allclose([*box.max], [design.half_length_mm, design.height_mm, half], atol=1e-6)
    labels = sorted(face.label for face in labelled_faces(solid))
    assert (
        labels
        == {
            "half_cylinder": ["base", "contact", "ends", "ends"],
            "clipped_cylinder": ["base", "contact", "ends", "ends", "walls", "walls"],
            "block": ["base", "contact", "ends", "ends", "walls", "walls"],
            "fingertip": ["base", "contact", "ends", "ends", "walls", "walls"],
            "hemisphere": ["base", "contact"],
        }[name]
    )


@pytest.mark.parametrize("name", GOOD)
def test_the_solids_of_the_parts_make_up_the_body(name: str) -> None:
    design = make(name)
    solids = design.solids()
    assert tuple(solids) == ("", *design.part_labels)
    assert sum(solid.volume for solid in solids.values()) == pytest.approx(design.volume_mm3, rel=1e-12)
    whole = design.solid()
    for label, solid in solids.items():
        assert (whole & solid).volume == pytest.approx(solid.volume, rel=1e-9)
        if design.section():
            assert solid.volume == pytest.approx(design.section().areas_mm2[label] * design.width_mm, rel=1e-12)


@pytest.mark.parametrize("name", GOOD)
def test_a_quarter_has_a_quarter_of_the_volume_and_its_cuts_are_labelled(name: str) -> None:
    design = make(name)
    quarter = cut(design.solid(), ("x", "z"))
    assert 4.0 * quarter.volume == pytest.approx(design.volume_mm3, rel=1e-9)
    labels = [face.label for face in labelled_faces(quarter)]
    for label in ("contact", "base", "symmetry_x", "symmetry_z"):
        assert labels.count(label) == 1


def test_a_design_file_runs_alone() -> None:
    file = Path(__file__).parents[1] / "geometries" / "half_cylinder.py"
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, check=True, timeout=120)
    assert "radius_mm=5.0" in done.stdout
    assert "volume 392.699 mm3, CAD 392.699 mm3" in done.stdout
