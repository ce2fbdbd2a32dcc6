"""Edge lengths that a scene leaves open: chosen from the finger's height and the overlap of a curved object."""

from __future__ import annotations

import pytest

from finger3d.scene import parse
from tests.scene_tables import FINGER, HEIGHT, SMALL


@pytest.mark.parametrize(
    ("domain", "mesher", "width", "size", "base"),
    [
        ("solid", "ftetwild", HEIGHT, HEIGHT / 27.5, HEIGHT / 3),
        ("solid", "ftetwild", 20.0, HEIGHT / 27.5, 0.4 * 20.0),  # the largest edges are not long beside the width
        ("solid", "ftetwild", 1.0, 0.5, 0.5),  # a thin finger gets two elements across
        ("solid", "swept", HEIGHT, HEIGHT / 25, HEIGHT / 6.25),  # its rows run through the whole body
        ("plane-strain", "ftetwild", HEIGHT, HEIGHT / 100, HEIGHT / 25),
        ("plane-stress", "ftetwild", HEIGHT, HEIGHT / 100, HEIGHT / 25),
    ],
)
def test_absent_mesh_sizes_are_chosen_from_the_extents(domain, mesher, width, size, base) -> None:
    finger = {**FINGER, "width_mm": width}
    mesh = parse({**SMALL, "finger": finger, "model": {"domain": domain}, "mesh": {"mesher": mesher}}).model().mesh
    assert (mesh.size_mm, mesh.base_size_mm) == pytest.approx((size, base), rel=1e-3)


@pytest.mark.parametrize("given_size", [{"size_mm": 10.0}, {"base_size_mm": 1.0}])
def test_a_chosen_size_never_contradicts_a_given_one(given_size) -> None:
    mesh = parse({**SMALL, "mesh": given_size}).model().mesh
    assert mesh.size_mm <= mesh.base_size_mm
    assert {k: getattr(mesh, k) for k in given_size} == given_size


@pytest.mark.parametrize(
    ("thing", "size"),
    [
        ({"shape": "plane", "tilt_deg": 0.0}, 10.0 / 27.5),
        ({"shape": "sphere", "radius_mm": 8.0}, 2 * 2.78388 / 600**0.5),  # sqrt(d (2 R - d)) each way, 600 points
        ({"shape": "cylinder", "radius_mm": 8.0, "axis": "z"}, (2 * 2.78388 * 4.0 / 600) ** 0.5),
        ({"shape": "cylinder", "radius_mm": 100.0, "axis": "x"}, 4.0 / 12.0),  # as wide as the finger, no end inside
        ({"shape": "wave", "wavelength_mm": 5.0, "amplitude_mm": 0.1}, 4.0 / 12.0),  # finer: more than 600 points
        ({"shape": "sphere", "radius_mm": 0.1}, 0.05 * 10.0 / 27.5),  # the finest
        ({"shape": "sphere", "radius_mm": 0.1, "mesher": "swept"}, 0.2 * 0.4),
    ],
)
def test_default_edges_resolve_the_overlap_of_a_curved_object(thing, size) -> None:
    tables = {
        "finger": {
            "geometry": "block",
            "half_length_mm": 10.0,
            "height_mm": 10.0,
            "width_mm": 20.0 if thing["shape"] in ("sphere", "plane") else 4.0,
        },
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": 0.5},
        "object": {key: value for key, value in thing.items() if key != "mesher"},
        "mesh": {"mesher": thing.get("mesher", "ftetwild")},
    }
    # the overlap is found on a grid of a hundredth of the finger
    assert parse(tables).mesh.size_mm == pytest.approx(size, rel=0.06)


@pytest.mark.parametrize(
    ("depth", "domain", "size"),
    [
        # a plane overlaps a half cylinder of 10 mm over 2 sqrt(d (2 R - d))
        (0.02, "plane-strain", 1.2643 / 20),
        (0.2, "plane-strain", 0.1),
        (0.1, "solid", (2.8213 * 2.0 / 600) ** 0.5),
        (2.0, "solid", 10.0 / 27.5),
    ],
)
def test_default_edges_resolve_the_contact_of_a_round_finger_with_a_plane(depth, domain, size) -> None:
    tables = {
        "finger": {"geometry": "half_cylinder", "radius_mm": 10.0, "width_mm": 2.0},
        "material": {"E_MPa": 1.0, "nu": 0.3},
        "press": {"depth_mm": depth},
        "model": {"domain": domain},
    }
    # the overlap is found on a grid of a hundredth of the finger
    assert parse(tables).mesh.size_mm == pytest.approx(size, rel=0.06)


@pytest.mark.parametrize(
    ("height", "radius", "size", "base"),
    [
        # a ball of 6 mm that is 1.6 mm deep overlaps 8.16 mm of the pad, at 1.925 mm 8.8 mm
        (4.0, 6.0, 8.16 / 600**0.5, 0.4 * 4.0),
        (1.5, 6.0, 2.5 * 1.5 / 27.5, 0.6),  # 1/11 and 0.4 of the height at most
        (40.0, 6.0, 8.8 / 600**0.5, 0.4 * 16.0),  # no layer
    ],
)
def test_edges_in_a_layer_follow_the_contact_and_the_thickness(height, radius, size, base) -> None:
    mesh = parse(
        {
            "finger": {"geometry": "block", "half_length_mm": 8.0, "height_mm": height, "width_mm": 16.0},
            "material": {"E_MPa": 0.1, "nu": 0.49},
            "object": {"shape": "sphere", "radius_mm": radius},
            "press": {"depth_mm": min(1.925, 0.4 * height)},
        }
    ).mesh
    # the overlap is found on a grid that is a twentieth of its width
    assert mesh.size_mm == pytest.approx(size, rel=0.09)
    assert mesh.base_size_mm == pytest.approx(base, rel=0.09)
