"""Evaluations of designs, and how they are read from evaluations.jsonl."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from finger3d.analyses.optimise.task import OptimisationProblem
from finger3d.results.journal import Row, number_in


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of one design.

    Attributes
    ----------
    values : values of the free keys
    value : objective, NaN where it is undefined
    outcome : "converged", or the reason why there is no objective
    """

    values: tuple[float, ...]
    value: float
    outcome: str


def row_check(problem: OptimisationProblem) -> Callable[[object], str]:
    """Return a function that describes the mistake in a line of evaluations.jsonl, or returns an empty string."""

    def found(row: object) -> str:
        if not isinstance(row, dict):
            return "is no JSON object"
        values = row.get("values")
        if not isinstance(values, list) or len(values) != len(problem.free):
            return f"values must be {len(problem.free)} numbers"
        if not all(isinstance(v, float) for v in (*values, row.get("objective"))):
            return "values and objective must be numbers"
        return "" if isinstance(row.get("outcome"), str) else "outcome must be text"

    return found


def evaluation_of(row: Row) -> Evaluation:
    """Return the evaluation of a line of evaluations.jsonl."""
    values = row["values"]
    assert isinstance(values, list)
    return Evaluation(tuple(values), number_in(row, "objective"), str(row["outcome"]))
