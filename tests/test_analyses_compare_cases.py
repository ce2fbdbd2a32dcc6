"""Presses that a comparison is made of: sections, widths, and their error bars."""

from __future__ import annotations

from pathlib import Path

import pytest

from finger3d.accuracy.estimate import estimate
from finger3d.analyses.compare import cases
from finger3d.analyses.compare.cases import press_with_errors, resized, widened
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.march.solve import march
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
    within = []
    for size in (5.0, 3.0, 2.0):
        coarse = press_with_errors("coarse", resized(model, size))
        for key in (FORCE, "contact_length_mm"):
            within.append(abs(coarse.numbers[key] - fine.numbers[key]) <= 2.0 * coarse.errors[key])
        assert coarse.errors[FORCE] < 0.003 * size * coarse.numbers[FORCE]
    assert sum(within) >= 5  # nine of ten errors are within two bars, see validation/error_bars.py


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_case_has_the_bars_of_a_press_beside_its_companion_meshes(scene, domain) -> None:
    model = load(scene, [f"model.domain={domain}"]).model()
    case = press_with_errors(domain, model)
    problem = build(model)
    frames = tuple(march(problem))
    # the same problem but for the points that never touch: round-off apart, the error of the mesh is the very same
    found = estimate(problem, frames, numbers=lambda p, f: cases.quantities(p.points, f))
    for key in (FORCE, "friction_sum_N_per_mm", "gauge_g36", "contact_length_mm", "stick_length_mm"):
        assert case.errors[key] >= 0.999999 * found.discretisation[key] > 0.0, key
    assert set(case.errors) == set(case.numbers)


@pytest.mark.parametrize("width", [1.0, 20.0, 2000.0])
def test_other_widths_are_structured_and_have_room_for_the_companion(scene, width) -> None:
    wide = widened(load(scene, ["mesh.mesher=ftetwild"]).model(), width)
    assert (wide.design.width_mm, wide.mesh.mesher) == (width, "swept")
    assert wide.mesh.size_mm * FACTOR <= min(width, 50.0)
    assert wide.mesh.base_size_mm / wide.mesh.size_mm == pytest.approx(12.0 / 5.0)
