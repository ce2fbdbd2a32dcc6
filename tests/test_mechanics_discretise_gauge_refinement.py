"""Refinement around gauges: what it changes, and what the slope of a gauge against friction gains."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from finger3d._types import Float
from finger3d.accuracy.cost import forecast
from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.simplex import CONTACT
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import companion, edge_ratio
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.scene.scene import parse

ROUND = Isotropic(1.0, 0.49)
MUS = np.arange(0.1, 1.05, 0.1)


def model(size: float, refinement: float, **changes: Any) -> Model:
    """The Fig. 9 finger as a section, pressed 10 mm, with its gauge close to the edge of the contact."""
    design = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    mesh = MeshOptions(size, 4.0 * size, "swept", gauge_refinement=refinement)
    gauge = Gauge("g", 36.0, 40.0, angle=np.radians(30.0))
    found = Model(design, ROUND, mesh, (Leg(10.0, steps=20),), gauges=(gauge,), domain="plane-strain")
    return replace(found, **changes)


def slope(size: float, refinement: float) -> Float:
    """Return the slope of the gauge's strain over mu between values 0.1 apart."""
    problem = build(model(size, refinement))
    presses = [list(march(replace(problem, model=replace(problem.model, friction=Coulomb(mu)))))[-1] for mu in MUS]
    return np.diff([press.gauges["g"] for press in presses]) / np.diff(MUS)


def test_the_slope_of_a_gauge_near_the_edge_of_contact_is_several_times_as_accurate() -> None:
    # without refinement cells at the gauge are as large as its distance from the edge of the contact
    plain, finer, much_finer = slope(4.0, 1.0), slope(4.0, 8.0), slope(1.0, 8.0)
    scale = np.abs(much_finer).max()
    error, error_finer = (np.abs(found - much_finer).max() / scale for found in (plain, finer))
    assert error > 0.2
    assert error_finer < 0.1
    assert error_finer < 0.3 * error


def test_the_contact_face_is_refined_close_to_the_gauge_and_the_body_below_it_is_not() -> None:
    usual, finer = build(model(4.0, 1.0)), build(model(4.0, 4.0))
    # the gauge lies 3.4 mm below the face, whose edges are shortest up to 2.5 times that distance from it
    x = np.unique(finer.surface.points[finer.surface.face == CONTACT, 0])
    near = np.abs(x[1:] - 36.0) < 6.0
    assert np.diff(x)[near].max() < 0.4 * 4.0
    far = x[x < 20.0]
    assert far == pytest.approx(np.unique(usual.surface.points[usual.surface.face == CONTACT, 0])[: len(far)], abs=1e-9)
    # 15 mm below the gauge edges are as long as they were
    below = np.abs(finer.mesh.points - [36.0, 25.0]).max(axis=1) < 4.0
    before = np.abs(usual.mesh.points - [36.0, 25.0]).max(axis=1) < 4.0
    assert np.count_nonzero(below) <= 1.5 * np.count_nonzero(before)


@pytest.mark.parametrize("changes", [{"gauges": ()}, {}], ids=["no gauge", "factor 1"])
def test_without_a_gauge_or_at_factor_one_the_mesh_stays_as_it_is(changes: dict[str, Any]) -> None:
    usual = build(model(8.0, 1.0, gauges=()))
    same = build(model(8.0, 4.0 if changes else 1.0, **changes))
    assert same.body.report.hash == usual.body.report.hash


def test_the_report_describes_the_refined_mesh() -> None:
    usual, finer = build(model(8.0, 1.0)).body.report, build(model(8.0, 4.0)).body.report
    assert finer.cells > 2 * usual.cells
    assert finer.volume_mm3 == pytest.approx(usual.volume_mm3, rel=1e-12)
    assert finer.hash != usual.hash


@pytest.mark.parametrize("y", [40.0, 33.0])
def test_a_larger_factor_makes_no_edge_of_the_contact_face_longer(y: float) -> None:
    longest = []
    for refinement in (1.0, 2.0, 4.0, 8.0, 16.0):
        surface = build(model(4.0, refinement, gauges=(Gauge("g", 36.0, y),))).surface
        x = np.unique(surface.points[surface.face == CONTACT, 0])
        longest.append(np.diff(x)[np.abs(x[1:] - 36.0) < 6.0].max())
    assert all(finer <= coarser + 1e-9 for coarser, finer in pairwise(longest))
    # the gauge lies 3.4 or 10.4 mm under the face, whose edges are an eighth of that at least
    assert longest[-1] < 0.5 * longest[0]


def test_the_gauges_to_refine_around_may_be_named() -> None:
    gauges = (Gauge("g", 36.0, 40.0), Gauge("far", 10.0, 20.0))
    only, both = model(8.0, 4.0, gauges=gauges[:1]), model(8.0, 4.0, gauges=gauges)
    named = replace(both, mesh=replace(both.mesh, refined_gauges=("g",)))
    assert build(named).body.report.hash == build(only).body.report.hash != build(both).body.report.hash


def test_edges_are_short_along_the_whole_gauge_and_its_mirror_image() -> None:
    gauge = Gauge("long", -20.0, 40.0, length_mm=12.0)
    problem = build(model(8.0, 8.0, gauges=(gauge,)))
    assert problem.axes == ("x",)
    for x in (14.0, 20.0, 26.0):
        distance = np.linalg.norm(problem.mesh.points - [x, 40.0], axis=1)
        assert np.count_nonzero(distance < 1.5) > 5


def test_the_companion_of_an_error_bar_is_refined_alike() -> None:
    problem, usual = build(model(2.0, 4.0)), build(model(2.0, 1.0))
    beside = companion(problem)
    assert beside.model.mesh.gauge_refinement == 4.0
    # of the rest of the mesh, from which the errors of forces come; pressures count in one of the ratios only
    assert edge_ratio(problem, beside) == pytest.approx(edge_ratio(usual, companion(usual)), rel=0.02)


def test_the_key_of_a_scene_reaches_the_mesh_and_is_written_with_it() -> None:
    tree = {
        "finger": {"geometry": "half_cylinder", "radius_mm": 5.0, "width_mm": 4.0},
        "material": {"E_MPa": 1.0, "nu": 0.49}, "friction": {"mu": 0.3}, "press": {"depth_mm": 1.0},
        "mesh": {"gauge_refinement": 3.0},
    }  # fmt: skip
    scene = parse(tree)
    assert scene.model().mesh.gauge_refinement == 3.0
    assert scene.with_mesh(replace(scene.mesh, size_mm=0.5)).mesh.gauge_refinement == 3.0
    assert scene.as_dict()["mesh"]["gauge_refinement"] == 3.0


def test_a_forecast_counts_the_cells_around_gauges() -> None:
    finer = model(2.0, 4.0)
    expected, built = forecast(finer), build(finer)
    assert expected["cells"] == built.body.report.cells
    assert expected["dofs"] == built.body.stiffness.upper.shape[0]
