"""Generalised coordinates of a rigid object, and the generalised forces that do work with them.

The coordinates are the depth, the slides along x and z, the turns about x, y and z, and the rise of an object between
two fingers; with them go the normal force, the forces along x and z that are applied to the object, the moments about
its reference point, and the force along y.  In equilibrium the forces applied to the object are those of the contact on
the finger.  Between two fingers the normal force is the sum of both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from finger3d._types import Float, Int
from finger3d.contact.friction import SLIP, STICK
from finger3d.contact.resultants import ForceConditions
from finger3d.contact.state import ContactSolution, ContactState
from finger3d.errors import Outcome
from finger3d.fem.mesh import in_space
from finger3d.mechanics.discretise.problem import Problem
from finger3d.objects import ObjectPose
from finger3d.objects.rigid import rotation

_PLACES = np.array([0, 1, 2, 4, 5, 6, 7])
"""Places of the coordinates among those of an `ObjectPose`."""

COORDINATES = range(len(_PLACES))
RISE = 6
"""Number of the coordinate that only an object between two fingers has."""

_DIRECTIONS = {0: (0.0, -1.0, 0.0), 1: (1.0, 0.0, 0.0), 2: (0.0, 0.0, 1.0), RISE: (0.0, 1.0, 0.0)}
"""Motion of the object by the coordinates that do not turn it."""

_ACROSS = {"x": (1, 4, 5), "z": (2, 3, 4)}
"""Coordinates whose forces change sign at a symmetry plane."""

_MOTIONS = "closes", *(f"slides along {axis}" for axis in "xz"), *(f"turns about {axis}" for axis in "xyz"), "rises"
"""What the object does as a coordinate changes."""

_AT_LIMIT = 1e-9
"""Relative distance from the largest force that friction transmits at which it counts as reached."""

_UNBALANCED = 0.1
"""Relative error of the normal force up to which the largest tangential force is in proportion to it."""

_MUCH = 1.1
"""Largest tangential force that a contact holds over the one that it slips under, beyond which a slope drives it."""


@dataclass(frozen=True)
class GeneralisedForces:
    """Forces that are prescribed in place of some coordinates.

    Attributes
    ----------
    numbers : (k,) of the free coordinates, among depth, slides along x, z, turns about x, y, z, and rise
    values : (k,) N and N mm, on the whole finger
    size : largest of all forces that act, N, to which errors are relative
    asked : normal and tangential force at the end of the leg, N
    """

    numbers: tuple[int, ...]
    values: Float
    size: float
    asked: tuple[float, float] = (0.0, 0.0)

    def __str__(self) -> str:
        units = ("N" if number in _DIRECTIONS else "N mm" for number in self.numbers)
        return ", ".join(f"{value:.5g} {unit}" for value, unit in zip(self.values, units, strict=True))

    @property
    def places(self) -> Int:
        """Places (k,) of the free coordinates among those of an `ObjectPose`."""
        return _PLACES[list(self.numbers)]

    def coordinates(self, pose: ObjectPose) -> Float:
        """Return the free coordinates (k,) of a pose, mm and rad."""
        return np.asarray(pose.coordinates[self.places])

    def moved(self, pose: ObjectPose, change: Float) -> ObjectPose:
        """Return a pose with the free coordinates changed."""
        return pose.changed(self.places, change)

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
        far, arm = reach
        step = far / self._arms(arm)
        values, scale = self.values / images, self.scale(arm) / images
        approach = step * (np.array(self.numbers) == 0)
        return ForceConditions(motion, resultant, values, scale, step, tolerance, approach)

    def scale(self, arm: float) -> Float:
        """Return the magnitudes (k,) to which errors are relative: the largest force, and its moment at an arm (mm)."""
        return self.size * self._arms(arm)

    def _arms(self, arm: float) -> Float:
        return np.array([1.0 if number in _DIRECTIONS else arm for number in self.numbers])

    def checked(
        self, solution: ContactSolution[ContactState], bases: Float, images: float, lacking: Float | None
    ) -> ContactSolution[ContactState]:
        """Return a solution of contact, as not held if all of it slips and cannot transmit the tangential forces.

        Parameters
        ----------
        bases : (c, d, d) directions of the points
        images : number of mirror images of the points that make up the whole finger
        lacking : (k,) forces over their magnitudes to which no motion leads, if there are any
        """
        status = solution.state.status
        if not solution.outcome.ok or (status == STICK).any() or not (status == SLIP).any():
            return solution
        detail = self._slips_under(solution.state.force, bases, images, lacking is not None)
        if not detail and lacking is not None and RISE in self.numbers:
            detail = f"the object {_MOTIONS[self.numbers[int(np.abs(lacking).argmax())]]}"
        return replace(solution, outcome=Outcome.SLIPS, detail=detail) if detail else solution

    def _slips_under(self, force: Float, bases: Float, images: float, slips: bool) -> str:
        """Say how much a contact with forces (c, d) N holds that slips as a whole; nothing if that is enough."""
        wanted = np.zeros(3)
        for number, value in zip(self.numbers, self.values, strict=True):
            wanted += value * np.array(_DIRECTIONS[number]) if number in (1, 2) else 0.0
        now = float(np.linalg.norm(wanted))
        asked = self.asked[1]
        if not now or not asked:
            return ""
        along = bases @ (wanted / now)[: bases.shape[2]]
        friction, across = (np.linalg.norm(one[:, 1:], axis=1) for one in (force, along))
        held = images * float(friction @ across + force[:, 0] @ along[:, 0])
        if 0 in self.numbers:
            pressed = np.where(bases[:, 0, 1] > 0.0, 1.0, -1.0) * np.einsum("ca,ca->c", force, bases[:, :, 1])
            ratio = self.values[self.numbers.index(0)] / (images * pressed.sum())
            if abs(ratio - 1.0) > _UNBALANCED:  # an iterate far from equilibrium tells nothing
                return ""
            held *= ratio
        if held >= now * (1.0 - _AT_LIMIT) and not slips:
            return ""
        if held <= 0.0:
            return f"{asked:.6g} N asked; the contact pushes {-held:.3g} N the other way"
        axis = int(np.abs(wanted).argmax())
        sign = "-" if wanted[axis] < 0.0 else ""
        moves = f"the object slides along {sign}{'xyz'[axis]}; " if RISE in self.numbers else ""
        most = f"{moves}{asked:.6g} N asked; the contact holds at most {held:.9g} N, "
        slides = held > _MUCH * asked
        return most + ("but slides down its slope under less" if slides else f"{100.0 * held / asked:.4g} % of it")


def reference_point(problem: Problem, pose: ObjectPose) -> Float:
    """Return the point (3,) mm about which the object turns: between two fingers its centre of mass."""
    obj, second = problem.model.object, problem.system.second
    first = np.array([obj.x_mm, problem.system.first_contact_mm, obj.z_mm]) if second is None else second.centre
    return np.asarray(first + pose.displacement)


def motions(problem: Problem, pose: ObjectPose, points: Float, numbers: Sequence[int]) -> Float:
    """Return the displacement (n, d, k) of the object's material at points (n, d) by each coordinate."""
    last = rotation(0.0, 0.0, pose.turn_z)
    axes = np.array([rotation(0.0, pose.turn_y, pose.turn_z)[:, 0], last[:, 1], [0.0, 0.0, 1.0]])
    return _fields(problem, pose, points, numbers, axes)


