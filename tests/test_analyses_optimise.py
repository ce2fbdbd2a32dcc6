"""Optimisation: the search for a design, and the places of gauges."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d._types import Float
from finger3d.analyses.calibrate.run import calibrated
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.gauge_places import Candidates, GaugeFields, Region, StrainField, objectives, search
from finger3d.analyses.optimise import OptimisationProblem, find_best, optimise, sensitivity
from finger3d.analyses.pressed_body import presses
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import Gauge
from finger3d.progress import QUIET
from finger3d.scene import load, tree
from finger3d.sensor.likelihood import ReadingEffects, prior
from tests.scenes import words
from tests.sensor_cases import NONE, scene

MUS = (0.1, 0.5, 1.0)


def test_sensitivity_is_the_least_slope_in_units_of_noise() -> None:
    # slopes 0.1/0.4 and 0.05/0.5 per mu, noise 1e-3
    mu = np.array(MUS)
    assert sensitivity(mu, np.array([0.0, 0.1, 0.15]), 1e-3) == pytest.approx(100.0)
    assert sensitivity(mu, np.array([0.0, -0.1, -0.15]), 1e-3) == pytest.approx(100.0)
    # it turns back: two mu share a strain
    assert sensitivity(mu, np.array([0.0, 0.1, 0.05]), 1e-3) == pytest.approx(-100.0)


# one body for all angles: refined around its gauge, each press would have another mesh
MESH = ["mesh.size_mm=4", "mesh.base_size_mm=16", "mesh.gauge_refinement=1"]
SETS = ["model.domain=plane-strain", *MESH, "press.steps=10"]
ANGLE = FreeKey("gauge.g36.angle_deg", 0.0, 90.0)


@pytest.fixture
def problem(root: Path) -> OptimisationProblem:
    path = root / "geometries" / "fig9.toml"
    return OptimisationProblem(tree.override(tree.read(path), SETS), (ANGLE,), path=path, mus=MUS, budget=12)


def pressed_sensitivity(model: Model, noise: float) -> float:
    """Sensitivity of the gauge in presses of a body of its own for every friction coefficient."""
    strain = []
    for mu in MUS:
        own = build(replace(model, friction=replace(model.friction, mu=mu)))
        strain.append(list(march(own))[-1].gauges["g36"])
    return sensitivity(np.array(MUS), np.array(strain), noise)


def test_gauges_are_searched_in_one_body_and_read_as_a_press_reads_them(problem, tmp_path) -> None:
    found = find_best(problem, tmp_path)
    assert found.bodies == 1
    assert len(found.evaluations) == 13
    assert found.best.value == max(e.value for e in found.evaluations) >= found.start.value
    assert found.best.value == pytest.approx(pressed_sensitivity(found.scene.model(), problem.noise), rel=1e-9)
    assert load(tmp_path / "best.toml").tables.gauge[0].angle_deg == found.best.values[0]


@pytest.mark.parametrize("bulk", [True, False])
def test_gauges_of_a_body_that_relaxes_are_read_as_a_press_reads_them(problem, bulk, tmp_path) -> None:
    """Ten time constants long, so that the instantaneous field is far from the one the press ends with."""
    visco = f"effects.viscosity={{prony = [[0.5, 0.1]], bulk = {str(bulk).lower()}}}"
    given = tree.override(problem.given, [*SETS, visco, "press.duration_s=1.0", "press.steps=4", "material.nu=0.45"])
    found = find_best(replace(problem, given=given, budget=1), tmp_path)
    assert found.bodies == 1
    assert found.best.value == pytest.approx(pressed_sensitivity(found.scene.model(), problem.noise), rel=1e-9)


def test_a_search_goes_on_with_what_is_kept_and_is_the_same_every_time(problem, tmp_path) -> None:
    whole = find_best(replace(problem, budget=10), tmp_path / "whole")
    first = find_best(replace(problem, budget=4), tmp_path / "parts")
    kept = tmp_path / "parts" / "evaluations.jsonl"
    torn = kept.read_text()
    kept.write_text(torn + '{"values": [12.5], "obj')
    second = find_best(replace(problem, budget=10), tmp_path / "parts")
    assert kept.read_text() == (tmp_path / "whole" / "evaluations.jsonl").read_text()
    assert [e.values for e in second.evaluations] == [e.values for e in whole.evaluations]
    assert second.evaluations[: len(first.evaluations)] == first.evaluations
    with pytest.raises(Finger3dError, match="task"):
        find_best(replace(problem, noise=1.0), tmp_path / "parts")


def test_keys_of_the_body_search_the_gauges_anew_in_every_body(problem, tmp_path) -> None:
    free = (FreeKey("finger.edge_height_mm", 30.0, 40.0), ANGLE)
    found = find_best(replace(problem, free=free, budget=2), tmp_path)
    assert 2 <= found.bodies <= 3
    assert len(found.evaluations) > 50


COARSE = ["model.domain=plane-strain", "mesh.size_mm=4", "mesh.base_size_mm=16", "press.steps=10"]


def test_a_design_that_cannot_be_built_is_a_line_with_its_reason(root: Path, tmp_path: Path) -> None:
    scene = root / "geometries" / "fig9.toml"
    found = optimise(scene, ["gauge.0.y_mm=40:60"], tmp_path, mus=(0.1, 0.5, 1.0), budget=8, overrides=COARSE)
    assert found.keys == ("gauge.0.y_mm",)
    with (tmp_path / "evaluations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert any("gauge.0.y_mm" in row["outcome"] for row in rows)
    assert found.best.outcome == "converged"
    assert json.loads((tmp_path / "design.json").read_text())["best"] == found.best.value
    page, failed = words(tmp_path / "report.html"), sum(row["outcome"] != "converged" for row in rows)
    assert f"objective (sensitivity) {found.best.value:.5g}" in page
    assert f"gauge.0.y_mm 40 60 {found.start.values[0]:.5g} {found.best.values[0]:.5g}" in page
    assert f"{failed} of {len(rows)} designs" in page
    assert (tmp_path / "design.png").read_bytes().startswith(b"\x89PNG")


FEW = {**NONE, "depth_mm": 0.1, "nu": 0.003, "gauge_x_mm": 0.3, "gauge_y_mm": 0.3, "gauge_angle_deg": 2.0}


@pytest.mark.parametrize("effects", [{}, {"large_deformation": {}}])
def test_a_field_reads_what_a_gauge_reads(effects: Any) -> None:
    model = scene(effects=effects).model()
    gauges = tuple(
        Gauge(f"g{i}", x, 30.0, angle=a) for i, (x, a) in enumerate(((-20.0, 0.3), (15.0, 2.0), (30.0, 0.0)))
    )
    problem = build(replace(model, gauges=gauges))
    frames = [p.frame for p in presses(problem, [0.2, 0.6])]
    field = StrainField.of_frames(problem, frames, (0.2, 0.6))
    for gauge in gauges:
        found = field.strain(np.array([gauge.middle]), np.array([gauge.angle]))[0, 0]
        assert found == pytest.approx([frame.gauges[gauge.name] for frame in frames], rel=1e-9)


def test_fields_judge_as_a_calibration_does() -> None:
    model = scene().model()
    gauges = tuple(Gauge(f"g{i}", x, 32.0, angle=a) for i, (x, a) in enumerate(((-25.0, 2.2), (25.0, 0.9))))
    mus = np.linspace(0.1, 0.7, 7)
    given = {name: sd for name, sd in FEW.items() if sd}
    fields = GaugeFields.of(model, mus, 1.5e-4, given, QUIET)
    joint, _ = calibrated(replace(model, gauges=gauges), ["g0", "g1"], mus, tolerances=FEW)
    for gauge, own in zip(gauges, joint.readings, strict=True):
        effects = fields.effects(np.array([gauge.middle]), np.array([gauge.angle]))
        strain = fields.nominal.strain(np.array([gauge.middle]), np.array([gauge.angle]))[0, 0]
        assert strain == pytest.approx(own.reading, rel=1e-9)
        assert effects.effects[0, :, 0] == pytest.approx(np.gradient(own.reading, mus), rel=1e-9)
        for tolerance in own.tolerances:
            if tolerance.name in fields.shared:
                column = 1 + list(fields.shared).index(tolerance.name)
                change = effects.effects[0, :, column]
                assert change == pytest.approx(tolerance.sd * tolerance.slope, rel=0.3, abs=2e-4)


PLACED_MUS = (0.1, 0.25, 0.4, 0.55, 0.7)


def test_the_first_gauge_is_the_best_of_all_candidates() -> None:
    fields = GaugeFields.of(scene().model(), PLACED_MUS, 1.5e-4, {"depth_mm": 0.1}, QUIET)
    region = Region((10.0, 40.0), (10.0, 30.0), (0.0, 0.0), (0.0, math.pi))
    candidates = Candidates.of(fields, region.grid()[0], region.angles())
    base = prior(1, 0.2)
    values = objectives(base, candidates)
    # one by one, by the definition of the information
    for i in np.random.default_rng(0).integers(0, len(values), 20):
        one = base + candidates.effects.fisher[i]
        assert values[i] == pytest.approx(np.mean([np.sqrt(np.linalg.inv(f)[0, 0]) for f in one]))


def peaked(points: Float, angles: Float) -> ReadingEffects:
    """Effects of gauges that tell mu best at x = y = 20 mm, in any direction."""
    slope = np.exp(-0.01 * np.sum((points - [20.0, 20.0, 0.0]) ** 2, axis=1))
    effects = np.broadcast_to(slope[:, None, None, None], (len(points), len(angles), 3, 1)).reshape(-1, 3, 1)
    return ReadingEffects(effects.copy(), np.ones((len(effects), 3)))


@pytest.mark.parametrize(("spacing", "least", "largest"), [(0.0, 0.0, 0.1), (3.0, 3.0, 4.5)])
def test_gauges_do_not_overlap(spacing: float, least: float, largest: float) -> None:
    """Three of which each is best at one place keep their distance, and lie as close to it as that allows."""
    fields: Any = SimpleNamespace(mus=(0.1, 0.5, 1.0), shared=(), effects=peaked)
    found, _ = search(fields, Region((10.0, 30.0), (10.0, 30.0), (0.0, 0.0), (0.0, 1.0)), 3, QUIET, spacing)
    places = [gauge.place for gauge in found.gauges]
    apart = [float(np.linalg.norm(a - b)) for i, a in enumerate(places) for b in places[:i]]
    assert least * (1.0 - 1e-9) <= min(apart)
    assert max(apart) < largest


def test_more_gauges_tell_more(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    found = finger3d.place_gauges(path, 2, tmp_path / "out", mus=PLACED_MUS, tolerances=FEW)
    data = json.loads((tmp_path / "out" / "gauges.json").read_text())
    first, second = data["gauges"]
    assert second["mean_mu_sd_with_those_before"] < first["mean_mu_sd_with_those_before"]
    assert found.found.objective == pytest.approx(data["mean_mu_sd"])
    assert math.dist(*([g[f"{axis}_mm"] for axis in "xyz"] for g in data["gauges"])) >= 3.0 - 1e-9
    for gauge in found.scene.model().gauges:
        assert abs(gauge.x_mm) < 50.0
        assert 0.0 < gauge.y_mm < 50.0
    # no single place of the grid is better than the polished pair with its partner
    for (_, values), gauges in zip(found.maps, found.found.gauges, strict=True):
        assert found.found.objective <= values.min() * 1.002
        assert np.isfinite(gauges.place).all()
    assert {"map.png", "map.csv", "best.toml", "report.html"} <= {p.name for p in (tmp_path / "out").iterdir()}


def test_bounds_of_the_region_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene().to_toml())
    free = {"gauge.x_mm": (5.0, 20.0), "gauge.y_mm": (8.0, 25.0), "gauge.angle_deg": (20.0, 60.0)}
    found = finger3d.place_gauges(path, 1, tmp_path / "out", free, PLACED_MUS, tolerances=FEW)
    (gauge,) = found.scene.model().gauges
    assert 5.0 <= gauge.x_mm <= 20.0
    assert 8.0 <= gauge.y_mm <= 25.0
    assert 20.0 - 1e-6 <= math.degrees(gauge.angle) <= 60.0 + 1e-6
