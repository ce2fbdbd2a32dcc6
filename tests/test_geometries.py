"""Every design in geometries/: its rules, its closed forms against its CAD, its labels."""

import dataclasses
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import cut, labelled_faces
from finger3d.geometry.registry import designs

GOOD: dict[str, dict[str, float]] = {
    "half_cylinder": {"radius_mm": 5.0, "width_mm": 10.0},
    "clipped_cylinder": {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0},
    "block": {"half_length_mm": 20.0, "height_mm": 15.0, "width_mm": 10.0},
    "hemisphere": {"radius_mm": 5.0},
}


def make(name: str, **changes: Any) -> Any:
    return designs()[name](**{**GOOD[name], **changes})


def test_every_design_is_listed_by_its_name() -> None:
    assert set(designs()) == set(GOOD)
    for name, design in designs().items():
        assert design.name == name
        assert dataclasses.is_dataclass(design)
        assert design.__module__ == f"finger3d.geometries.{name}"
        assert [f.name for f in dataclasses.fields(design)] == list(GOOD[name])


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf, 1e-3, 2e4, "5", True])
def test_every_dimension_refuses_what_is_no_length(name: str, value: Any) -> None:
    for key in GOOD[name]:
        with pytest.raises(Finger3dError) as refused:
            make(name, **{key: value})
        message = str(refused.value)
        assert key in message
        assert "allowed" in message
        assert "\n" not in message


def test_zero_is_allowed_for_the_edge_height_only() -> None:
    assert make("clipped_cylinder", edge_height_mm=0.0).height_mm == pytest.approx(100.0 - math.sqrt(7500.0))
    for name, dimensions in GOOD.items():
        for key in set(dimensions) - {"edge_height_mm"}:
            with pytest.raises(Finger3dError, match=key):
                make(name, **{key: 0.0})


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"half_length_mm": 101.0}, "half_length_mm = 101 is too large; allowed: at most radius_mm = 100"),
        ({"edge_height_mm": 120.0}, "edge_height_mm = 120 is too large; allowed: at most radius_mm = 100"),
    ],
)
def test_dimensions_that_do_not_fit_together_name_key_value_and_limit(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text):
        make("clipped_cylinder", **changes)


def test_the_papers_finger_is_50_mm_high() -> None:
    # Maeno 2004, Sec. III: 36.6 = 50 - (100 - sqrt(100^2 - 50^2)), to the digits the paper gives.
    assert make("clipped_cylinder").height_mm == pytest.approx(50.0, abs=0.003)


def test_a_clipped_cylinder_without_clipping_is_the_half_cylinder() -> None:
    clipped = make("clipped_cylinder", radius_mm=5.0, half_length_mm=5.0, edge_height_mm=0.0, width_mm=10.0)
    half = make("half_cylinder")
    assert clipped.volume_mm3 == half.volume_mm3 == pytest.approx(0.5 * math.pi * 250.0, rel=1e-15)
    assert clipped.height_mm == half.height_mm
    x, z = np.linspace(-6, 6, 25), np.zeros(25)
    np.testing.assert_array_equal(clipped.top(x, z), half.top(x, z))


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
            "hemisphere": ["base", "contact"],
        }[name]
    )


@pytest.mark.parametrize("name", GOOD)
def test_a_quarter_has_a_quarter_of_the_volume_and_its_cuts_are_labelled(name: str) -> None:
    design = make(name)
    quarter = cut(design.solid(), ("x", "z"))
    assert 4.0 * quarter.volume == pytest.approx(design.volume_mm3, rel=1e-9)
    labels = [face.label for face in labelled_faces(quarter)]
    for label in ("contact", "base", "symmetry_x", "symmetry_z"):
        assert labels.count(label) == 1


@pytest.mark.parametrize("name", GOOD)
def test_top_lies_on_the_cad_surface_and_is_nan_beyond_it(name: str) -> None:
    from build123d import Vector

    design = make(name)
    contact = next(f for f in labelled_faces(design.solid()) if f.label == "contact")
    x = np.linspace(-0.6, 0.6, 5) * design.half_length_mm
    z = np.linspace(-0.3, 0.25, 5) * design.width_mm
    for point in zip(x, design.top(x, z), z, strict=True):
        assert contact.distance_to(Vector(*map(float, point))) < 1e-9
    far = 1.01 * design.half_length_mm
    beyond = design.top(np.array([far, -far, 0.0, 0.0]), np.array([0.0, 0.0, 0.51, -0.51]) * design.width_mm)
    assert np.isnan(beyond).all()
    rim = design.top(np.array([design.half_length_mm, -design.half_length_mm]), np.zeros(2))
    assert np.isfinite(rim).all()


def test_a_design_file_runs_alone() -> None:
    file = Path(__file__).parents[1] / "geometries" / "half_cylinder.py"
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, check=True, timeout=120)
    assert "radius_mm=5.0" in done.stdout
    assert "volume 392.699 mm3, CAD 392.699 mm3" in done.stdout
