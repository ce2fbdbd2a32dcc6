"""Two fingers of one design that face each other across a rigid object: the press of both at once.

The second finger is the mirror image of the first at a horizontal plane, and comes down as the first would come up, so
that both are one body of two pieces.  Its results are those that it has in a frame of its own, in which it stands on
its base like the first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import elasticity_of
from finger3d.fem.mesh import Mesh, reflected, side_by_side
from finger3d.fem.surface import BoundarySurface, points_at
from finger3d.mechanics.discretise.problem import ContactSystem, Problem, free_surface
from finger3d.mechanics.discretise.symmetry import held_dofs
from finger3d.mechanics.history import State
from finger3d.objects import ObjectPose, SecondFinger

FINGERS = "lower", "upper"
"""Names of both fingers."""

_MIRRORED = np.array([1.0, -1.0, 1.0])
"""Factors of a vector's components in the mirror image of a finger."""

_APART = 3.0
"""Distance between both bases in the mesh, over the height of a finger."""


@dataclass(frozen=True)
class Grip:
    """Two fingers and the object between them.

    Attributes
    ----------
    fingers : each as if it stood alone, in its own frame
    second : the second finger in the mesh of both
    apart_mm : distance of both bases at first touch
    touched : (3,) mm from the centre of mass to where the object touches each finger first
    """

    fingers: tuple[Problem, Problem]
    second: SecondFinger
    apart_mm: float
    touched: tuple[Float, Float]

    @classmethod
    def of(cls, finger: Problem) -> Grip:
        """Return the grip by two fingers of which this is the first."""
        obj, model, touch = finger.model.object, finger.model, finger.system.first_contact_mm
        initial, lowest = obj.initial_rotation, np.array([obj.x_mm, touch, obj.z_mm])
        above = (initial @ (own - obj.lowest_point(initial)) for own in (obj.highest_point, obj.middle))
        top, middle = (lowest + one for one in above)
        opposite = obj.mirrored(top[0], top[2])
        centre = middle + np.array(model.centre_of_mass_mm)
        other = replace(finger, model=replace(model, object=opposite))
        other_touch = other.model.first_contact.first_contact_mm
        other = replace(other, system=replace(other.system, first_contact_mm=other_touch))
        apart, base = top[1] + other_touch, _APART * model.design.height_mm + top[1] - touch
        second = SecondFinger(0.5 * base, base - apart, centre)
        return cls((finger, other), second, apart, (lowest - centre, top - centre))

    @cached_property
    def problem(self) -> Problem:
        """Both fingers at once, without readings."""
        return _both(self.fingers[0], self.second.lowered_mm + self.apart_mm, self.second)

    def seen(self, number: int, pose: ObjectPose, state: State[Any]) -> tuple[ObjectPose, State[Any]]:
        """Return the pose of the object and a state of both fingers as one finger, 0 or 1, has them in its frame."""
        dim = self.fingers[0].dim
        flip = _MIRRORED[:dim] if number else np.ones(dim)
        moved = pose.turn @ self.touched[number] - self.touched[number]
        turns = pose.turns if not number else (-pose.turn_x, pose.turn_y, -pose.turn_z)
        rise = (pose.rise_mm + moved[1]) * (1.0 if number else -1.0)
        slides = pose.slide_x_mm + moved[0], pose.slide_z_mm + moved[2]
        own = ObjectPose(pose.depth_mm + rise, *slides, pose.time_s, *turns)
        points = np.split(np.arange(len(state.contact.gap)), 2)[number]
        contact = state.contact.of_points(points)
        if isinstance(state.body, np.ndarray):  # the displacement of the points, in small strain
            body = state.body[points] * flip
        else:
            size = self.problem.mesh.points.size
            u, pressures = (np.split(one, 2)[number] for one in np.split(state.body.unknowns, [size]))
            own_unknowns = np.concatenate([(u.reshape(-1, dim) * flip).ravel(), pressures])
            body = replace(state.body, unknowns=own_unknowns, previous=None)
        return own, State(replace(contact, bases=contact.own_bases * flip), body)


def _both(finger: Problem, base: float, second: SecondFinger) -> Problem:
    """Return the problem of a finger and its mirror image on a base at a height (mm), which has no readings."""
    model = replace(finger.model, gauges=(), markers=(), taxels=(), other_readings=())
    mesh = two(finger.mesh, base)
    system, body, count = finger.system, finger.body, len(finger.surface.nodes)
    surface = _candidates(free_surface(model, mesh, body.thickness), finger)
    mirrored = np.tile([-1.0, 1.0, 1.0][: finger.dim], count)
    delassus = np.zeros((2, count * finger.dim, 2, count * finger.dim))
    delassus[0, :, 0] = system.delassus.reshape(mirrored.size, mirrored.size)
    delassus[1, :, 1] = delassus[0, :, 0] * np.outer(mirrored, mirrored)
    symmetry = finger.symmetry
    if model.finite_strain:
        elastic = elasticity_of(model.materials(mesh.part_labels), mesh, model.domain == "plane-stress")
        stiff, fixed = stiffness(mesh, elastic, body.thickness), held_dofs(mesh, finger.axes, model.held_ends)
        body = replace(body, mesh=mesh, elastic=elastic, stiffness=stiff, fixed_dofs=fixed)
    image_of = np.concatenate([symmetry.image_of, symmetry.image_of + count])
    sign, multiplicity = np.tile(symmetry.mirror_sign, (2, 1)), np.tile(symmetry.multiplicity, 2)
    symmetry = replace(symmetry, image_of=image_of, mirror_sign=sign, multiplicity=multiplicity)
    system = ContactSystem(
        surface=surface,
        points=system.points,
        delassus=delassus.reshape(2 * count, finger.dim, 2 * count, finger.dim),
        reading_rows=np.zeros((0, 2 * count * finger.dim)),
        active_dofs=np.concatenate([system.active_dofs, system.active_dofs + count * finger.dim]),
        first_contact_mm=system.first_contact_mm,
        place_mm=system.place_mm,
        second=second,
    )
    return replace(finger, model=model, condensed_body=body, symmetry=symmetry, system=system)


def two(mesh: Mesh, base: float) -> Mesh:
    """Return a mesh and its mirror image, whose base is at a height (mm), as one mesh."""
    image = reflected(mesh, 1)
    return side_by_side(mesh, replace(image, points=image.points + base * np.eye(mesh.dim)[1]))


def _candidates(free: BoundarySurface, finger: Problem) -> BoundarySurface:
    """Return the candidate points of both fingers, those of the first one first, each in the order of the finger's."""
    nodes = finger.surface.nodes
    return points_at(free, np.concatenate([nodes, nodes + len(finger.mesh.points)]), np.tile(finger.surface.face, 2))
