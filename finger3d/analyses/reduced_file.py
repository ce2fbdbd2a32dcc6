"""File of a reduced model: arrays and a JSON header in one .npz file, checked when it is read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
from pydantic import BaseModel, ConfigDict

from finger3d._types import Array, Tree, TreeView
from finger3d.contact.friction import Coulomb, FrictionLaw, TwoCoefficients
from finger3d.contact.rules import RuleName
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.surface.traces import BoundarySurface
from finger3d.geometry.design import DesignSummary
from finger3d.io import check_arrays, read_arrays, write_arrays
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.discretise.problem import ContactSystem, Problem
from finger3d.mechanics.discretise.symmetry import Symmetry
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.readings import Gauge, Marker, Taxel
from finger3d.objects import OBJECTS, MeshObject, RigidObject, vertical_frame

Made = TypeVar("Made", RigidObject, FrictionLaw)

FORMAT, VERSION = "finger3d condensed body", 7
_SHAPES: dict[str, type[RigidObject]] = {r.__name__: r for r in OBJECTS.values()} | {"MeshObject": MeshObject}
_OF_MESH = ("size_mm", "base_size_mm", "mesher", "layers", "gauge_refinement")
"""Mesh options that a file stores."""

_OF_MODEL = ("legs", "gauges", "markers", "taxels", "domain", "rule", "warnings", "filled")
"""Attributes of a model that a file stores as they are."""

_OF_SURFACE = ("nodes", "face", "points", "area", "normals", "samples")
_OF_POINTS = ("nodes", "face", "points", "area", "facets")
"""Arrays of a surface, and of its contact points, that a file stores under these names."""

_FRICTION: dict[str, type[FrictionLaw]] = {law.__name__: law for law in (Coulomb, TwoCoefficients)}


class _Header(BaseModel):
    """The header; `object` and `friction` are tables whose ``kind`` names a class."""

    model_config = ConfigDict(arbitrary_types_allowed=True)

    format: str = FORMAT
    version: int = VERSION
    about: dict[str, Any]
    body: DesignSummary
    material: Isotropic
    mesh: MeshOptions
    legs: tuple[Leg, ...]
    object: dict[str, Any]
    friction: dict[str, Any]
    gauges: tuple[Gauge, ...]
    markers: tuple[Marker, ...]
    taxels: tuple[Taxel, ...]
    domain: Domain
    rule: RuleName
    warnings: tuple[str, ...]
    filled: tuple[tuple[str, str], ...]
    axes: tuple[str, ...]
    touch_mm: float


def write(path: str | Path, problem: Problem, other: BoundarySurface, about: TreeView) -> Path:
    """Write a reduced model, whole or not at all; return its path."""
    arrays: Tree = {**arrays_of(problem), **_face_arrays("other", other)}
    if isinstance(problem.model.object, MeshObject):
        shape = problem.model.object.surface
        arrays |= {"object_points": shape.points, "object_faces": shape.faces}
    arrays["header"] = np.frombuffer(_header(problem, about).model_dump_json().encode(), dtype=np.uint8)
    write_arrays(path, arrays)
    return Path(path)


def read(path: str | Path) -> tuple[Problem, BoundarySurface, TreeView]:
    """Read a reduced model: problem, points that are no candidates, and versions.

    Raises
    ------
    Finger3dError
        In one line, if the file is not there, of another kind or version, or damaged.
    """
    try:
        arrays = read_arrays(path)
        header = json.loads(arrays["header"].tobytes())
    except FileNotFoundError:
        raise Finger3dError(f"{path}: there is no such file") from None
    except (OSError, ValueError, KeyError, RecursionError):
        raise Finger3dError(f"{path}: no reduced model, or cut short; condense the scene again") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise Finger3dError(f"{path}: no reduced model; `finger3d calibrate` writes one, reduced.npz")
    if header.get("version") != VERSION:
        raise Finger3dError(
            f"{path}: version {header.get('version')}, this finger3d reads version {VERSION}; condense it again"
        )
    try:
        check_arrays(arrays)
    except ValueError:
        raise Finger3dError(
            f"{path}: parts of the reduced model are missing or damaged; condense the scene again"
        ) from None
    checked = _Header.model_validate_json(arrays["header"].tobytes())
    problem = assembled(_model(checked, arrays), arrays, checked.touch_mm, checked.axes)
    return problem, _face("other", arrays), checked.about


def _face_arrays(name: str, face: BoundarySurface) -> dict[str, Array]:
    mean, hats = face.average.tocsr(), face.hats.tocsr()
    return {f"{name}_{key}": getattr(face, key) for key in _OF_SURFACE} | {
        f"{name}_mean": mean.data,
        f"{name}_mean_at": mean.indices,
        f"{name}_mean_rows": mean.indptr,
        f"{name}_hats": hats.data,
    }


def _face(name: str, arrays: TreeView) -> BoundarySurface:
    """Return a surface with the quadrature points of the gap, and without traces of a mesh."""
    own = {key: arrays[f"{name}_{key}"] for key in _OF_SURFACE}
    shape, pattern = (len(own["nodes"]), len(own["samples"])), (arrays[f"{name}_mean_at"], arrays[f"{name}_mean_rows"])
    mean, hats = (sp.csr_matrix((arrays[f"{name}_{data}"], *pattern), shape=shape) for data in ("mean", "hats"))
    trace, interpolate = (sp.csr_matrix((count, 0)) for count in shape)
    return BoundarySurface(**own, trace=trace, average=mean, interpolate=interpolate, hats=hats)


def bare(face: BoundarySurface) -> BoundarySurface:
    """Return the surface without traces of a mesh."""
    return _face("it", _face_arrays("it", face))


def arrays_of(problem: Problem) -> dict[str, Array]:
    """Return the arrays of a problem that a press needs, by their name in the file."""
    c, d = problem.delassus.shape[:2]
    arrays: dict[str, Array] = {
        "compliance": problem.delassus.reshape(c * d, c * d),
        "reading_rows": problem.system.reading_rows,
        "parent": problem.symmetry.image_of,
        "sign": problem.symmetry.mirror_sign,
        "share": problem.symmetry.multiplicity,
        **{key: getattr(problem.points, key) for key in _OF_POINTS},
        "band": np.array([problem.points.half_width_mm, problem.points.band_mm]),
        "contact_compliance": problem.points.compliance,
        **_face_arrays("face", bare(problem.surface)),
    }
    if problem.system.object_share is not None:
        arrays["object_share"] = problem.system.object_share
    if problem.without_inclusions:
        arrays |= {
            "bare_compliance": problem.without_inclusions.delassus.reshape(c * d, c * d),
            "bare_reading_rows": problem.without_inclusions.system.reading_rows,
        }
    return arrays


def assembled(model: Model, arrays: TreeView, touch_mm: float, axes: tuple[str, ...]) -> Problem:
    """Return a problem without a meshed part, made from arrays."""
    d = arrays["sign"].shape[1]
    c = len(arrays["face_nodes"])
    half_width, band = arrays["band"]
    system = ContactSystem(
        surface=_face("face", arrays),
        points=ContactPoints(
            **{key: arrays[key] for key in _OF_POINTS},
            basis=vertical_frame(d),
            half_width_mm=float(half_width),
            band_mm=float(band),
            compliance=arrays["contact_compliance"],
        ),
        delassus=arrays["compliance"].reshape(c, d, c, d),
        reading_rows=arrays["reading_rows"].reshape(len(model.columns), c * d),
        active_dofs=np.zeros(0, dtype=np.int64),
        first_contact_mm=touch_mm,
        object_share=arrays.get("object_share"),
    )
    symmetry = Symmetry(axes=axes, image_of=arrays["parent"], mirror_sign=arrays["sign"], multiplicity=arrays["share"])
    problem = Problem(model=model, condensed_body=None, symmetry=symmetry, system=system)
    if "bare_compliance" not in arrays:
        return problem
    without = replace(
        system,
        delassus=arrays["bare_compliance"].reshape(c, d, c, d),
        reading_rows=arrays["bare_reading_rows"].reshape(len(model.columns), c * d),
    )
    return replace(problem, without_inclusions=replace(problem, system=without))


def _header(problem: Problem, about: TreeView) -> _Header:
    model, obj = problem.model, problem.model.object
    placed = {f.name: getattr(obj, f.name) for f in fields(obj) if f.name != "surface"}
    header: Tree = {
        "about": dict(about),
        "body": model.design,
        "material": model.material,
        "mesh": MeshOptions(**{name: getattr(model.mesh, name) for name in _OF_MESH}),
        "object": {"kind": type(obj).__name__, **placed},
        "friction": {"kind": type(model.friction).__name__, **asdict(model.friction)},
        "axes": problem.axes,
        "touch_mm": problem.system.first_contact_mm,
        **{name: getattr(model, name) for name in _OF_MODEL},
    }
    return _Header(**header)


def _model(header: _Header, arrays: TreeView) -> Model:
    surface = {}
    if header.object["kind"] == "MeshObject":
        from finger3d.geometry.surface import Triangles

        surface = {"surface": Triangles(arrays["object_points"], arrays["object_faces"])}
    return Model(
        design=header.body,
        material=header.material,
        mesh=header.mesh,
        object=_of_kind(_SHAPES, header.object, surface),
        friction=_of_kind(_FRICTION, header.friction, {}),
        symmetry=header.axes,
        **{name: getattr(header, name) for name in _OF_MODEL},
    )


def _of_kind(kinds: Mapping[str, type[Made]], table: TreeView, given: TreeView) -> Made:
    """Return a dataclass of the kind that a table names, from its values and those given."""
    return kinds[table["kind"]](**{key: value for key, value in table.items() if key != "kind"}, **given)
