"""Search along derivatives: a known shape is found within few designs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from finger3d._types import Float
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.optimise import run
from finger3d.analyses.optimise.gradient import LinearTable, climb
from finger3d.analyses.optimise.run import find_best
from finger3d.analyses.optimise.task import GRADIENT, OptimisationProblem
from finger3d.errors import Finger3dError
from finger3d.scene import tree
from tests.sensor_cases import objective_table

SETS = ["model.domain=plane-strain", "mesh.size_mm=4", "mesh.base_size_mm=16", "press.steps=10", "press.depth_mm=6"]
SHAPE = (FreeKey("finger.edge_height_mm", 30.0, 42.0), FreeKey("finger.radius_mm", 80.0, 160.0))
KNOWN = (34.2, 120.0)

NEAREST = """
def objective(table):
    step = table.steps[-1]
    return -max(abs(step["normal_force_N"] / {force!r} - 1.0), abs(table.strain["g36"][0] / {strain!r} - 1.0))
"""


@pytest.fixture
def problem(root: Path) -> OptimisationProblem:
    path = root / "geometries" / "fig9.toml"
    given = tree.override(tree.read(path), [*SETS, "gauge.0.x_mm=20", "gauge.0.y_mm=25"])
    return OptimisationProblem(given, SHAPE, path=path, mus=(0.1, 0.5), budget=14, method=GRADIENT)


def test_a_shape_is_found_within_fifteen_designs(problem: OptimisationProblem, tmp_path: Path) -> None:
    """The objective has a kink at its largest value, 0, at the shape whose force and strain are asked for."""
    read: list[tuple[float, float]] = []
    pressed = replace(problem, free=tuple(FreeKey(f.key, v, v + 1e-9) for f, v in zip(SHAPE, KNOWN, strict=True)))

    def note(table: object) -> float:
        read.append((table.steps[-1]["normal_force_N"], float(table.strain["g36"][0])))  # type: ignore[attr-defined]
        return 0.0

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run, "objective_of", lambda _: note)
        find_best(replace(pressed, budget=1), tmp_path / "known")
    (force, strain), *_ = read
    objective = tmp_path / "nearest.py"
    objective.write_text(NEAREST.format(force=force, strain=strain))
    found = find_best(replace(problem, objective=str(objective)), tmp_path / "search")
    assert len(found.evaluations) <= 15
    assert found.bodies <= 15
    assert found.start.value < -0.03
    # within the foretold rise at which the search ends, and what linear numbers leave of the last step
    assert found.best.value > -1e-3
    assert found.best.values == pytest.approx(KNOWN, rel=0.02)


def test_a_key_without_a_derivative_is_named(problem: OptimisationProblem, tmp_path: Path) -> None:
    free = (FreeKey("mesh.base_size_mm", 14.0, 16.0),)
    with pytest.raises(Finger3dError, match=r"gradient: mesh\.base_size_mm: numbers have no derivative by it"):
        find_best(replace(problem, free=free), tmp_path)


def test_numbers_of_a_table_are_linear_in_the_keys() -> None:
    table = replace(objective_table([1.0, 2.0], (0.1, 0.5)), steps=({"normal_force_N": 5.0}, {"normal_force_N": 6.0}))
    slopes = [
        [{"gauge_g": 1.0, "normal_force_N": 0.5, "other": 1.0}, {"gauge_g": 10.0, "normal_force_N": 0.0}],
        [{"gauge_g": 2.0, "normal_force_N": 1.0}, {"gauge_g": 20.0, "normal_force_N": 0.0}],
    ]
    moved = LinearTable(table, slopes).at(np.array([0.1, -0.01]))
    assert moved.strain["g"] == pytest.approx([1.0 + 0.1 - 0.1, 2.0 + 0.2 - 0.2])
    assert [step["normal_force_N"] for step in moved.steps] == pytest.approx([5.05, 6.1])


def test_the_least_of_two_numbers_is_largest_at_their_kink() -> None:
    """min(x, 2 - x^2) is largest at x = 1; a step is shortened where the number bends too much."""
    tried: list[float] = []

    def strain_at(x: float) -> list[float]:
        return [x, 2.0 - x**2]

    def value(x: Float) -> float:
        tried.append(float(x[0]))
        return min(strain_at(x[0]))

    def linear(x: Float) -> LinearTable:
        slopes = [[{"gauge_g": 1.0}], [{"gauge_g": -2.0 * x[0]}]]
        return LinearTable(replace(objective_table(strain_at(x[0]), (0.1, 0.5)), steps=({}, {})), slopes)

    def largest(function: Callable[[Float], float], low: Float, high: Float) -> Float:
        grid = np.linspace(low[0], high[0], 20001)
        return np.array([grid[int(np.argmax([function(np.array([x])) for x in grid]))]])

    start, ends = np.array([-1.5]), (np.array([-2.0]), np.array([2.0]))
    climb(start, value(start), ends, value, linear, lambda table: float(table.strain["g"].min()), largest)
    assert max(min(strain_at(x)) for x in tried) == pytest.approx(1.0, abs=2e-3)
    assert len(tried) < 10
