"""STEP files read by OpenCASCADE, which damaged files crash: called in a child process by :mod:`finger3d._child`."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from finger3d._types import Array, Float

if TYPE_CHECKING:
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS_Shape

_NO_LABEL = re.compile(r"|COMPOUND|COMPSOLID|SOLID|SHELL|NONE|unnamed|Open_CASCADE.*|=>.*", re.IGNORECASE)
"""Names that CAD programs give to solids without a name."""

_SYMBOLS = {"millimetre": "mm", "centimetre": "cm", "metre": "m", "micrometre": "um"}


def read(path: Array) -> Mapping[str, Array]:
    """Read the solids of a STEP file, mm.

    Parameters
    ----------
    path : (), absolute

    Returns
    -------
    dict
        ``error``, a text, empty if solids were read: then ``shape``, bytes in OpenCASCADE's binary format, ``labels``
        (s,) of the solids, the names ``faces`` of their faces, one solid after the other, and the ``unit`` of length.
    """
    from OCP.BinTools import BinTools
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.Message import Message, Message_PrinterOStream
    from OCP.Standard import Standard_Failure
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum

    # OCCT prints messages to the terminal directly.
    Message.DefaultMessenger_s().RemovePrinters(Message_PrinterOStream.get_type_descriptor_s())
    reader = STEPControl_Reader()
    try:
        done = reader.ReadFile(str(path)) == IFSelect_RetDone and reader.TransferRoots() > 0
        shape = reader.OneShape() if done else None
    except Standard_Failure:
        shape = None
    if shape is None or shape.IsNull():
        return _error("this is no STEP file that can be read")
    solids = _inside(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    if not solids:
        return _error("the file has no solid, only faces or curves; give a solid body")
    if not all(BRepCheck_Analyzer(solid).IsValid() for solid in solids):
        return _error("CAD calls its solid invalid; mend it where it was drawn")
    labels = [_label(_entity_name(solid, reader)) for solid in solids]
    if len(solids) > 1 and not all(labels):
        labels = [label or _label(name) for label, name in zip(labels, _product_names(str(path), solids), strict=True)]
    faces = [_entity_name(face, reader) for solid in solids for face in _inside(solid, TopAbs_ShapeEnum.TopAbs_FACE)]
    stream = io.BytesIO()
    BinTools.Write_s(shape, stream)
    content = np.frombuffer(stream.getvalue(), dtype=np.uint8)
    return {
        "error": np.array(""), "shape": content, "labels": np.array(labels), "faces": np.array(faces),
        "unit": np.array(_unit(reader)),
    }  # fmt: skip


def _unit(reader: STEPControl_Reader) -> str:
    """Return the unit of length of the file, that of SI as a symbol; empty if it names none, and is read as mm."""
    from OCP.collections import Sequence_TCollection_AsciiString

    lengths, angles, solid_angles = (Sequence_TCollection_AsciiString() for _ in range(3))
    reader.FileUnits(lengths, angles, solid_angles)
    names = dict.fromkeys(name.ToCString().lower() for name in lengths)
    return " and ".join(_SYMBOLS.get(name, name) for name in names)


def _error(text: str) -> Mapping[str, Array]:
    return {"error": np.array(text)}


def _inside(shape: TopoDS_Shape, kind: TopAbs_ShapeEnum) -> Sequence[TopoDS_Shape]:
    """Return the subshapes of a kind, each once, in the order of build123d's lists."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher
    from OCP.TopExp import TopExp

    shapes = IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    TopExp.MapShapes_s(shape, kind, shapes)
    return [shapes.FindKey(k) for k in range(1, shapes.Extent() + 1)]


def _entity_name(shape: TopoDS_Shape, reader: STEPControl_Reader) -> str:
    """Return the name of the ADVANCED_FACE or MANIFOLD_SOLID_BREP that a shape was read from."""
    from OCP.StepRepr import StepRepr_RepresentationItem
    from OCP.TopLoc import TopLoc_Location

    drawn = shape.Located(TopLoc_Location())  # the entity has no location of an assembly
    entity = reader.WS().TransferReader().EntityFromShapeResult(drawn, 1)
    named = isinstance(entity, StepRepr_RepresentationItem) and entity.Name() is not None
    return str(entity.Name().ToCString()).strip() if named else ""


def _label(name: str) -> str:
    """Return the label that a name in a STEP file stands for."""
    label = name.translate(str.maketrans(" .()[]", "______"))
    return "" if _NO_LABEL.fullmatch(label) else label


def _product_names(path: str, solids: Sequence[TopoDS_Shape]) -> list[str]:
    """Return the name of the product that each solid belongs to; empty where the file has one product only."""
    from build123d import import_step

    body = import_step(path)
    named = [
        (_centre(solid.wrapped.Moved(leaf.location.inverse().wrapped).Moved(leaf.global_location.wrapped)), leaf.label)
        for leaf in body.leaves
        for solid in leaf.solids()
    ]
    if not body.children or not named:
        return [""] * len(solids)
    centres = np.array([centre for centre, _ in named])
    return [named[int(np.linalg.norm(centres - _centre(solid), axis=1).argmin())][1] for solid in solids]


def _centre(solid: TopoDS_Shape) -> Float:
    """Return the centre of mass (3,) of a solid, mm."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties)
    centre = properties.CentreOfMass()
    return np.array([centre.X(), centre.Y(), centre.Z()])
