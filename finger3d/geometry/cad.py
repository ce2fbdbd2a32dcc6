"""CAD of designs: extruded and cut solids, and the labels of their faces.

build123d takes a second to import and is imported inside functions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from finger3d.errors import Finger3dError
from finger3d.geometry.section import Arc, Section

if TYPE_CHECKING:
    from build123d import Compound, Edge, Face, Part, Shape, Sketch, Solid, Wire


_CAD_TOLERANCE_MM = 1e-7
_LEAST_UPWARD_NORMAL = 1e-6  # of a contact face; round-off of a vertical round wall is smaller


def extruded(section: Section, width_mm: float, name: str) -> Solid:
    """Extrude the whole section along z from -width/2 to width/2, with labelled faces."""
    from build123d import extrude

    return sound(extrude(_face(section), amount=0.5 * width_mm, both=True), name)


def extruded_parts(section: Section, width_mm: float, name: str) -> dict[str, Solid]:
    """Extrude each part of a section along z from -width/2 to width/2; the key "" is the main body."""
    from build123d import Polyline, extrude, make_face

    inner = section.inner
    regions = {"": _face(inner)}
    if section.layer:
        regions[section.layer.label] = _face(section) - _face(inner)
    if inner.core:
        core = inner.core
        x, y = core.half_length_mm, core.height_mm
        corners = [(-x, 0.0), (x, 0.0), (x, y), (-x, y)]
        regions[core.label] = make_face([Polyline(*corners, close=True)])
        regions[""] = regions[""] - regions[core.label]
    parts = {}
    for label, region in regions.items():
        solids = extrude(region, amount=0.5 * width_mm, both=True).solids()
        if len(solids) != 1 or not solids[0].is_valid:
            raise Finger3dError(f"{name}: CAD made {len(solids)} solids of the part '{label}'; change its dimensions")
        parts[label] = solids[0]
        parts[label].label = label
    return parts


def _face(section: Section) -> Sketch:
    """Return the whole section, both halves, as a plane face."""
    from build123d import Line, Polyline, ThreePointArc, make_face

    length, edge = section.half_length_mm, section.edge_height_mm
    if isinstance(section.contact, Arc):
        # A half cylinder's wall has no height; CAD refuses edges shorter than its tolerance.
        edges: list[Edge | Wire] = [ThreePointArc((length, edge), (0.0, section.height_mm), (-length, edge))]
    else:
        edges = [Line((length, edge), (-length, edge))]
    if edge > _CAD_TOLERANCE_MM:
        edges.append(Polyline((-length, edge), (-length, 0.0), (length, 0.0), (length, edge)))
    else:
        edges.append(Line((-length, 0.0), (length, 0.0)))
    return make_face(edges)


def sound(shape: Part | Shape, name: str) -> Solid:
    """Return the one valid solid of a shape, its faces labelled by :func:`labelled_faces`.

    Raises
    ------
    Finger3dError
        If there are several solids or an invalid one, or no base or contact face.
    """
    solids = shape.solids()
    if len(solids) != 1 or not solids[0].is_valid or not solids[0].volume > 0.0:
        made = f"CAD made {len(solids)} solids, or an invalid one, of these dimensions"
        raise Finger3dError(f"{name}: {made}; change them")
    solid = solids[0]
    solid.label = name
    labels = {face.label for face in labelled_faces(solid)}
    if not {"contact", "base"} <= labels:
        raise Finger3dError(
            f"{name}: the solid has faces {sorted(labels)}; it needs a base on y = 0 and a contact face"
        )
    return solid


def labelled_faces(solid: Solid) -> list[Face]:
    """Label the faces of a solid by place and normal; y points up, z along the width.

    base: plane on y = 0 facing down. ends: planes normal to z. walls: planes normal to x, and other faces that do not
    face up. symmetry_x, symmetry_z: the cuts on x = 0, z = 0. contact: the rest.
    """
    faces = list(solid.faces())
    for face in faces:
        label_face(face)
    return faces


def label_face(face: Face) -> None:
    """Label a face of a solid; see :func:`labelled_faces`."""
    centre = np.array([*face.center()])
    normal = np.array([*face.normal_at(face.center())])
    face.label = _label(centre, normal, face.is_planar)


def _label(centre: np.ndarray, normal: np.ndarray, planar: bool) -> str:
    along = int(np.argmax(np.abs(normal)))
    if planar and abs(normal[along]) > 1.0 - 1e-9:
        down = normal[along] < 0.0
        if along == 1:
            return "base" if down and abs(centre[1]) < _CAD_TOLERANCE_MM else "walls" if down else "contact"
        cut = down and abs(centre[along]) < _CAD_TOLERANCE_MM
        return ("symmetry_x" if cut else "walls") if along == 0 else ("symmetry_z" if cut else "ends")
    return "contact" if normal[1] > _LEAST_UPWARD_NORMAL else "walls"


def enlarged(solid: Solid, factor: float) -> Solid:
    """Return a solid enlarged about the origin; build123d's `scale` enlarges about the solid's own location."""
    from build123d import Shape as CadShape
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Pnt, gp_Trsf

    enlarge = gp_Trsf()
    enlarge.SetScale(gp_Pnt(0.0, 0.0, 0.0), factor)
    whole = CadShape.cast(BRepBuilderAPI_Transform(solid.wrapped, enlarge, True).Shape())
    return whole.solids()[0]


def cut(solid: Solid, symmetry: tuple[str, ...]) -> Solid:
    """Return the part x >= 0 and/or z >= 0 of a solid."""
    return sound(_kept(solid, symmetry), solid.label) if symmetry else solid


def cut_part(solid: Solid | Compound, symmetry: tuple[str, ...]) -> Compound:
    """Return the part x >= 0 and/or z >= 0 of a solid that need not be a whole body."""
    from build123d import Compound

    return Compound((_kept(solid, symmetry) if symmetry else solid).solids())


def _kept(solid: Solid | Compound, symmetry: tuple[str, ...]) -> Shape:
    from build123d import Align, Box

    box = solid.bounding_box()
    reach = 4.0 * math.dist([*box.min], [*box.max])
    x, z = (Align.MIN if axis in symmetry else Align.CENTER for axis in ("x", "z"))
    return solid & Box(reach, reach, reach, align=(x, Align.CENTER, z))


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
            advice = "draw them with common faces, or a gap that can be meshed"
            raise Finger3dError(f"{name}: {_apart(gap, place)}; {advice}")


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
    u, v = math.fsum(p.X() for p in largest) / 3.0, math.fsum(p.Y() for p in largest) / 3.0
    point = BRepAdaptor_Surface(face.wrapped).Value(u, v)
    return point.X(), point.Y(), point.Z()
