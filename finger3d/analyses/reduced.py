"""Reduced model of a press: the compliance of the contact points, pressed without the mesh.

At small strain a press needs only the compliance of the contact points, the gauge rows, and the gap between object and
surface (`finger3d.fem.solvers.condense`).  Without the mesh there are no fields, and no candidate points can be added:
a path whose contact could reach beyond them is refused.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
from pydantic import BaseModel, ConfigDict

from finger3d._machine import versions
from finger3d._types import Array, Tree, TreeView
from finger3d.analyses.pressed_body import under
from finger3d.contact.friction import Coulomb, FrictionLaw, TwoCoefficients
from finger3d.contact.solve import RuleName
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.surface import OF_POINTS, BoundarySurface
from finger3d.geometry.design import DesignSummary
from finger3d.io import read_arrays, write_arrays
from finger3d.mechanics.discretise.contact_points import MARGIN, ContactPoints
from finger3d.mechanics.discretise.problem import ContactSystem, Problem, rigid_gap
from finger3d.mechanics.discretise.symmetry import Symmetry
from finger3d.mechanics.history import History
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.path import targets
from finger3d.mechanics.postprocess.penetration import beyond_candidates
from finger3d.mechanics.readings import Gauge, Marker, Taxel
from finger3d.objects import OBJECTS, MeshObject, RigidObject, vertical_frame

Made = TypeVar("Made", RigidObject, FrictionLaw)

FORMAT, VERSION = "finger3d condensed body", 7
_SHAPES: dict[str, type[RigidObject]] = {r.__name__: r for r in OBJECTS.values()} | {"MeshObject": MeshObject}
_OF_MESH = ("size_mm", "base_size_mm", "mesher", "layers", "gauge_refinement")
"""Mesh options that a file stores."""

_OF_MODEL = ("legs", "gauges", "markers", "taxels", "domain", "rule", "warnings", "filled")
"""Attributes of a model that a file stores as they are."""

_OF_SURFACE = (*OF_POINTS, "samples")
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


def _face_arrays(name: str, face: BoundarySurface) -> dict[str, Array]:
    mean, arrays = face.average.tocsr(), {key: getattr(face, key) for key in _OF_SURFACE}
    arrays |= {"mean": mean.data, "mean_at": mean.indices, "mean_rows": mean.indptr, "hats": face.hats.tocsr().data}
    return {f"{name}_{key}": values for key, values in arrays.items()}


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
        arrays["bare_compliance"] = problem.without_inclusions.delassus.reshape(c * d, c * d)
        arrays["bare_reading_rows"] = problem.without_inclusions.system.reading_rows
    return arrays


def assembled(model: Model, arrays: TreeView, touch_mm: float, axes: tuple[str, ...]) -> Problem:
    """Return a problem without a meshed part, made from arrays."""
    d = arrays["sign"].shape[1]
    c = len(arrays["face_nodes"])
    own, compliance = {key: arrays[key] for key in _OF_POINTS}, arrays["contact_compliance"]
    width, band = map(float, arrays["band"])
    points = ContactPoints(**own, basis=vertical_frame(d), half_width_mm=width, band_mm=band, compliance=compliance)
    system = ContactSystem(
        surface=_face("face", arrays),
        points=points,
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
    rows = arrays["bare_reading_rows"].reshape(len(model.columns), c * d)
    without = replace(system, delassus=arrays["bare_compliance"].reshape(c, d, c, d), reading_rows=rows)
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


_PATH = ("depth_mm", "slide_x_mm", "slide_z_mm", "turn_x", "turn_y", "turn_z")

_GAP_LEFT = 0.5 * MARGIN
"""Least rigid gap of the points that are no candidates, over the press depth: half that of the farthest candidate."""


@dataclass(frozen=True, repr=False)
class ReducedModel:
    """A body condensed to its contact points and gauges.

    Attributes
    ----------
    problem : the problem that `finger3d.mechanics.march.solve.march` solves; its mesh and factor are empty
    others : the points of the free faces that are no candidates
    about : versions, mesh hash, number of unknowns and effects of the body
    """

    problem: Problem
    others: BoundarySurface
    about: TreeView

    def __repr__(self) -> str:
        """Return one line without the compliance."""
        where = f"{len(self.problem.points.nodes)} contact points"
        read = f", gauges {', '.join(self.gauges)}" if self.gauges else ""
        return f"<ReducedModel: {where}, {self.problem.model.domain}{read}>"

    @classmethod
    def of(cls, problem: Problem) -> ReducedModel:
        """Reduce a problem.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time, or if there are two fingers.
        """
        model = problem.model
        if not model.is_linear_elastic:
            slots = dict(model.filled)
            name = slots.get("hyperelastic_law") or slots.get("relaxation", "its formulation")
            advice = "condense the scene with effects.auto = false and without the effect, or press the scene itself"
            why = "a body with it has no reduced model, its compliance is not constant"
            raise Finger3dError(f"effects.{name}: {why}; {advice}")
        if model.centre_of_mass_mm is not None:
            raise Finger3dError("[grip]: two fingers have no reduced model; press the scene itself")
        others = beyond_candidates(problem)
        about = {
            "versions": versions(),
            "mesh_hash": problem.body.report.hash,
            "dofs": int(problem.body.stiffness.upper.shape[0]),
            "effects": sorted({effect for _, effect in model.filled}),
        }
        size = DesignSummary(float(model.design.height_mm), float(model.design.width_mm))
        light = replace(model, design=size, inclusions=None, object_compliance=None, symmetry=problem.axes, parts=())
        own = assembled(light, arrays_of(problem), problem.system.first_contact_mm, problem.axes)
        return cls(own, bare(others), about)

    @property
    def gauges(self) -> tuple[str, ...]:
        """Names of the gauges."""
        return tuple(g.name for g in self.problem.model.gauges)

    @property
    def contact_points(self) -> int:
        """Contact points of the meshed part."""
        return len(self.problem.surface.nodes)

    def press(self, mu: float | None = None, legs: Sequence[Leg] | None = None) -> History:
        """Press once; an argument that is None is as in the scene.

        Parameters
        ----------
        mu : coefficient of friction, from 0 up
        legs : path of the object

        Returns
        -------
        History
            With ``outcome``, and gauge strains in ``steps[-1].gauges``.

        Raises
        ------
        Finger3dError
            If a number is out of range, contact could leave the candidate points, or the object passes between them.
        """
        model = self.problem.model
        law = model.friction if mu is None else model.friction.with_mu(mu)
        if legs is not None:
            self._check(tuple(legs))
        problem = under(self.problem, law, tuple(legs or ()))
        return History(problem.points, tuple(march(problem)))

    def _check(self, legs: tuple[Leg, ...]) -> None:
        """Raise Finger3dError if contact could leave the candidate points."""
        problem, mirrored = self.problem, "press: the body was condensed as a mirror image"
        for leg in legs:
            if not all(math.isfinite(getattr(leg, k)) for k in _PATH) or leg.depth_mm < 0.0:
                given = f"depth {leg.depth_mm} mm, slides {leg.slide_x_mm}, {leg.slide_z_mm} mm"
                raise Finger3dError(f"press: {given}: must be finite numbers, the depth from 0 up")
            if problem.axes and any((leg.turn_x, leg.turn_y, leg.turn_z)):
                raise Finger3dError(f"{mirrored} and its object cannot turn; condense a scene with this turn")
            for axis in problem.axes:
                if getattr(leg, f"slide_{axis}_mm"):
                    advice = "condense a scene with this slide"
                    raise Finger3dError(f"{mirrored} about {axis} = 0 and cannot slide along {axis}; {advice}")
        if problem.dim == 2 and any(leg.slide_z_mm for leg in legs):
            raise Finger3dError("press: a section cannot slide along z; condense a solid")
        if not len(self.others.nodes):
            return
        path = targets(legs)
        deepest = max(t.depth_mm for t in path)
        nearest = min(float(rigid_gap(problem.placed(t), self.others).min()) for t in path)
        if nearest < _GAP_LEFT * deepest:
            what = f"contact may leave the {self.contact_points} points that were condensed"
            raise Finger3dError(
                f"press: at depth {deepest:g} mm {what}; press less, or condense a scene that goes as far"
            )

    def save(self, path: str | Path) -> Path:
        """Write the model into one .npz file without pickles, whole or not at all; return its path."""
        arrays: Tree = {**arrays_of(self.problem), **_face_arrays("other", self.others)}
        if isinstance(self.problem.model.object, MeshObject):
            shape = self.problem.model.object.surface
            arrays |= {"object_points": shape.points, "object_faces": shape.faces}
        header = _header(self.problem, self.about).model_dump_json()
        write_arrays(path, arrays | {"header": np.frombuffer(header.encode(), dtype=np.uint8)})
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> ReducedModel:
        """Read what `save` wrote.

        Raises
        ------
        Finger3dError
            In one line, if the file is not there, of another kind or version, or damaged.
        """
        try:
            arrays = read_arrays(path)
        except FileNotFoundError:
            raise Finger3dError(f"{path}: there is no such file") from None
        except (OSError, ValueError):
            raise Finger3dError(
                f"{path}: no reduced model, or cut short or damaged; condense the scene again by `finger3d calibrate`"
            ) from None
        header = json.loads(arrays["header"].tobytes()) if "header" in arrays else {}
        if header.get("format") != FORMAT:
            raise Finger3dError(f"{path}: no reduced model; `finger3d calibrate` writes one, reduced.npz")
        if header.get("version") != VERSION:
            raise Finger3dError(
                f"{path}: version {header.get('version')}, this finger3d reads version {VERSION}; condense it again"
            )
        checked = _Header.model_validate_json(arrays["header"].tobytes())
        problem = assembled(_model(checked, arrays), arrays, checked.touch_mm, checked.axes)
        return cls(problem, _face("other", arrays), checked.about)
