"""Advice: neglected effects that would change the results of a press significantly."""

from __future__ import annotations

import numpy as np

from finger3d._types import Float
from finger3d.accuracy.changes import Change, ChangeEstimate, two_digits
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import of_kind

_LARGE_STRAIN = 0.1
"""Principal strain from which large deformation is advised without an estimate."""

_QUANTILE = 0.99  # leaves out the clamped corners, where the strain is singular

_MOST_GAUGES = 3
"""Gauges that a line of advice names, those that change most."""

_NAMES = {"normal_force_N": "the normal force", "friction_sum_N": "the friction sum"}


def largest_principal_strain(strain: Float) -> float:
    """Return the largest principal strain of nodal strains (n, 3, 3), without the singular corners."""
    return float(np.quantile(np.abs(np.linalg.eigvalsh(strain)).max(axis=1), _QUANTILE))


def advise(model: Model, strain: float, large: ChangeEstimate | None = None) -> list[str]:
    """Return lines of advice for a finished press.

    Parameters
    ----------
    strain : largest principal strain
    large : what large deformation would change, if it was estimated
    """
    out = []
    if not model.finite_strain:
        if large and (said := _changes(large.significant, {c.key for c in of_kind(model.columns, "gauge")})):
            out.append(f"large deformation would change {said}: switch on [effects.large_deformation]")
        elif strain >= _LARGE_STRAIN:
            out.append(
                f"principal strains reach {strain:.2g}, large for linear elasticity: switch on "
                "[effects.large_deformation]"
            )
    return out + _width(model)


def _changes(changes: dict[str, Change], gauges: set[str]) -> str:
    """Return forces and the gauges that change most, each with its change and the interval of the change."""
    forces = [name for name in changes if name in _NAMES]
    strains = sorted(gauges & set(changes), key=lambda name: -abs(changes[name].change))
    if not (forces or strains):
        return ""
    said = [f"{_NAMES.get(name, name)} by {_change(changes[name])}" for name in forces + strains[:_MOST_GAUGES]]
    return " and ".join(part for part in (", ".join(said[:-1]), said[-1]) if part)


def _change(change: Change) -> str:
    """Return a change and its interval: relative to the number, or absolute where it is larger than the number."""
    if abs(change.change) > abs(change.value):
        return f"{change.change:+.2g} ({change.low:+.2g} to {change.high:+.2g})"
    ends = sorted((change.low / change.value, change.high / change.value))
    middle, low, high = (two_digits(100.0 * x) for x in (change.change / change.value, *ends))
    return f"{middle} % ({low} to {high} %)"


def _width(model: Model) -> list[str]:
    if model.domain == "solid":
        return []
    ratio = model.design.width_mm / model.design.height_mm
    return [f"a section stands for a finger of width/height = {ratio:.2g}: finger3d compare says by how much it errs"]
