"""What a press left out that would matter, with numbers: cheap estimates from its own result."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.contact.law import OPEN
from finger3d.history import Frame
from finger3d.objects.slope import slope_of
from finger3d.problem import Problem

Float = NDArray[np.float64]

_STRAIN = 0.1
_QUANTILE = 0.99  # the clamped corners are singular, their strain says nothing

# change of force by large_deformation over depth/height, Fig. 9 finger, nu = 0.45: validation/what_each_effect_does.py
_FINITE = {"plane-strain": 1.35, "plane-stress": 1.0, "solid": 1.0}

# errors of N equal increments, times N: validation/REFERENCES.md, 2.4 (line contact, nu = 0.3)
_DISSIPATION, _STICK = 7.0, 0.3
_ENOUGH = 50


def advise(problem: Problem, frame: Frame, strain: Float, free_increments: bool) -> list[str]:
    """Advice for a finished press.

    Parameters
    ----------
    frame : the last good one
    strain : (n, 3, 3) at the nodes
    free_increments : whether the increments were chosen by their error already
    """
    model = problem.model
    found = [] if "kinematics" in dict(model.filled) else [*_strain(problem, strain), *_slopes(problem, frame)]
    if not free_increments and model.friction.static > 0.0:
        found += _increments(model)
    return found + _width(model)


def _strain(problem: Problem, strain: Float) -> list[str]:
    level = float(np.quantile(np.abs(np.linalg.eigvalsh(strain)).max(axis=1), _QUANTILE))
    if level < _STRAIN:
        return []
    model = problem.model
    share = max(leg.depth_mm for leg in model.legs) / model.design.height_mm
    change = 100.0 * _FINITE[model.domain] * share
    return [
        f"strain reaches {level:.2g}: large_deformation would change the force by about {change:+.0f} % "
        f"(scaled from the Fig. 9 finger by depth/height = {share:.2g})"
    ]


def _slopes(problem: Problem, frame: Frame) -> list[str]:
    touching = frame.state.status != OPEN
    if not touching.any():
        return []
    x, z = problem.points.points[touching][:, 0], problem.points.points[touching][:, 2]
    slide = (frame.target.slide_x_mm, frame.target.slide_z_mm)
    text = slope_of(problem.model.object, problem.model.design.top, x, z, slide, problem.dim).advice
    return [text] if text else []


def _increments(model: Any) -> list[str]:
    counts = [leg.steps for leg in model.legs if isinstance(leg.steps, int)]
    if not counts or min(counts) >= _ENOUGH:
        return []
    n = min(counts)
    return [
        f"{n} equal increments leave the dissipation about {100.0 * _DISSIPATION / n:.0f} % high and the stick length "
        f"about {100.0 * _STICK / n:.0f} % low (error ~ 1/steps); steps = 'auto' chooses them by their error"
    ]


def _width(model: Any) -> list[str]:
    if model.domain == "solid":
        return []
    ratio = model.design.width_mm / model.design.height_mm
    return [f"a section stands for a finger of width/height = {ratio:.2g}: finger3d compare says by how much it errs"]
