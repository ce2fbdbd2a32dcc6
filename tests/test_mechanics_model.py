"""Models: legs, paths and embedded bars."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.mechanics.discretise.foils import EmbeddedBars
from finger3d.mechanics.model import Gauge, Leg
from finger3d.mechanics.readings.reading import Marker, Taxel
from finger3d.objects import ObjectPose
from tests.models import block


def test_a_path_has_poses_at_the_quarters_of_every_leg() -> None:
    path = block(legs=(Leg(0.4), Leg(0.4, 1.0, duration_s=2.0))).contact_path
    assert [pose.depth_mm for pose in path.poses] == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.4, 0.4, 0.4, 0.4])
    assert [pose.slide_x_mm for pose in path.poses] == pytest.approx([0.0] * 4 + [0.25, 0.5, 0.75, 1.0])
    assert (path.half_length_mm, path.half_width_mm) == (4.0, 2.0)
    assert block(domain="plane-strain").contact_path.half_width_mm == 0.0


def test_a_leg_ends_at_its_depth_and_lasts_its_duration() -> None:
    end = Leg(0.2, 0.1, duration_s=3.0).end(ObjectPose(0.5, time_s=1.5))
    assert (end.depth_mm, end.slide_x_mm, end.time_s) == (0.2, 0.1, 4.5)
    assert not Leg(0.2).moves_sideways
    assert Leg(0.2, turn_y=0.1).moves_sideways


def test_forces_scale_with_the_modulus_unless_another_stiffness_or_a_force_is_given() -> None:
    assert block().forces_scale_with_modulus
    assert not block(legs=(Leg(0.3, force_N=1.0),)).forces_scale_with_modulus
    assert not ElasticObject(10.0, 0.3).apply(block()).forces_scale_with_modulus


def test_readings_are_named_in_the_order_of_their_rows() -> None:
    model = block(
        markers=(Marker("m", 1.0, 1.0),), taxels=(Taxel("t", 0.0, 0.0, 1.0, 1.0),), gauges=(Gauge("g", 0.0, 1.0),)
    )
    assert [column.name for column in model.columns] == ["m.x", "m.y", "m.z", "t", "g"]
    assert [reading.name for reading in model.readings] == ["m", "t", "g"]


def test_bars_are_strained_along_their_directions_and_lack_what_the_mesh_cannot_resolve() -> None:
    directions = np.array([[1.0, 0.0], [0.6, 0.8]])
    ends = np.array([[-1.0, 1.0, 0.0], [-0.5, 0.0, 0.5]])  # of three nodes; the second bar is 2 mm long
    bars = EmbeddedBars(
        directions, sp.kron(sp.csr_matrix(ends), np.eye(2), format="csr"), np.ones(2), np.array([[0.5, 0.5]]),
        2.0 * np.eye(2),
    )  # fmt: skip
    u = np.array([[0.0, 0.0], [0.3, 7.0], [0.4, 0.2]])
    assert bars.rows @ u.ravel() == pytest.approx([0.3, 0.5 * (0.6 * 0.4 + 0.8 * 0.2)])
    assert bars.in_mesh(0.5 * np.eye(2)).subgrid_compliance == pytest.approx(
        1.5 * np.array([[0.5, 0.5, 0.5], [0.5, 1.0, 0.0], [0.5, 0.0, 1.0]])
    )
