"""CAD of designs: extruded and cut solids, and the labels of their faces.

build123d takes a second to import and is imported inside functions.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

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
        raise Finger3dError(
            f"{name}: CAD made {len(solids)} solids, or an invalid one, of these dimensions; change them"
        )
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
