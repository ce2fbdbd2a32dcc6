"""Cause and cure of an increment that does not settle."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.finite_strain.failure import cause_of_failure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Plane, Wedge

BLOCK = designs()["block"](half_length_mm=7.0, height_mm=10.0, width_mm=10.0)
MODEL = Model(
    BLOCK, Isotropic(1.0, 0.4), MeshOptions(1.0, 2.0, "swept"), (Leg(1.0, steps=2),), object=Plane(),
    domain="plane-strain",
)  # fmt: skip


def test_a_tip_that_the_points_do_not_resolve_is_the_cause() -> None:
    problem = build(replace(MODEL, object=Wedge(angle=0.4, tip_radius_mm=1.2)))
    said = cause_of_failure(problem, np.zeros(problem.mesh.points.shape))
    assert said.startswith("object.tip_radius_mm = 1.2: ")
    assert "mesh.size_mm = 0.6 " in said


def test_a_cell_that_folds_at_a_sharp_edge_of_the_finger_is_named() -> None:
    problem = build(MODEL)
    points = problem.mesh.points
    assert not cause_of_failure(problem, np.zeros(points.shape))
    near = np.exp(-((points - [7.0, 10.0]) ** 2).sum(axis=1))[:, None]
    said = cause_of_failure(problem, -0.6 * near * (points - [7.0, 10.0]) * [0.0, 1.0])
    assert re.search(r" 0\.\d+ of its volume", said)
    assert re.search(r"fillet of [\d.]+ mm", said)
    middle = np.exp(-((points - [0.0, 5.0]) ** 2).sum(axis=1))[:, None]
    said = cause_of_failure(problem, -0.6 * middle * (points - [0.0, 5.0]) * [0.0, 1.0])
    assert re.search(r" 0\.\d+ of its volume", said)
    assert "fillet" not in said


def test_the_papers_rule_is_named_where_it_may_have_no_answer() -> None:
    problem = build(replace(MODEL, rule="paper"))
    assert "rule = 'projection'" in cause_of_failure(problem, np.zeros(problem.mesh.points.shape))
