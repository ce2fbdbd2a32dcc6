"""Designs: dimensions, sections, CAD, and the files they are found in."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import cut, extruded, labelled_faces, sound
from finger3d.geometry.design import check_core, check_layer, designs
from finger3d.geometry.section import (
    Core,
    block_section,
    cylinder_section,
    largest_core_mm,
    largest_layer_mm,
    with_core,
    with_layer,
)
from tests.designs import GOOD, make

# --- designs: dimensions that are checked, and their upper surface ---------------------------------------------------


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", [-1.0, math.nan, 2e4, "5"])
def test_every_dimension_refuses_what_is_no_length(name: str, value: Any) -> None:
    for key in GOOD[name]:
        with pytest.raises(Finger3dError) as refused:
            make(name, **{key: value})
        message = str(refused.value)
        assert key in message
        assert "allowed" in message
        assert "\n" not in message


MAY_BE_ZERO = {"edge_height_mm", "skin_mm"}


def test_zero_is_allowed_for_the_edge_height_and_for_parts_only() -> None:
    assert make("clipped_cylinder", edge_height_mm=0.0).height_mm == pytest.approx(100.0 - math.sqrt(7500.0))
    for name, dimensions in GOOD.items():
        for key in set(dimensions) - MAY_BE_ZERO:
            with pytest.raises(Finger3dError, match=key):
                make(name, **{key: 0.0})


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


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"half_length_mm": 101.0}, "half_length_mm = 101 .*radius_mm = 100"),
        ({"edge_height_mm": 120.0}, "edge_height_mm = 120 .*radius_mm = 100"),
    ],
)
def test_dimensions_that_do_not_fit_together_name_key_value_and_limit(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text):
        make("clipped_cylinder", **changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"skin_mm": 8.0}, r"skin_mm = 8: .*below 2 mm"),
        ({"half_length_mm": 10.0}, r"skin_mm = 1: .*half_length_mm .*radius_mm"),
        ({"edge_height_mm": 0.2, "skin_mm": 1.0}, r"skin_mm = 1: .*below 0\.1"),
        ({"core_height_mm": 0.0}, r"core_height_mm = 0, .*core_half_length_mm"),
        ({"core_half_length_mm": 8.5}, r"core_half_length_mm = 8\.5 .*at most 8 mm"),
        ({"core_height_mm": 10.9}, r"core_height_mm = 10\.9: .*below 10\.4"),
    ],
)
def test_parts_that_overlap_are_refused_in_one_line(changes: dict[str, float], text: str) -> None:
    with pytest.raises(Finger3dError, match=text) as refused:
        make("fingertip", **changes)
    assert "\n" not in str(refused.value)


def test_a_skin_leaves_something_of_a_block() -> None:
    with pytest.raises(Finger3dError, match=r"block: skin_mm = 15: .*below 15 mm"):
        make("block", skin_mm=15.0)


# --- designs by their names ------------------------------------------------------------------------------------------


def test_every_design_is_listed_by_its_name() -> None:
    assert set(designs()) == set(GOOD)
    for name, design in designs().items():
        assert design.name == name
        assert dataclasses.is_dataclass(design)
        assert design.__module__ == f"finger3d.geometries.{name}"
        assert [f.name for f in dataclasses.fields(design)] == list(GOOD[name])


# --- sections of fingers ---------------------------------------------------------------------------------------------


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


def test_a_skin_is_the_ring_between_concentric_arcs() -> None:
    # between half circles of radii 5 and 4
    round_ = with_layer(cylinder_section(5.0, 5.0, 0.0), 1.0)
    assert round_.areas_mm2["skin"] == pytest.approx(0.5 * math.pi * (25.0 - 16.0))
    assert round_.inner.half_length_mm == 4.0
    x = np.linspace(0.0, 45.0, 7)
    fig9 = with_layer(cylinder_section(100.0, 50.0, 36.6), 3.0)
    # along the radius the arcs are 3 mm apart
    outer = np.hypot(x, fig9.contact.height(x) - fig9.inner.contact.centre_y_mm)
    inner = np.hypot(x, fig9.inner.contact.height(x) - fig9.inner.contact.centre_y_mm)
    np.testing.assert_allclose(outer - inner, 3.0, rtol=1e-12)
    assert fig9.inner.half_length_mm == 50.0
    assert fig9.inner.edge_height_mm == pytest.approx(float(fig9.inner.contact.height(np.array(50.0))))


def test_areas_of_parts_sum_up_to_the_section() -> None:
    section = with_core(with_layer(block_section(20.0, 15.0), 2.0), Core(5.0, 10.0))
    assert section.part_labels == ("skin", "core")
    assert section.areas_mm2 == {"": 40.0 * 13.0 - 100.0, "skin": 80.0, "core": 100.0}
    assert sum(section.areas_mm2.values()) == section.area_mm2


def test_parts_that_do_not_fit_are_refused() -> None:
    fig9 = cylinder_section(100.0, 50.0, 36.6)
    with pytest.raises(Finger3dError, match="skin_mm = .* does not end on the walls"):
        check_layer("fig9", fig9, largest_layer_mm(fig9))
    with pytest.raises(Finger3dError, match="core_height_mm = .* reaches the contact face"):
        check_core("fig9", fig9, 10.0, largest_core_mm(fig9, 10.0))
    assert largest_core_mm(fig9, 50.0) == pytest.approx(36.6)
    assert largest_layer_mm(block_section(3.0, 2.0)) == 2.0


# --- CAD of designs: labels of faces, cuts, and what is no finger ----------------------------------------------------


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
