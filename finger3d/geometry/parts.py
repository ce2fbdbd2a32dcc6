"""Bodies of several solids: solids that touch are glued, so that the face between two of them exists once."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import label_face

if TYPE_CHECKING:
    from build123d import Compound, Face, Shape, Solid

OUTSIDE = -1
"""Number that stands for the space around a body, where its parts are numbered from 0."""

_OVERLAP = 1e-6  # of the smallest solid's volume: what solids may share by round-off

_SMALLEST_GAP = 5e-4
"""Distance of solids that do not touch, over the diagonal of the body: narrower gaps cannot be meshed."""


@dataclass(frozen=True)
class GluedFace:
    """A face of glued solids.

    Attributes
    ----------
    face : oriented outward from the part `inside`
    inside, outside : numbers of the parts on its sides; `outside` is OUTSIDE for a face of the surface
    """

    face: Face
    inside: int
    outside: int


@dataclass(frozen=True)
class Glued:
    """Solids that share the faces between them.

    Attributes
    ----------
    shape : all solids
    labels : of the parts, by number; "" is the main body, which has number 0
    volumes_mm3 : of the parts
    faces : those of the surface, labelled, and those between parts
    """

    shape: Shape
    labels: tuple[str, ...]
    volumes_mm3: tuple[float, ...]
    faces: tuple[GluedFace, ...]


def glue(solids: Mapping[str, Solid | Compound], name: str) -> Glued:
    """Glue solids, given by the labels of their parts, along the faces where they touch.

    Raises
    ------
    Finger3dError
        If solids overlap.
    """
    from build123d import Compound, Shape
    from OCP.BRepAlgoAPI import BRepAlgoAPI_BuilderAlgo
    from OCP.collections import List_TopoDS_Shape

    labels = ("", *(label for label in solids if label))
    numbered = [(labels.index(label), solid) for label, body in solids.items() for solid in body.solids()]
    arguments = List_TopoDS_Shape()
    for _, solid in numbered:
        arguments.Append(solid.wrapped)
    builder = BRepAlgoAPI_BuilderAlgo()
    builder.SetArguments(arguments)
    builder.Build()
    shape = Compound(builder.Shape())
    whole = sum(solid.volume for _, solid in numbered)
    if not builder.IsDone() or abs(shape.volume - whole) > _OVERLAP * min(solid.volume for _, solid in numbered):
        raise Finger3dError(f"{name}: the solids overlap; cut one by the other where they were drawn")
    owners: dict[Face, list[tuple[int, Face]]] = {}
    for number, solid in numbered:
        images = [*builder.Modified(solid.wrapped)] or [solid.wrapped]  # a solid that touches none is not modified
        for image in images:
            for face in Shape.cast(image).faces():  # faces are equal whichever way they are turned
                owners.setdefault(face, []).append((number, face))
    faces = []
    for sides in owners.values():
        numbers = sorted({number for number, _ in sides})
        if len(sides) == 2 and len(numbers) == 1:
            continue  # between two solids of one part
        first = next(face for number, face in sides if number == numbers[0])
        if len(numbers) == 1:
            label_face(first)
        faces.append(GluedFace(first, numbers[0], numbers[1] if len(numbers) == 2 else OUTSIDE))
    volumes = tuple(math.fsum(s.volume for number, s in numbered if number == i) for i in range(len(labels)))
    return Glued(shape, labels, volumes, tuple(faces))


def check_gaps(glued: Glued, solids: Sequence[Solid], name: str) -> None:
    """Refuse solids that nearly touch: the middle of a face of the surface is close to another solid.

    Raises
    ------
    Finger3dError
        With the place, in the coordinates of the file, and the distance.
    """
    from build123d import Compound, Vector, Vertex

    least = _SMALLEST_GAP * Compound(solids).bounding_box().diagonal
    boxes = [(solid.bounding_box(), solid) for solid in solids]
    for glued_face in glued.faces:
        if glued_face.outside != OUTSIDE:
            continue
        place = _inner_point(glued_face.face)
        near = [
            solid
            for box, solid in boxes
            if all(lo - least <= c <= hi + least for lo, c, hi in zip(box.min, place, box.max, strict=True))
        ]
        if len(near) < 2:
            continue
        ways = sorted((solid.distance_to_with_closest_points(Vertex(*place)) for solid in near), key=lambda way: way[0])
        gap, there, _ = ways[1]  # the first solid is the face's own
        # not beside a thin part
        facing = glued_face.face.normal_at(Vector(*place)).dot(there - Vector(*place)) >= 0.5 * gap
        if gap < least and facing:
            raise Finger3dError(
                f"{name}: {_apart(gap, place)}; draw them with common faces, or a gap that can be meshed"
            )


def apart(a: Solid, b: Solid) -> str:
    """Return a clause that tells how far two solids are apart, and where."""
    gap, place, _ = a.distance_to_with_closest_points(b)
    return _apart(gap, (place.X, place.Y, place.Z))


def _apart(gap: float, place: tuple[float, float, float]) -> str:
    x, y, z = place
    return f"solids do not touch, but are {gap:.2g} mm apart near ({x:.4g}, {y:.4g}, {z:.4g}) mm"


def _inner_point(face: Face) -> tuple[float, float, float]:
    """Return a point inside a face: that of the surface in the middle of the largest of a few triangles."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(face.wrapped, 0.1, True, 0.5, False)
    mesh = BRep_Tool.Triangulation_s(face.wrapped, TopLoc_Location())
    corners = [[mesh.UVNode(node) for node in mesh.Triangle(i).Get()] for i in range(1, mesh.NbTriangles() + 1)]

    def area(nodes: list[Any]) -> float:
        a, b, c = nodes
        return float(abs((b.X() - a.X()) * (c.Y() - a.Y()) - (c.X() - a.X()) * (b.Y() - a.Y())))

    largest = max(corners, key=area)
    point = BRepAdaptor_Surface(face.wrapped).Value(
        math.fsum(p.X() for p in largest) / 3.0, math.fsum(p.Y() for p in largest) / 3.0
    )
    return point.X(), point.Y(), point.Z()
