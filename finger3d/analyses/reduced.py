"""The reduced model: a condensed body without its mesh and factor, kept in a file, pressed in milliseconds.

In small strain everything that a press needs is the compliance of the contact points, the gauges' rows and where the
object is over the surface (`finger3d.fem.condense`).  Without the mesh there are no fields, and no way to see whether
contact reaches beyond the candidate points: a press that could is refused.
"""

from __future__ import annotations

import json
import math
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d._machine import versions
from finger3d.analyses.reduced_arrays import check_arrays
from finger3d.contact.friction import Coulomb, FrictionLaw
from finger3d.contact.rules import RULES
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Elasticity, Stiffness
from finger3d.fem.condense import Condensation as Factored
from finger3d.fem.simplex import Mesh
from finger3d.fem.traces import BoundarySurface, restrict, surface
from finger3d.io import atomic, read_arrays
from finger3d.mechanics.history import ContactPoints, History
from finger3d.mechanics.model import Gauge, Leg, Material, MeshOptions, Model
from finger3d.mechanics.problem import Problem, rigid_gap
from finger3d.mechanics.resolution import check
from finger3d.mechanics.solve import MARGIN, march, targets
from finger3d.meshing.report import MeshReport
from finger3d.objects import Cylinder, MeshObject, Plane, Sphere, Wave, Wedge

Float = NDArray[np.float64]

FORMAT, VERSION = "finger3d condensed body", 2
_SHAPES: dict[str, type] = {kind.__name__: kind for kind in (Plane, Cylinder, Sphere, Wedge, Wave, MeshObject)}
_PATH = ("depth_mm", "slide_x_mm", "slide_z_mm")
_STEPS = 1_000_000  # increments of a leg that a file may ask for
_ENOUGH = 0.5 * MARGIN  # of the depth: candidates reach to a rigid gap of MARGIN; half of that must be left


@dataclass(frozen=True)
class DesignSummary:
    """What is left of a design: height and width, mm."""

    height_mm: float
    width_mm: float


