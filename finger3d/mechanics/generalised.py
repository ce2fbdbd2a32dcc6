"""Generalised coordinates of a rigid object, and the generalised forces that do work with them.

The coordinates are the depth, the slides along x and z and the turns about x, y and z; with them go the normal force,
the forces along x and z that are applied to the object, and the moments about its reference point.  In equilibrium the
forces applied to the object are those of the contact on the finger.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import SLIP, STICK
from finger3d.contact.rules import ForceConditions
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.results.state import State
from finger3d.objects import ObjectPose
from finger3d.objects.rigid import rotation

_PLACES = np.array([0, 1, 2, 4, 5, 6])
"""Places of the coordinates among those of an `ObjectPose`."""

_DIRECTIONS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Motion of the object by the first three coordinates."""


_AT_LIMIT = 1e-9
"""Relative distance from the largest force that friction transmits at which it counts as reached."""

_MUCH = 1.1
"""Largest tangential force that a contact holds over the one that it slips under, beyond which a slope drives it."""


@dataclass(frozen=True)
class GeneralisedForces:
    """Forces that are prescribed in place of some coordinates.

    Attributes
    ----------
    numbers : (k,) of the free coordinates, among depth, slides along x, z and turns about x, y, z
    values : (k,) N and N mm, on the whole finger
    size : largest of all forces that act, N, to which errors are relative
    asked : normal and tangential force at the end of the leg, N
    """

    numbers: tuple[int, ...]
    values: Float
    size: float
    asked: tuple[float, float] = (0.0, 0.0)

    def __str__(self) -> str:
        units = ("N" if number < 3 else "N mm" for number in self.numbers)
        return ", ".join(f"{value:.5g} {unit}" for value, unit in zip(self.values, units, strict=True))

    def coordinates(self, pose: ObjectPose) -> Float:
        """Return the free coordinates (k,) of a pose, mm and rad."""
        return np.asarray(pose.coordinates[_PLACES[list(self.numbers)]])

    def moved(self, pose: ObjectPose, change: Float) -> ObjectPose:
        """Return a pose with the free coordinates changed."""
        return pose.changed(_PLACES[list(self.numbers)], change)

    def placed(self, pose: ObjectPose, coordinates: Float) -> ObjectPose:
        """Return a pose with given free coordinates (k,)."""
        return self.moved(pose, coordinates - self.coordinates(pose))

    def conditions(
        self, motion: Float, resultant: Float, images: float, reach: tuple[float, float], tolerance: float
    ) -> ForceConditions:
        """Return the conditions on the contact forces of a part of the finger.

        Parameters
        ----------
        motion, resultant : (c d, k), see `ForceConditions`
        images : number of mirror images of the part that make up the whole finger
        reach : mm, largest motion of a point in an iteration, and its arm about the axes of the turns
        """
        (far, arm), numbers = reach, np.array(self.numbers)
        step = far / np.where(numbers > 2, arm, 1.0)
        values, scale = self.values / images, self.scale(arm) / images
        return ForceConditions(motion, resultant, values, scale, step, tolerance, approach=step * (numbers == 0))

    def scale(self, arm: float) -> Float:
        """Return the magnitudes (k,) to which errors are relative: the largest force, and its moment at an arm (mm)."""
        return self.size * np.where(np.array(self.numbers) > 2, arm, 1.0)

    def checked(
        self, solution: ContactSolution[ContactState], bases: Float, images: float, slips: bool
    ) -> ContactSolution[ContactState]:
        """Return a solution of contact, as not held if all of it slips and cannot transmit the tangential forces.

        Parameters
        ----------
        bases : (c, d, d) directions of the points
        images : number of mirror images of the points that make up the whole finger
        slips : whether no motion leads to the forces
        """
        status = solution.state.status
        if not solution.outcome.ok or (status == STICK).any() or not (status == SLIP).any():
            return solution
        detail = self._slips_under(solution.state.force, bases, images, slips)
        return replace(solution, outcome=Outcome.SLIPS, detail=detail) if detail else solution

    def _slips_under(self, force: Float, bases: Float, images: float, slips: bool) -> str:
        """Say how much a contact with forces (c, d) N holds that slips as a whole; nothing if that is enough."""
        wanted = np.zeros(3)
        for number, value in zip(self.numbers, self.values, strict=True):
            wanted += value * _DIRECTIONS[number] if number in (1, 2) else 0.0
        now = float(np.linalg.norm(wanted))
        asked = self.asked[1]
        if not now or not asked:
            return ""
        along = bases @ (wanted / now)[: bases.shape[2]]
        friction, across = (np.linalg.norm(one[:, 1:], axis=1) for one in (force, along))
        held = images * float(friction @ across + force[:, 0] @ along[:, 0])
        if 0 in self.numbers:
            held *= self.values[self.numbers.index(0)] / -(images * np.einsum("ca,ca->", force, bases[:, :, 1]))
        if held >= now * (1.0 - _AT_LIMIT) and not slips:
            return ""
        if held <= 0.0:
            return f"{asked:.6g} N asked; the contact pushes {-held:.3g} N the other way"
        most = f"{asked:.6g} N asked; the contact holds at most {held:.9g} N, "
        slides = held > _MUCH * asked
        return most + ("but slides down its slope under less" if slides else f"{100.0 * held / asked:.4g} % of it")


def reference_point(problem: Problem, pose: ObjectPose) -> Float:
    """Return the point (3,) mm about which the object turns."""
    obj = problem.model.object
    return np.array([obj.x_mm, problem.system.first_contact_mm, obj.z_mm]) + pose.displacement


def motions(problem: Problem, pose: ObjectPose, points: Float, numbers: tuple[int, ...]) -> Float:
    """Return the displacement (n, d, k) of the object's material at points (n, d) by each coordinate."""
    last = rotation(0.0, 0.0, pose.turn_z)
    axes = np.array([rotation(0.0, pose.turn_y, pose.turn_z)[:, 0], last[:, 1], [0.0, 0.0, 1.0]])
    return _fields(reference_point(problem, pose), points, numbers, axes)


def resultants(problem: Problem, pose: ObjectPose, points: Float, numbers: tuple[int, ...]) -> Float:
    """Return the fields v (n, d, k) by which forces f (n, d) at points (n, d) have the generalised forces sum(f v)."""
    return _fields(reference_point(problem, pose), points, numbers, np.eye(3))


def _fields(reference: Float, points: Float, numbers: tuple[int, ...], axes: Float) -> Float:
    d = points.shape[1]
    arm = np.zeros((len(points), 3))
    arm[:, :d] = points
    arm -= reference
    found = [np.broadcast_to(_DIRECTIONS[j], arm.shape) if j < 3 else np.cross(axes[j - 3], arm) for j in numbers]
    return np.stack(found, axis=2)[:, :d]


def forces_on(problem: Problem, state: State[Any], moment: Float, pose: ObjectPose) -> Float:
    """Return the generalised forces (6,), N and N mm, of the contact on the whole finger.

    Parameters
    ----------
    moment : (3,) N mm, of the contact on the part about the middle of the base
    """
    force = problem.world_force(state.contact).sum(axis=0)
    moment = problem.symmetry.total_moment(moment) - np.cross(reference_point(problem, pose), force)
    return np.array([0.0 - force[1], force[0], force[2], *moment])
