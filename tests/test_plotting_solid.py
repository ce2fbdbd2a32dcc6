"""Pictures of solids."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK
from finger3d.contact.zones import Zone, border_shares
from finger3d.fem.mesh.simplex import Mesh
from finger3d.plotting import solid as render
from tests.pictures import OBJECT, assert_shows_the_zones, finger_picture, solid_finger, top

pytestmark = pytest.mark.usefixtures("fresh_renderer")


@pytest.fixture(scope="module")
def solid() -> tuple[Mesh, dict[str, Any]]:
    return solid_finger()


def test_a_solid_is_drawn_by_matplotlib_when_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, solid: tuple[Mesh, dict[str, Any]]
) -> None:
    monkeypatch.setenv("FINGER3D_RENDERER", "matplotlib")
    mesh, result = solid
    assert finger_picture(tmp_path / "f.png", mesh, **result, title="Fig. 9", thing=OBJECT) == "matplotlib"
    assert_shows_the_zones(tmp_path / "f.png")


def test_the_skin_is_the_whole_boundary_and_lies_on_the_curved_surface(solid: tuple[Mesh, dict[str, Any]]) -> None:
    mesh, result = solid
    table = result["table"]
    status = np.array([STATUS_NAMES.index(s) for s in table["status"]])
    shear = np.column_stack([table[f"shear_{axis}_MPa"] for axis in "xyz"])
    still = np.zeros_like(mesh.points)
    nodes = result["contact_nodes"]
    skin = render.skin_of(mesh, still, table["pressure_MPa"], shear, status, nodes, np.zeros(len(nodes), dtype=int))
    assert len(skin.contact) == 6 * len(mesh.facets["contact"])
    assert len(skin.body) == sum(len(f) for k, f in mesh.facets.items() if k != "contact")
    assert np.abs(skin.contact[..., 1] - top(skin.contact[..., 0])).max() < 0.2  # sagitta of a facet 5 mm long
    edges = skin.contact[:, 1:] - skin.contact[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    assert area.sum() == pytest.approx(20.0 * 200.0 * np.arcsin(0.5), rel=1e-3)
    # Every contact point owns as much of the picture as of the surface: slip's share of the touching area.
    touching = skin.status != OPEN
    assert 0.4 < area[skin.status == SLIP].sum() / area[touching].sum() < 0.9
    assert 20 < len(skin.arrow) < 150
    assert np.linalg.norm(skin.arrow, axis=1).max() <= 1.0 + 1e-12


def test_the_boundary_of_a_status_is_straight_across_a_facet() -> None:
    """One corner that slips has the triangle between it and the middles of its edges, a quarter of the facet."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    seven = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0)), corners.mean(axis=0)])
    sides = seven[render._SIX]
    area = 0.5 * np.abs(np.linalg.det(sides[:, 1:] - sides[:, :1]))
    assert area.sum() == pytest.approx(0.5)
    for one in range(3):
        status = np.full(3, STICK)
        status[one] = SLIP
        slips = render._status_on_six(status[None])[0] == SLIP
        assert slips.sum() == 1
        assert area[slips].sum() == pytest.approx(0.125)
        assert (sides[slips] == corners[one]).all(axis=2).any()
    shares = [area[render._status_on_six(np.array([[OPEN, STICK, SLIP]]))[0] == s].sum() for s in (OPEN, STICK, SLIP)]
    assert shares == pytest.approx([1.0 / 6.0] * 3)


@pytest.mark.parametrize("quadratic", [False, True])
def test_borders_cross_the_sides_of_a_facet_where_the_zones_have_them(quadratic: bool) -> None:
    """A corner that sticks to the share t of both sides has t^2 of the facet, one that is open leaves 1 - (1 - t)^2."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    points = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
    facets = np.arange(6 if quadratic else 3)[None]
    for t in (0.2, 0.5, 0.8):
        for status, zone_is_stick, share in (
            ([STICK, SLIP, SLIP], True, t**2),
            ([OPEN, SLIP, SLIP], False, 1.0 - (1.0 - t) ** 2),
        ):
            state = np.array(status)
            zones = tuple(
                Zone(inside, lambda last, beyond, t=t: np.full(len(last), t))
                for inside in (state != OPEN, state == STICK)
            )
            point = np.concatenate([np.arange(3), np.full(3, -1)])
            triangles, pressure, of = render._coloured(facets, points, point, np.arange(3.0), state, zones)
            arms = triangles[:, 1:] - triangles[:, :1]
            area = 0.5 * np.cross(arms[:, 0], arms[:, 1])[:, 2]
            assert area.min() > 0.0
            assert area.sum() == pytest.approx(0.5)
            inside = of == STICK if zone_is_stick else of != OPEN
            assert area[inside].sum() == pytest.approx(0.5 * share)
            assert pressure == pytest.approx(triangles @ [1.0, 2.0, 0.0])  # linear on the facet


def test_a_border_beside_a_place_without_contact_point_is_midway() -> None:
    zones = tuple(Zone(np.array([True, True]), lambda last, beyond: np.full(len(last), 0.9)) for _ in range(2))
    assert border_shares(np.array([[0, -1], [0, 1]]), np.array([STICK, STICK]), zones) == pytest.approx([0.5, 0.5])
