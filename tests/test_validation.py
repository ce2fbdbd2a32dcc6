"""Every study, quick: all its rows pass; and the committed results, full: all rows pass and the index is theirs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from validation._runner import Study, draw, kept_rows, studies, write_index

STUDIES = studies()

SLOW = (
    "error_bars", "calibration_z_scores", "benchmarks", "strain_to_friction", "paper_mesh", "press_release",
    "fig9_strains", "half_cylinder", "gallery", "triangulated_objects", "twisted_sphere", "increments",
    "object_curvature", "turned_scenes", "hard_cases", "fig14_readings", "embedded_gauge_study", "finger_search",
    "action_reaction", "rolling_cylinder", "meshers", "readings_within_tolerances", "friction_in_3d", "scaling",
    "effects_by_need", "cost_of_accuracy", "hertz", "bonded", "wide_finger", "gelsight_mini", "cost_forecast",
    "held_weights", "creep_of_a_hold", "friction_range", "what_each_effect_does", "identify_z_scores", "truth_cube",
    "random_presses", "effects_of_keys", "slip_warning", "solids4foam", "label_rate", "beside_ansys", "meunier",
    "press_with_friction", "sharp_profiles", "inclined_contact", "cattaneo_mindlin", "teeth_and_walls",
    "two_elastic_bodies", "limit_surface", "plane_strain_limit", "small_fingers",
)  # fmt: skip
"""Studies that take about four seconds or more in their quick form; `make test-all` runs them."""


def _cases() -> list[Any]:
    return [pytest.param(s, id=name, marks=[pytest.mark.slow] * (name in SLOW)) for name, s in STUDIES.items()]


@pytest.mark.parametrize("study", _cases())
def test_study_quick(study: Study, tmp_path: Path) -> None:
    result = study.run(quick=True)
    assert result.rows
    assert not [row for row in result.rows if not row.passed]
    for part in result.parts.values() if result.parts else [result]:
        if part.figure is not None:
            draw(part.figure, tmp_path / "figure.png")


def test_committed_results_pass_and_every_number_names_its_reference_and_why_its_tolerance_is_right() -> None:
    kept = {name: kept_rows(study.path.parent, study) for name, study in STUDIES.items()}
    assert not [name for name, rows in kept.items() if not rows], "no results: run python -m validation"
    assert not [(name, row) for name, rows in kept.items() for row in rows if not row.passed]
    assert not [name for name, study in STUDIES.items() if not study.question.endswith("?")]
    for row in (row for rows in kept.values() for row in rows):
        assert min(len(row.what), len(row.reference), len(row.reason)) > 1, row


def test_the_index_is_made_from_the_committed_results(tmp_path: Path) -> None:
    home = next(iter(STUDIES.values())).path.parent
    for name in ("results", "figures"):
        (tmp_path / name).symlink_to(home / name)
    write_index(tmp_path, STUDIES)
    assert (tmp_path / "README.md").read_text() == (home / "README.md").read_text()
