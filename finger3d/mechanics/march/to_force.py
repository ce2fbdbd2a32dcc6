"""Where increments to a prescribed normal force begin their iteration: the depth expected, and a rough solution."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.state import ContactSolution
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.formulations import increment_to_force
from finger3d.mechanics.march.parts import Substep
from finger3d.mechanics.results.state import State
from finger3d.mechanics.small_strain.elastic import SmallStrain
from finger3d.objects import Move, ObjectPose

_CUTS = 3
"""Times that an increment which approaches a force is halved, at most."""

_NEAR = 0.2
"""Least ratio of a trial's force to the prescribed one, or back, from which the iteration to that begins."""

_SMALL_STRAIN = 2
"""Increments of small strain after which the depth of a force is near enough to begin with."""

_HERTZ = 2.0 / 3.0
"""Power of the force with which the depth grows under a ball (Hertz 1881)."""


def approached(
    problem: Problem,
    workspace: Workspace,
    start: tuple[State[Any], Float | None],
    move: Move,
    forces: tuple[float, float],
    cuts: int = _CUTS,
) -> tuple[Move, ContactSolution[State[Any]]] | None:
    """Approach a normal force at finite strain, to find where increments to that force may begin their iteration.

    Where the iteration does not converge, the increment is halved in the square root of the force, in proportion to
    which the depth grows under a cylinder, more or less.

    Parameters
    ----------
    start : state before, and (c, d) contact forces where the iteration begins, N
    move : to the depth that is expected
    forces : before and at the end, N

    Returns
    -------
    The whole motion, and a rough solution; None if there is none.
    """
    rough = workspace.rough()
    end = increment_to_force(problem, start, move, forces[1], rough)
    workspace.factorizations += rough.factorizations
    if end is not None or cuts == 0:
        return end
    middle = (0.5 * sum(math.sqrt(max(force, 0.0)) for force in forces)) ** 2
    half = approached(problem, workspace, start, move.cut(0.5)[0], (forces[0], middle), cuts - 1)
    if half is None:
        return None
    there, solution = half
    rest = Move(there.end, replace(move.end, depth_mm=there.at(2.0).depth_mm))
    end = approached(problem, workspace, (solution.state, None), rest, (middle, forces[1]), cuts - 1)
    return end and (Move(move.start, end[0].end), end[1])


def expected_depth(problem: Problem, last: Substep | None, move: Move, forces: tuple[float, float]) -> float:
    """Return the depth (mm) expected at a normal force: that of small strain where a body at finite strain begins it.

    Parameters
    ----------
    last : part of the increment before, if there is one
    move : to the depth of the leg's forecast
    forces : before and at the end, N
    """
    force, wanted = forces
    if force <= 0.0 and problem.model.finite_strain:
        return _at_small_strain(problem, move.end, wanted)
    if last is None:
        return move.end.depth_mm
    before = last.move.start.depth_mm, normal_force(problem, last.before)
    return by_power_law(before, (move.start.depth_mm, force), wanted)


def _at_small_strain(problem: Problem, pose: ObjectPose, wanted: float) -> float:
    """Return a depth (mm) near that of a normal force (N) in small strain, from increments to the pose and onwards."""
    small, depth, known = SmallStrain(), pose.depth_mm, (0.0, 0.0)
    workspace, rest = small.workspace(), small.start(problem)
    for _ in range(_SMALL_STRAIN):
        move = Move(problem.origin, replace(pose, depth_mm=depth))
        found = small.increment(problem, rest, move, None, workspace)
        now = depth, normal_force(problem, found.state)
        if not found.outcome.ok or now[1] <= 0.0:
            break
        depth, known = by_power_law(known, now, wanted), now
    return depth


def by_power_law(before: tuple[float, float], now: tuple[float, float], wanted: float) -> float:
    """Return the depth (mm) at a force, by the power of the force with which the depth has changed.

    The power is between 0 and 1, and that of Hertz's law where a force was none, or was the same.

    Parameters
    ----------
    before, now : depths (mm) and forces (N)
    wanted : N
    """
    (d0, f0), (d1, f1) = before, now
    if d1 <= 0.0 or f1 <= 0.0:
        return d1 + (d1 - d0)
    is_known = d0 > 0.0 and f0 > 0.0 and f0 != f1
    power = math.log(d1 / d0) / math.log(f1 / f0) if is_known else _HERTZ
    return float(d1 * (wanted / f1) ** min(max(power, 0.0), 1.0))


def is_near(force: float, wanted: float) -> bool:
    """Return whether an iteration to a force may begin at the end of an increment with another one (N)."""
    return _NEAR * wanted < force < wanted / _NEAR


def forces_on(problem: Problem, state: State[Any]) -> Float:
    """Return the normal force and the forces along x and z (3,) N, as in a `Load`."""
    x, y, z = problem.world_force(state.contact).sum(axis=0).tolist()
    return np.array([0.0 - y, x, z])


def normal_force(problem: Problem, state: State[Any]) -> float:
    """Return the normal force (N)."""
    return float(forces_on(problem, state)[0])
