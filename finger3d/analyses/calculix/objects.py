"""Rigid objects as elements behind their surface; elements that never come near the finger are omitted.

A plane is one hexahedron (in a section, a quadrilateral).  The others are facets that follow the surface within a
sagitta: the pieces of a section swept along its axis, each with a hexahedron behind it, or triangles, each with a
tetrahedron.  Every element has inner nodes of its own, and hence a positive volume at any edge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Float, Int
from finger3d.analyses.calculix.deck import ObjectElements
from finger3d.errors import Finger3dError
from finger3d.objects import Cylinder, MeshObject, PlacedObject, Plane, RigidObject, Sphere, Wave, Wedge
from finger3d.objects.rigid import Prism

MOST_FACETS = 20_000
"""Largest number of facets near the finger: CalculiX searches among them at every increment."""

_FINEST = 8  # halvings of the edges of an icosahedron: 1.3 million triangles
_STRAIGHT_REACH = 1.0  # of an element behind its facet, over the shortest edge


@dataclass(frozen=True)
class Facets:
    """Facets of a surface: points (n, 3), and the corners (m, 2 | 3 | 4) of segments, triangles or quadrilaterals."""

    points: Float
    faces: Int

    @property
    def middles(self) -> Float:
        """Middles (m, 3) of the facets."""
        return np.asarray(self.points[self.faces].mean(axis=1))


def object_elements(
    placed: Sequence[PlacedObject], low: Float, high: Float, sagitta_mm: float, dim: int
) -> tuple[ObjectElements, Float]:
    """Return the elements of an object at its first pose, and the displacements of their nodes at each pose.

    Parameters
    ----------
    placed : poses of the object, the first of them first touch
    low, high : (3,) corners of the box, mm, in which the finger stays; what never gets into it is left out
    sagitta_mm : largest distance of a facet from the surface
    dim : 2 for a section, 3

    Returns
    -------
    elements : of the object
    motion : (p, k, 3) mm, displacement of every node since the first pose

    Raises
    ------
    Finger3dError
        If more facets come near the finger than CalculiX can search.
    """
    obj = placed[0].object
    reach = max(float(np.abs(pose.to_own(_corners(low, high))).max()) for pose in placed)
    if dim == 3:
        facets = _surface(obj, reach, sagitta_mm)
    else:
        facets = _section(obj, reach, sagitta_mm)
    if not isinstance(obj, Plane):
        facets = _near(facets, placed, low, high)
    if not 0 < len(facets.faces) <= MOST_FACETS:
        raise Finger3dError(
            f"--solver calculix: {len(facets.faces)} facets of the object come near the finger; CalculiX takes 1 to "
            f"{MOST_FACETS}: press deeper, or simplify the object"
        )
    own, kind, elements = _backed(obj, facets)
    motion = np.array([pose.to_scene(own) for pose in placed])
    return ObjectElements(motion[0], kind, elements), motion - motion[0]


def _corners(low: Float, high: Float) -> Float:
    return np.stack(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"), axis=-1).reshape(-1, 3)


def _near(facets: Facets, placed: Sequence[PlacedObject], low: Float, high: Float) -> Facets:
    """Return the facets whose box meets that of the finger in any pose."""
    kept = np.zeros(len(facets.faces), dtype=bool)
    for pose in placed:
        corners = pose.to_scene(facets.points)[facets.faces]
        kept |= ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    used, faces = np.unique(facets.faces[kept], return_inverse=True)
    return Facets(facets.points[used], faces.reshape(-1, facets.faces.shape[1]))


# --- surfaces in the object's own coordinates ---------------------------------------------------------------------


def _surface(obj: RigidObject, reach: float, sagitta: float) -> Facets:
    """Return the facets of an object in space, as far as it reaches."""
    match obj:
        case Plane() | Prism():
            return _swept(_curve(obj, reach, sagitta), reach, obj.axis if isinstance(obj, Prism) else "z")
        case Sphere():
            return _sphere(obj.radius_mm, sagitta)
        case MeshObject():
            return Facets(obj.triangles.points, obj.triangles.faces)
    raise Finger3dError(f"--solver calculix: an object of the kind {type(obj).__name__} cannot be written")


def _section(obj: RigidObject, reach: float, sagitta: float) -> Facets:
    """Return the segments of an object in the plane z = 0."""
    if isinstance(obj, Sphere):
        obj = Cylinder(radius_mm=obj.radius_mm)
    if not isinstance(obj, Plane | Prism):
        raise Finger3dError("--solver calculix: a triangulated object needs model.domain = 'solid'")
    if isinstance(obj, Prism) and obj.axis == "x":
        obj = Plane()
    curve = _curve(obj, reach, sagitta)
    points = np.column_stack([curve, np.zeros(len(curve))])
    number = np.arange(len(points) - 1)
    return Facets(points, np.stack([number, number + 1], axis=1))


def _curve(obj: Plane | Prism, reach: float, sagitta: float) -> Float:
    """Return points (n, 2), distance from the lowest line and height in mm, along a section."""
    match obj:
        case Plane():
            r = np.array([-reach, reach])
            return np.column_stack([r, math.tan(obj.tilt) * r])
        case Cylinder():
            polar = _angles(math.pi, obj.radius_mm, sagitta)
            return obj.radius_mm * np.column_stack([np.sin(polar), 1.0 - np.cos(polar)])
        case Wedge():
            polar = _angles(obj.angle, obj.tip_radius_mm, sagitta)
            tip = obj.tip_radius_mm * np.column_stack([np.sin(polar), 1.0 - np.cos(polar)])
            beyond = reach * np.array([math.cos(obj.angle), math.sin(obj.angle)])
            return np.vstack([tip[0] + beyond * [-1.0, 1.0], tip, tip[-1] + beyond])
        case Wave():
            curvature = obj.amplitude_mm * (2.0 * math.pi / obj.wavelength_mm) ** 2
            step = min(math.sqrt(8.0 * sagitta / curvature) if curvature else reach, obj.wavelength_mm / 8.0)
            r = np.linspace(-reach, reach, 2 * math.ceil(reach / step) + 1)
            return np.column_stack([r, obj.section_profile(r)])
    raise Finger3dError(f"--solver calculix: an object of the kind {type(obj).__name__} cannot be written")


def _angles(most: float, radius: float, sagitta: float) -> Float:
    """Return angles from the lowest point of a circle, both ways, whose chords stay within a sagitta."""
    if radius == 0.0:
        return np.zeros(1)
    step = 2.0 * math.acos(max(1.0 - sagitta / radius, 0.9))
    return np.linspace(-most, most, 2 * math.ceil(most / step) + 1)


def _swept(curve: Float, reach: float, axis: str) -> Facets:
    """Return quadrilaterals from a curve (n, 2), swept along the axis over +-reach."""
    n = len(curve)
    ends = [np.column_stack([curve, np.full(n, end)]) for end in (-reach, reach)]
    points = np.vstack(ends)
    number = np.arange(n - 1)
    faces = np.stack([number, number + 1, number + 1 + n, number + n], axis=1)
    return Facets(points if axis == "z" else points[:, ::-1], faces)


def _sphere(radius: float, sagitta: float) -> Facets:
    """Return an icosahedron with its edges halved until the triangles stay within a sagitta of the sphere."""
    import trimesh

    for halvings in range(2, _FINEST + 1):
        ball = trimesh.creation.icosphere(subdivisions=halvings, radius=radius)
        if radius - np.linalg.norm(ball.triangles_center, axis=1).min() <= sagitta:
            break
    return Facets(np.asarray(ball.vertices) + [0.0, radius, 0.0], np.asarray(ball.faces, dtype=np.int64))


# --- elements -----------------------------------------------------------------------------------------------------


def _backed(obj: RigidObject, facets: Facets) -> tuple[Float, str, Int]:
    """Return nodes (k, 3), type and elements (m, n) behind the facets; the first face of each is its facet.

    Seen from its inner nodes, the corners of a facet run counterclockwise; a segment has them on its left.
    """
    corners = facets.points[facets.faces]
    count, sides = facets.faces.shape
    if sides == 2:
        along = corners[:, 1] - corners[:, 0]
        inward = np.column_stack([-along[:, 1], along[:, 0], np.zeros(count)])
    else:
        inward = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    outside = np.einsum("ij,ij->i", inward, obj.distance(facets.middles)[1]) > 0.0
    faces = facets.faces.copy()
    faces[outside] = faces[outside][:, ::-1]
    inward[outside] *= -1.0
    corners = facets.points[faces]
    shortest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).min(axis=1)
    behind = (_STRAIGHT_REACH * shortest)[:, None] * inward
    first = len(facets.points)
    if sides == 3:
        inner = corners.mean(axis=1) + behind
        return np.vstack([facets.points, inner]), "C3D4", np.column_stack([faces, first + np.arange(count)])
    inner = (corners + behind[:, None]).reshape(-1, 3)
    own = first + np.arange(count * sides).reshape(count, sides)
    if sides == 2:
        return np.vstack([facets.points, inner]), "CPE4", np.column_stack([faces, own[:, ::-1]])
    return np.vstack([facets.points, inner]), "C3D8", np.column_stack([faces, own])
