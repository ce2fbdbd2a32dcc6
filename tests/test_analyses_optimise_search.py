"""Design search: what is refused, what is judged, and that gauges cost no body."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise.run import find_best
from finger3d.analyses.optimise.task import OptimisationProblem, sensitivity
from finger3d.errors import Finger3dError
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.scene import load, tree
from tests.sensor_cases import objective_table

# one body for all angles: refined around its gauge, each press would have another mesh
MESH = ["mesh.size_mm=4", "mesh.base_size_mm=16", "mesh.gauge_refinement=1"]
SETS = ["model.domain=plane-strain", *MESH, "press.steps=10"]
ANGLE = FreeKey("gauge.g36.angle_deg", 0.0, 90.0)
MUS = (0.1, 0.5, 1.0)


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
    return sensitivity(replace(objective_table(strain), noise=noise))


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
