"""Presses that a comparison is made of: sections, widths, and their error bars."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.accuracy.estimate import compared, estimate
from finger3d.analyses.compare import cases
from finger3d.analyses.compare.cases import press_with_errors, resized, widened
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import FACTOR, companion
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.march.step_halving import last_step
from finger3d.results.comparison import FORCE
from finger3d.scene import load
from tests.scenes import SWEPT_FINGER, written


@pytest.fixture
def scene(tmp_path) -> Path:
    return written(tmp_path, SWEPT_FINGER)


@pytest.mark.parametrize("domain", ["plane-strain", "plane-stress"])
@pytest.mark.parametrize("nu", [0.3, 0.49])
def test_error_bars_hold_the_answer_of_a_fine_mesh(scene, domain, nu) -> None:
    model = load(scene, [f"model.domain={domain}", f"material.nu={nu}"]).model()
    fine = press_with_errors("fine", resized(model, 0.4))
    for size in (5.0, 3.0, 2.0):
        coarse = press_with_errors("coarse", resized(model, size))
        for key in (FORCE, "contact_length_mm"):
            # error bars claim a factor 2, see validation/error_bars.py
            assert abs(coarse.numbers[key] - fine.numbers[key]) <= 2.0 * coarse.errors[key], (size, key)
        assert coarse.errors[FORCE] < 0.003 * size * coarse.numbers[FORCE]


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_case_has_the_bars_of_a_press_beside_its_companion_mesh(scene, domain) -> None:
    model = load(scene, [f"model.domain={domain}"]).model()
    case = press_with_errors(domain, model)
    problem = build(model)
    frames = tuple(march(problem))
    beside = companion(problem)
    bars = compared(problem, frames[-1], beside, last_step(beside))
    main = {FORCE: "normal_force_N", "friction_sum_N_per_mm": "friction_sum_N", "gauge_g36": "gauge_g36"}
    main |= {"contact_length_mm": "contact_half_length_mm", "stick_length_mm": "stick_half_length_mm"}
    # the same problem but for the points that never touch: round-off apart, the error of the mesh is the very same
    found = estimate(problem, frames, numbers=lambda p, f: cases.quantities(p.points, f))
    for key, name in main.items():
        times = 2.0 if "length" in key else 1.0 if "gauge" in key else 1.0 / model.design.width_mm
        assert found.discretisation[key] == pytest.approx(times * bars[name], rel=1e-6), key
        assert case.errors[key] >= 0.999999 * found.discretisation[key], key
    assert set(case.errors) == set(case.numbers)


@pytest.mark.parametrize("width", [1.0, 20.0, 2000.0])
def test_other_widths_are_structured_and_have_room_for_the_companion(scene, width) -> None:
    wide = widened(load(scene, ["mesh.mesher=ftetwild"]).model(), width)
    assert (wide.design.width_mm, wide.mesh.mesher) == (width, "swept")
    assert wide.mesh.size_mm * FACTOR <= min(width, 50.0)
    assert wide.mesh.base_size_mm / wide.mesh.size_mm == pytest.approx(12.0 / 5.0)
