"""Bodies of several solids: solids that touch are glued, so that the face between two of them exists once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from finger3d.errors import Finger3dError
from finger3d.geometry.cad import label_face

if TYPE_CHECKING:
    from build123d import Compound, Face, Shape, Solid

OUTSIDE = -1
"""Number that stands for the space around a body, where its parts are numbered from 0."""

_OVERLAP = 1e-6  # of the smallest solid's volume: what solids may share by round-off


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
    given = [(labels.index(label), solid) for label, body in solids.items() for solid in body.solids()]
    arguments = List_TopoDS_Shape()
    for _, solid in given:
        arguments.Append(solid.wrapped)
    builder = BRepAlgoAPI_BuilderAlgo()
    builder.SetArguments(arguments)
    builder.Build()
    shape = Compound(builder.Shape())
    whole = sum(solid.volume for _, solid in given)
    if not builder.IsDone() or abs(shape.volume - whole) > _OVERLAP * min(solid.volume for _, solid in given):
        raise Finger3dError(f"{name}: the solids overlap; cut one by the other where they were drawn")
    owners: dict[Face, list[tuple[int, Face]]] = {}
    for number, solid in given:
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
    volumes = tuple(math.fsum(s.volume for number, s in given if number == i) for i in range(len(labels)))
    return Glued(shape, labels, volumes, tuple(faces))