def resultants(problem: Problem, pose: ObjectPose, points: Float, numbers: Sequence[int]) -> Float:
    """Return the fields v (n, d, k) by which forces f (n, d) at points (n, d) have the generalised forces sum(f v)."""
    return _fields(problem, pose, points, numbers, np.eye(3))


def _fields(problem: Problem, pose: ObjectPose, points: Float, numbers: Sequence[int], axes: Float) -> Float:
    """Return the motions of points (n, d) in a body that turns about axes (3, 3) through its reference point."""
    d, placed = points.shape[1], problem.placed(pose)
    arm = in_space(placed.brought_together(points)) - reference_point(problem, pose)
    found = [
        np.tile(_DIRECTIONS[j], (len(arm), 1)) if j in _DIRECTIONS else np.cross(axes[j - 3], arm) for j in numbers
    ]
    if placed.second is not None and 0 in numbers:  # which closes from the other side
        found[list(numbers).index(0)][placed.of_second(points)] *= -1.0
    return np.stack(found, axis=2)[:, :d]


def forces_on(problem: Problem, loads: tuple[Float, Float], pose: ObjectPose) -> Float:
    """Return the generalised forces (7,), N and N mm, of the contact on the whole finger.

    Parameters
    ----------
    loads : places (n, d) mm of the contact forces on the part, and these (n, d) N
    """
    places, force = loads
    values = np.einsum("nk,nkj->j", force, resultants(problem, pose, places, COORDINATES))
    for axis in problem.axes:
        values *= np.where(np.isin(COORDINATES, _ACROSS[axis]), 0.0, 2.0)
    return np.asarray(values)
