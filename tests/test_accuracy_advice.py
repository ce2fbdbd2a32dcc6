"""Advice: changes by large deformation and by more increments, told where they are known, beside the same press."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.accuracy import large_deformation as module
from finger3d.accuracy.advice import advise, largest_principal_strain
from finger3d.accuracy.changes import Change, ChangeEstimate, changing_numbers, judged
from finger3d.accuracy.large_deformation import large_deformation
from finger3d.accuracy.more_increments import may_matter, more_increments
from finger3d.contact.friction import Coulomb
from finger3d.effects.kinetic_friction import Effect as KineticFriction
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import MeshOptions
from finger3d.report.press import press_page
from tests.models import half_cylinder, run
from tests.scenes import HALF_CYLINDER, changed, words

COARSE = 0.3
DEEP = changed(HALF_CYLINDER, depth_mm=1.0, size_mm=0.2)
"""Principal strains of about 0.2."""


def test_a_change_is_significant_if_its_interval_is_narrow_and_the_change_large() -> None:
    values = {"normal_force_N": 10.0, "friction_sum_N": 4.0, "gauge_a": 0.1, "gauge_b": -0.001, "gauge_c": np.nan}
    changes = {"normal_force_N": 3.0, "friction_sum_N": 0.03, "gauge_a": 0.01, "gauge_b": 0.0009, "gauge_c": 0.1}
    errors = {"normal_force_N": 0.9, "friction_sum_N": 0.001, "gauge_a": 0.004, "gauge_b": 1e-5, "gauge_c": 1e-3}
    found = judged(values, changes, errors)
    # a strain is compared with the largest strain, of which 0.0009 is less than a hundredth
    assert {name: change.significant for name, change in found.items()} == {
        "normal_force_N": True, "friction_sum_N": False, "gauge_a": False, "gauge_b": False,
    }  # fmt: skip
    assert (found["normal_force_N"].low, found["normal_force_N"].high) == (2.1, 3.9)
    # within a third of an estimate d lies what is within a factor of 1.5 of it: 2/3 d to 4/3 d
    assert found["normal_force_N"].low > 3.0 / 1.5
    assert not any(
        change.significant for change in judged({"gauge_a": 0.0}, {"gauge_a": 0.0}, {"gauge_a": 0.0}).values()
    )


def test_a_line_of_advice_tells_changes_with_their_intervals() -> None:
    changes = {
        "normal_force_N": Change(10.0, 1.9, 0.2, significant=True),
        "friction_sum_N": Change(4.0, 1.0, 0.9, significant=False),
        "gauge_a": Change(-0.02, 0.0058, 0.0004, significant=True),  # its magnitude falls
        "gauge_b": Change(0.001, 0.01, 0.001, significant=True),
        "gauge_c": Change(0.01, 0.001, 0.0001, significant=True),
        "gauge_d": Change(0.01, 0.002, 0.0001, significant=True),
    }
    model = half_cylinder(COARSE)
    large = advise(model, 0.2, ChangeEstimate(changes=changes))[0]
    assert large == (
        "large deformation would change the normal force by +19 % (+17 to +21 %), gauge_b by +0.01 (+0.009 to +0.011), "
        "gauge_a by -29 % (-31 to -27 %) and gauge_d by +20 % (+19 to +21 %): "
        "[effects.large_deformation] accounts for it"
    )
    one = ChangeEstimate(changes={"friction_sum_N": Change(4.0, -0.2, 0.04, significant=True)})
    more = advise(model, 0.02, increments=one)[0]
    assert more.startswith("more increments would change the friction sum by -5 % (-6 to -4 %): press.steps")


def test_without_a_known_change_no_number_is_told() -> None:
    model, unknown = half_cylinder(COARSE), {"normal_force_N": Change(10.0, 1.9, 2.0, significant=False)}
    for estimate in (None, ChangeEstimate(method="no estimate: why"), ChangeEstimate(changes=unknown)):
        line, *_ = advise(model, 0.2, estimate, estimate)
        assert line.startswith("principal strains reach 0.2, large for linear elasticity: [effects.large_deformation]")
        assert not any("would change" in line for line in advise(model, 0.06, estimate, estimate))
    assert not any("large_deformation" in line for line in advise(LargeDeformation().apply(model), 0.2))


def test_the_singular_corners_do_not_count_as_strain() -> None:
    strain = np.zeros((1000, 3, 3))
    strain[:, 0, 0] = -0.07
    strain[:5] *= 100.0
    assert largest_principal_strain(strain) == pytest.approx(0.07, rel=1e-12)


def test_the_change_by_large_deformation_is_that_of_the_press_at_large_deformation() -> None:
    model = half_cylinder(COARSE)
    problem, frames = run(model)
    estimate = large_deformation(problem, frames[-1], len(frames))
    truth = changing_numbers(*_ended(LargeDeformation().apply(model)))
    assert {"normal_force_N", "friction_sum_N"} <= set(estimate.significant)
    for name, change in estimate.significant.items():
        true = truth[name] - change.value
        assert 1.0 / 1.5 <= true / change.change <= 1.5  # what is claimed, validation/advice_against_truth.py
    assert "presses with and without it" in estimate.method


def _ended(model: Any) -> tuple[Any, Any]:
    problem, frames = run(model)
    return problem, frames[-1]


def test_no_change_is_told_where_none_can_be_estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, step = _ended(half_cylinder(COARSE, 2))
    filled = replace(problem, model=KineticFriction(ratio=0.5).apply(problem.model))
    papers = replace(problem, model=replace(problem.model, rule="paper"))
    legs = tuple(replace(leg, force_N=1.0) for leg in problem.model.legs)
    forced = replace(problem, model=replace(problem.model, legs=legs))
    whole, end = _ended(replace(half_cylinder(COARSE, 2), mesh=MeshOptions(5.0, 5.0, "swept")))
    for found, why in (
        (large_deformation(filled, step, 2), "kinetic_friction"),
        (large_deformation(papers, step, 2), "number of increments"),
        (large_deformation(whole, end, 2), "too coarse"),
        (large_deformation(forced, step, 2), "to a force"),
        (more_increments(filled, step, 2), "kinetic_friction"),
        (more_increments(papers, step, 2), "number of increments"),
        (more_increments(forced, step, 2), "to a force"),
        (more_increments(problem, step, 10**6), "would take more than"),
    ):
        assert found.changes == {}
        assert found.method.startswith("no estimate: ")
        assert why in found.method

    def fail(problem: Any) -> Any:
        raise Finger3dError("a run did not converge")

    monkeypatch.setattr(module, "last_step", fail)
    assert large_deformation(problem, step, 2).method == "no estimate: a run did not converge"


def test_the_change_by_more_increments_is_that_of_many() -> None:
    model = replace(half_cylinder(COARSE, 5), friction=Coulomb(0.5))
    problem, step = _ended(model)
    estimate = more_increments(problem, step, 5)
    many = changing_numbers(*_ended(replace(model, legs=tuple(replace(leg, steps=640) for leg in model.legs))))
    assert estimate.significant
    for name, change in estimate.significant.items():
        assert 1.0 / 1.5 <= (many[name] - change.value) / change.change <= 1.5
    auto = replace(problem, model=replace(model, legs=tuple(replace(leg, steps="auto") for leg in model.legs)))
    assert "chosen by their error" in more_increments(auto, step, 5).method


def test_more_increments_may_matter_from_a_hundredth() -> None:
    numbers = {"normal_force_N": 10.0, "gauge_a": 0.1, "gauge_b": 0.001}
    assert may_matter(numbers, {"normal_force_N": 0.11})
    assert may_matter(numbers, {"gauge_a": 0.0011})
    assert not may_matter(numbers, {"normal_force_N": 0.09, "gauge_b": 0.0009})  # of the largest strain
    assert not may_matter(numbers, {})


def test_a_press_tells_what_large_deformation_would_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(DEEP, encoding="utf-8")
    told = finger3d.press(scene, tmp_path / "told", figures=False).summary()
    found = json.loads((tmp_path / "told" / "summary.json").read_text(encoding="utf-8"))["large_deformation_estimate"]
    force = found["changes"]["normal_force_N"]
    assert set(force) == {"value", "change", "error"}
    assert force["value"] == told["steps"][-1]["normal_force_N"]
    line = next(text for text in told["advice"] if "[effects.large_deformation]" in text)
    assert f"normal force by {float(format(100.0 * force['change'] / force['value'], '.2g')):+g} % (" in line
    page = words(press_page(tmp_path / "told"))
    assert "What large deformation would change" in page
    assert f"normal_force_N {force['value']:.5g} {force['change']:.5g} {force['error']:.5g}" in page

    def forbidden(*_: Any) -> Any:
        raise AssertionError("estimated under --no-error")

    monkeypatch.setattr(module, "large_deformation", forbidden)
    alone = finger3d.press(scene, tmp_path / "alone", error=False).summary()
    assert alone["steps"] == told["steps"]  # to the last digit
    assert alone["large_deformation_estimate"] is None
    assert any(text.startswith("principal strains reach") for text in alone["advice"])