@dataclass(frozen=True, repr=False)
class Condensed:
    """A body condensed to its contact points and gauges, free of its mesh.

    Attributes
    ----------
    problem : what `finger3d.mechanics.solve.march` presses; its mesh and its factor are empty
    others : the points of the contact face that are no candidates, to see whether a path would reach them
    about : versions, mesh hash, unknowns, effects of the body that was condensed
    """

    problem: Problem
    others: BoundarySurface
    about: Mapping[str, Any]

    def __repr__(self) -> str:
        """One line: the compliance would fill pages."""
        where = f"{len(self.problem.points.nodes)} contact points"
        read = f", gauges {', '.join(self.gauges)}" if self.gauges else ""
        return f"<Condensed body: {where}, {self.problem.model.domain}{read}>"

    @classmethod
    def of(cls, problem: Problem) -> Condensed:
        """Take from a problem all that presses need.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time.
        """
        model = problem.model
        if not model.formulation.is_linear_elastic:
            name = dict(model.filled).get("formulation", "its kinematics")
            raise Finger3dError(
                f"effects.{name}: a body with it has no reduced model, its compliance changes on the way; "
                "take the effect out, or press the scene itself"
            )
        face = surface(problem.mesh, "contact", problem.thickness)
        others = restrict(face, ~np.isin(face.nodes, problem.surface.nodes))
        about = {
            "versions": versions(), "mesh_hash": problem.report.hash, "dofs": int(problem.stiffness.upper.shape[0]),
            "effects": sorted({effect for _, effect in model.filled}),
        }  # fmt: skip
        light = replace(
            model, design=DesignSummary(float(model.design.height_mm), float(model.design.width_mm)), inclusions=None,
            object_compliance=None, symmetry=problem.axes,
        )  # fmt: skip
        return cls(_assembled(light, _arrays_of(problem), problem.first_contact_mm, problem.axes), _bare(others), about)

    @property
    def gauges(self) -> tuple[str, ...]:
        """Names of the gauges."""
        return tuple(g.name for g in self.problem.model.gauges)

    @property
    def contact_points(self) -> int:
        """Contact points of the meshed part."""
        return len(self.problem.surface.nodes)

    def press(
        self,
        mu: float | None = None,
        legs: Sequence[Leg] | None = None,
        ratio: float | None = None,
        branch: str | None = None,
    ) -> History:
        """Press once; what is not given is as in the scene.

        Parameters
        ----------
        mu : coefficient of friction, from 0 up
        legs : the path
        ratio : mu_kinetic / mu_static, 0 to 1
        branch : "keep" or "paper", what a slipping point does in the next step (`finger3d.effects.kinetic_friction`)

        Returns
        -------
        History
            Its `outcome` tells whether all increments converged; gauges are in ``frames[-1].gauges``.

        Raises
        ------
        Finger3dError
            If a number is out of range, the path leaves what was condensed, or the object passes between its points.
        """
        model = self.problem.model
        law = model.friction if mu is None else model.friction.with_mu(mu)
        if ratio is not None or branch is not None:
            law = _kinetic(law, ratio, branch)
        problem = replace(self.problem, model=replace(model, friction=law, legs=tuple(legs or model.legs)))
        if legs is not None:
            self._check(problem)
            check(problem.model, problem.surface, problem.first_contact_mm, problem.place_mm, problem.axes)
        return History(problem.points, tuple(march(problem)))

    def _check(self, problem: Problem) -> None:
        """Refuse a path that comes near points that were not condensed (`finger3d.mechanics.solve.build` chose
        them).
        """
        legs = problem.model.legs
        for leg in legs:
            if not all(math.isfinite(getattr(leg, k)) for k in _PATH) or leg.depth_mm < 0.0:
                raise Finger3dError(f"press: depth {leg.depth_mm} mm, slides {leg.slide_x_mm}, {leg.slide_z_mm} mm: "
                                    "must be finite numbers, the depth from 0 up")  # fmt: skip
            for axis in problem.axes:
                if getattr(leg, f"slide_{axis}_mm"):
                    raise Finger3dError(
                        f"press: the body was condensed as a mirror image about {axis} = 0 and cannot slide along "
                        f"{axis}; condense a scene with this slide"
                    )
        if problem.dim == 2 and any(leg.slide_z_mm for leg in legs):
            raise Finger3dError("press: a section cannot slide along z; condense a solid")
        if not len(self.others.nodes):
            return
        path = targets(legs)
        deepest = max(t.depth_mm for t in path)
        nearest = min(float(rigid_gap(problem.model, self.others, problem.first_contact_mm, t).min()) for t in path)
        if nearest < _ENOUGH * deepest:
            raise Finger3dError(
                f"press: at depth {deepest:g} mm contact may leave the {self.contact_points} points that were "
                "condensed; press less, or condense a scene that goes as far"
            )

    def save(self, path: str | Path) -> Path:
        """Write everything into one .npz file (no pickle), whole or not at all; returns its path."""
        problem, other = self.problem, self.others
        arrays = {**_arrays_of(problem), **_face_arrays("other", other)}
        if isinstance(problem.model.object, MeshObject):
            shape = problem.model.object.surface
            arrays |= {"object_points": shape.points, "object_faces": shape.faces}
        header = {"format": FORMAT, "version": VERSION, "about": dict(self.about), **_header(problem)}
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
        with atomic(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **arrays)
        return Path(path)

    @classmethod
    def load(cls, path: str | Path) -> Condensed:
        """Read what :meth:`save` wrote.

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
        except (
            OSError,
            ValueError,
            KeyError,
            AttributeError,
            TypeError,
            EOFError,
            RecursionError,
            zipfile.BadZipFile,
            zlib.error,
        ):
            raise Finger3dError(f"{path}: no condensed body, or cut short; condense the scene again") from None
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise Finger3dError(f"{path}: no condensed body; `finger3d calibrate` writes one, reduced.npz")
        if header.get("version") != VERSION:
            raise Finger3dError(
                f"{path}: version {header.get('version')}, this finger3d reads version {VERSION}; condense it again"
            )
        try:
            model = _model(header, arrays)
            axes = tuple(header["axes"])
            check_arrays(arrays, 2 if model.domain != "solid" else 3, len(model.gauges))
            problem = _assembled(model, arrays, float(header["touch_mm"]), axes)
            return cls(problem, _face("other", arrays, problem.dim), header["about"])
        except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError):
            raise Finger3dError(
                f"{path}: parts of the condensed body are missing or damaged; condense the scene again"
            ) from None


def _kinetic(law: FrictionLaw, ratio: float | None, branch: str | None) -> FrictionLaw:
    from finger3d.effects.kinetic_friction import TwoCoefficients

    if not isinstance(law, Coulomb | TwoCoefficients):
        raise Finger3dError(f"ratio and branch: {type(law).__name__} has no kinetic coefficient")
    before = law if isinstance(law, TwoCoefficients) else TwoCoefficients(law.mu, 1.0, "keep")
    ratio = before.ratio if ratio is None else float(ratio)
    return replace(before, ratio=ratio, branch=cast(Any, branch) or before.branch)


def _friction_laws() -> dict[str, type[FrictionLaw]]:
    """Return the friction laws that a file may name."""
    from finger3d.effects.kinetic_friction import TwoCoefficients

    return {law.__name__: law for law in (Coulomb, TwoCoefficients)}


def _face_arrays(name: str, face: BoundarySurface) -> dict[str, Any]:
    mean = face.average.tocsr()
    return {
        f"{name}_nodes": face.nodes, f"{name}_points": face.points, f"{name}_area": face.area,
        f"{name}_samples": face.samples, f"{name}_mean": mean.data, f"{name}_mean_at": mean.indices,
        f"{name}_mean_rows": mean.indptr,
    }  # fmt: skip


def _face(name: str, arrays: Mapping[str, Any], dim: int) -> BoundarySurface:
    """A surface that knows where the object is over it, and nothing of a mesh."""
    samples, nodes = arrays[f"{name}_samples"].reshape(-1, dim), arrays[f"{name}_nodes"]
    parts = (arrays[f"{name}_mean"], arrays[f"{name}_mean_at"], arrays[f"{name}_mean_rows"])
    mean = sp.csr_matrix(parts, shape=(len(nodes), len(samples)))
    mean.check_format(full_check=True)  # of a file: its indices must be in range
    points = arrays[f"{name}_points"].reshape(-1, dim)
    none = sp.csr_matrix((len(nodes), 0)), sp.csr_matrix((len(samples), 0))
    return BoundarySurface(nodes, points, arrays[f"{name}_area"], none[0], samples, mean, none[1])


def _bare(face: BoundarySurface) -> BoundarySurface:
    """The same surface with only the samples that its points read."""
    used = np.unique(face.average.tocsr().indices)
    light = replace(face, samples=face.samples[used], average=face.average.tocsr()[:, used])
    return _face("it", _face_arrays("it", light), face.points.shape[1])


def _arrays_of(problem: Problem) -> dict[str, Any]:
    c, d = problem.delassus.shape[:2]
    arrays = {
        "compliance": problem.delassus.reshape(c * d, c * d),
        "gauge_rows": problem.gauge_rows,
        "parent": problem.image_of,
        "sign": problem.mirror_sign,
        "share": problem.multiplicity,
        "nodes": problem.points.nodes,
        "points": problem.points.points,
        "area": problem.points.area,
        "band": np.array([problem.points.half_width_mm, problem.points.band_mm]),
        "edges": problem.points.edges,
        **_face_arrays("face", _bare(problem.surface)),
    }
    if problem.without_inclusions:
        arrays |= {
            "bare_compliance": problem.without_inclusions.delassus.reshape(c * d, c * d),
            "bare_gauge_rows": problem.without_inclusions.gauge_rows,
        }
    return arrays


def _assembled(model: Model, arrays: Mapping[str, Any], touch_mm: float, axes: tuple[str, ...]) -> Problem:
    """A problem of nothing but arrays: what its mesh and factor would be is empty, and nobody asks."""
    d = arrays["sign"].shape[1]
    c = len(arrays["face_nodes"])
    none, whole = np.zeros(0, dtype=np.int64), sp.csr_matrix((0, 0))
    mesh = Mesh(np.zeros((0, d)), np.zeros((0, 1), dtype=np.int64), {})
    report = MeshReport(0, 0, math.nan, math.nan, math.nan, "", False, None, {})
    elastic = Elasticity.of(model.material.E_MPa, model.material.nu, model.domain == "plane-stress")
    factored = Factored(np.zeros((0, 0)), 0, 0, 0.0, "none", whole, none, _no_mesh)
    half_width, band = arrays["band"]
    points = ContactPoints(
        arrays["nodes"], arrays["points"], arrays["area"], model.object.frame(d), float(half_width), float(band),
        arrays["edges"],
    )  # fmt: skip
    problem = Problem(
        model, mesh, report, elastic, Stiffness(whole, none, 1.0), _face("face", arrays, d), factored,
        arrays["compliance"].reshape(c, d, c, d), arrays["gauge_rows"].reshape(len(model.gauges), c * d), none, none,
        1.0, touch_mm, axes, points, arrays["parent"], arrays["sign"], arrays["share"], {},
    )  # fmt: skip
    if "bare_compliance" not in arrays:
        return problem
    rows = arrays["bare_gauge_rows"].reshape(len(model.gauges), c * d)
    return replace(
        problem,
        without_inclusions=replace(problem, delassus=arrays["bare_compliance"].reshape(c, d, c, d), gauge_rows=rows),
    )


def _no_mesh(load: Float) -> Float:
    raise Finger3dError("a condensed body has no mesh: fields need the scene itself (finger3d press)")


def _header(problem: Problem) -> dict[str, Any]:
    model = problem.model
    thing = model.object
    placed = {f.name: getattr(thing, f.name) for f in fields(thing) if f.name != "surface"}  # type: ignore[arg-type]
    return {
        "body": asdict(model.design), "material": asdict(model.material), "mesh": asdict(model.mesh),
        "legs": [asdict(leg) for leg in model.legs], "object": {"kind": type(thing).__name__, **placed},
        "friction": {"kind": type(model.friction).__name__, **asdict(model.friction)},
        "gauges": [asdict(g) for g in model.gauges], "domain": model.domain, "rule": model.rule,
        "warnings": list(model.warnings), "filled": [list(f) for f in model.filled], "axes": list(problem.axes),
        "touch_mm": problem.first_contact_mm,
    }  # fmt: skip


def _model(header: Mapping[str, Any], arrays: Mapping[str, Any]) -> Model:
    placed = dict(header["object"])
    kind = placed.pop("kind")
    if kind == "MeshObject":
        from finger3d.geometry.surface import Triangles

        placed["surface"] = Triangles(arrays["object_points"], arrays["object_faces"])
    rubs = dict(header["friction"])
    law: FrictionLaw = _made(_friction_laws()[rubs.pop("kind")], rubs)
    if header["domain"] not in ("solid", "plane-strain", "plane-stress") or header["rule"] not in RULES:
        raise ValueError("domain or rule")
    if not header["legs"] or not set(header["axes"]) <= {"x", "z"} or _number(header["touch_mm"]) <= 0.0:
        raise ValueError("legs, axes or touch_mm")
    body, material = _made(DesignSummary, header["body"]), _made(Material, header["material"])
    legs = tuple(_made(Leg, leg) for leg in header["legs"])
    if not (body.height_mm > 0.0 < body.width_mm and material.E_MPa > 0.0 <= material.nu <= 0.5):
        raise ValueError("body or material")
    if not all(0.0 <= leg.depth_mm <= 10.0 * body.height_mm for leg in legs):
        raise ValueError("a depth")
    return Model(
        body, material, _made(MeshOptions, header["mesh"]), legs, _made(_SHAPES[kind], placed), law,
        gauges=tuple(_made(Gauge, g) for g in header["gauges"]), domain=header["domain"], rule=header["rule"],
        symmetry=tuple(header["axes"]), warnings=tuple(map(str, header["warnings"])),
        filled=tuple((str(slot), str(effect)) for slot, effect in header["filled"]),
    )  # fmt: skip


def _number(value: Any) -> float:
    """The value as a float.

    Raises
    ------
    ValueError
        If it is no finite number.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{value!r} is no finite number")
    return float(value)


def _made(kind: Any, values: Mapping[str, Any]) -> Any:
    """A dataclass from the header, whose fields have the types that it declares.

    Raises
    ------
    ValueError, TypeError
        If a field is missing, unknown, or of another type.
    """
    made = kind(**values)
    for field in fields(kind):
        value, declared = getattr(made, field.name), str(field.type)
        if value is None and declared.endswith("| None"):
            continue
        if declared.startswith("float"):
            _number(value)
        elif declared.startswith("int") and value != "auto" and (type(value) is not int or not 1 <= value <= _STEPS):
            raise ValueError(f"{field.name} is no number of increments")
        elif declared == "str" and not isinstance(value, str):
            raise ValueError(f"{field.name} is no text")
        elif field.name == "axis" and value not in ("x", "z"):
            raise ValueError("axis is neither x nor z")
    return made
