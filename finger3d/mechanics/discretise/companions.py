"""Companions of a press: the same scene on other meshes, from which the discretisation error is estimated.

Their edges are sqrt(2), 2 and 4 times as long, with which they have 0.35, 0.13 and 0.02 of the unknowns of a solid.  A
mesh too small to be coarsened gets a finer companion, and so does one that was given: its cells are halved.  A coarse
solid gets one besides.  An elastic object is meshed anew together with the finger, so that the estimate covers both.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import numpy as np

from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.fem.surface import contact_face, surface
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.contact_points import MARGIN
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.given import GivenMesh
from finger3d.meshing.sizing import SizedPlaces
from finger3d.meshing.swept import mesh_section
from finger3d.progress import QUIET, Progress

FACTOR = 2.0
"""Edge length of the coarser companion over that of the mesh, where there is one only."""

_FACTORS = 2.0, math.sqrt(2.0), 4.0
"""Edge lengths of three coarser companions: single differences are small by chance; it is their spread that tells."""

_APART = 1.15
"""Least ratio of edge lengths of two companions of one mesh, which are bounded by the finger."""

_FINER_FACTOR, _FINER_IF_DEAR = 0.5, 0.7
"""Edge length of the finer companion over that of the mesh; its square is tried next, since a curved body may already
be meshed finer than requested.  In solids at finite strain, where every increment factorises the tangent, a companion
at the first would take some forty times the time of the press."""

_MOST_SWEPT = 0.85
"""Most unknowns of a swept companion of an unstructured mesh over those of the mesh, times the ratio of edges."""

_LEAST_IN_SECTION = 2000
"""Unknowns of a section below which companions are finer: coarser ones tell too little, finer ones cost nothing."""

LEAST_IN_SOLID = 10_000
"""Unknowns of a solid below which it gets a finer companion besides: in coarser ones the errors at its base and at the
contact may cancel.  Of swept fingers with 4 000 to 8 000 unknowns, half had forces off by 2 to 6 bars without it.
In those, cells that were bisected do not count."""

_LEAST_UNSTRUCTURED_UNKNOWNS = 15_000
"""Unknowns below which an unstructured mesh is not coarsened: pytetwild needs nearly as many for any curved body."""

_BISECTIONS = ((0.5, 18.0), (0.75, 6.5))
"""Edge lengths of a bisected companion over those of the mesh, and its unknowns over those of the mesh, measured; the
first with few enough unknowns is taken."""

_LARGEST_BISECTED_UNKNOWNS = 200_000
"""Largest number of unknowns of a bisected companion, which takes half a minute."""

LEAST_RATIO = 1.25
"""Smallest ratio of edge lengths from which an error is estimated."""


def coarser(model: Model, factor: float = FACTOR) -> Model:
    """Return the model with edge lengths times a factor, bounded by the finger; swept where the design has a section.

    A swept companion may have a single layer over half the width: with two it would be no coarser along z than a mesh
    whose edges are longer than a quarter of the width.
    """
    design, options = model.design, model.mesh
    section = min(design.height_mm, 2.0 * design.half_length_mm)
    base = min(factor * options.base_size_mm, section)
    size = min(factor * options.size_mm, base, design.width_mm if model.domain == "solid" else math.inf)
    mesher = "swept" if design.section() is not None else options.mesher
    borders = _scaled(options, factor)
    longer = replace(options, size_mm=size, base_size_mm=base, mesher=mesher, layers=1, borders=borders)
    return replace(model, mesh=longer)


def _coarser_options(problem: Problem, factor: float) -> MeshOptions:
    """Return the options of a coarser mesh, swept unless it then had too many unknowns.

    A swept mesh is fine along the whole of x and z, an unstructured one at the contact only.
    """
    model, options = problem.model, coarser(problem.model, factor).mesh
    if model.domain != "solid" or options.mesher == model.mesh.mesher:
        return options
    swept = mesh_solid(model.design, options, model.first_contact.contact_box, symmetry(model))[0]
    few = swept.points.size <= _MOST_SWEPT / factor * problem.mesh.points.size
    return options if few else replace(options, mesher=model.mesh.mesher)


def _scaled(options: MeshOptions, factor: float) -> SizedPlaces | None:
    """Return the edge lengths at the border of stick times a factor, so that a companion differs there, too."""
    return options.borders and replace(options.borders, size=factor * options.borders.size)


def companion(problem: Problem, report: Progress = QUIET) -> Problem:
    """Return the first condensed companion of a problem: a coarser one, or a finer one where there is none.

    Unstructured meshes are kept in the cache of meshes.

    Raises
    ------
    Finger3dError
        Where no mesh can be made, or none differs enough for an estimate.
    """
    coarse = next((beside for _, beside in coarse_companions(problem, report)), None)
    return coarse or next(finer_companions(problem, report))[1]


def finer_companions(
    problem: Problem, report: Progress = QUIET, beside_coarser: bool = False
) -> Iterator[tuple[float, Problem]]:
    """Yield the condensed problems on finer meshes, and their edge lengths over those of the mesh.

    There is one of a solid or of a mesh that was given, and two of a section.

    Parameters
    ----------
    beside_coarser : whether there are coarser companions, too, so that the finer one may be less fine

    Raises
    ------
    Finger3dError
        If none differs enough for an estimate.
    """
    model, own, found = problem.model, problem.model.mesh, 0
    if isinstance(model.design, GivenMesh):
        candidates = [_bisected(own, problem.mesh.points.size)]
    else:
        is_dear = model.domain == "solid" and (model.finite_strain or beside_coarser)
        factor = _FINER_IF_DEAR if is_dear else _FINER_FACTOR
        factors = (factor, factor**2) if model.domain == "solid" else (factor, factor**0.5, factor**2)
        candidates = [replace(_bisected_by(own, f), layers=round(own.layers / f)) for f in factors]
    for options in candidates:
        try:
            beside = built_like(problem, replace(model, mesh=options), report if is_unstructured(model) else QUIET)
        except UnresolvedError:
            continue
        ratio = edge_ratio(problem, beside)
        if ratio <= 1.0 / LEAST_RATIO:
            found += 1
            yield ratio, beside
        if found == (2 if problem.dim == 2 else 1):
            return
    if not found:
        raise Finger3dError("no other mesh differs enough from this one for an estimate; change mesh.size_mm")


def coarse_companions(
    problem: Problem, report: Progress = QUIET, known: Problem | None = None, unknowns: int | None = None
) -> Iterator[tuple[float, Problem]]:
    """Yield the condensed problems on coarser meshes, and their edge lengths over those of the mesh.

    Meshes that do not resolve the contact are left out.

    Parameters
    ----------
    known : the first, with twice the edges
    unknowns : of a solid, below which it gets a finer companion besides; default: those of the mesh
    """
    model, ratios, sizes = problem.model, list[float](), {problem.mesh.points.size}
    if isinstance(model.design, GivenMesh) or (problem.dim == 2 and problem.mesh.points.size < _LEAST_IN_SECTION):
        return
    if known:
        ratios.append(known.model.mesh.size_mm / model.mesh.size_mm)
        sizes.add(known.mesh.points.size)
        yield ratios[0], replace(known, model=replace(known.model, legs=model.legs))
    for factor in _FACTORS[1:] if known else _FACTORS:
        options = _coarser_options(problem, factor)
        ratio = options.size_mm / model.mesh.size_mm
        least = 0 if options.mesher == "swept" else _LEAST_UNSTRUCTURED_UNKNOWNS * (factor / FACTOR) ** 3
        alike = any(max(ratio / r, r / ratio) < _APART for r in ratios)
        if problem.mesh.points.size < least or ratio < LEAST_RATIO or alike:
            continue
        try:
            beside = built_like(problem, replace(model, mesh=options), report if is_unstructured(model) else QUIET)
        except Finger3dError:
            continue
        if beside.mesh.points.size not in sizes:  # the finger allows no other number of cells
            ratios.append(ratio)
            sizes.add(beside.mesh.points.size)
            yield ratio, beside
    is_swept = problem.dim == 3 and model.mesh.mesher == "swept"
    unknowns = unknowns or (_unknowns(problem) if is_swept else problem.mesh.points.size)
    if problem.dim == 3 and unknowns < LEAST_IN_SOLID and ratios:
        with suppress(Finger3dError):
            yield from finer_companions(problem, report, beside_coarser=True)


def _bisected(own: MeshOptions, unknowns: float) -> MeshOptions:
    """Return the options of the companion of a mesh that was given: its cells are halved, and cannot be joined.

    Raises
    ------
    Finger3dError
        If the companion would have too many unknowns.
    """
    factor = next((f for f, growth in _BISECTIONS if growth * unknowns <= _LARGEST_BISECTED_UNKNOWNS), None)
    if factor is None:
        raise Finger3dError(
            "the mesh was given, and is too large to be halved everywhere; press a coarser mesh of the body to compare"
        )
    return _bisected_by(own, factor)


def _bisected_by(own: MeshOptions, f: float) -> MeshOptions:
    return replace(own, size_mm=f * own.size_mm, base_size_mm=f * own.base_size_mm, borders=_scaled(own, f))


def built_like(problem: Problem, model: Model, report: Progress = QUIET, margin: float = MARGIN) -> Problem:
    """Return another model condensed, onto its whole contact face if the problem keeps its whole contact face."""
    face = surface(problem.mesh, "contact", problem.body.thickness)
    everything = len(face.nodes) == len(contact_face(problem.surface).nodes)
    return build(model, report, margin=math.inf if everything else margin)


def edge_ratio(problem: Problem, beside: Problem) -> float:
    """Return the ratio of edge lengths, companion over mesh.

    Between swept meshes the ratio follows from the numbers of unknowns, since edges at the base are bounded by the
    finger; between unstructured meshes from the distance of contact points, since both grow alike away from the
    contact; between an unstructured and a swept mesh it is the geometric mean of the two.  Cells added
    around gauges and at the border of stick do not count: their number is nearly the same at all edge lengths.
    """
    by_unknowns = float((_unknowns(problem) / _unknowns(beside)) ** (1.0 / problem.dim))
    wild = sum(p.dim == 3 and p.model.mesh.mesher != "swept" for p in (problem, beside))
    if not wild:
        return by_unknowns
    at_contact = _spacing(beside) / _spacing(problem)
    return at_contact if wild == 2 else math.sqrt(by_unknowns * at_contact)


def _unknowns(problem: Problem) -> int:
    """Return the number of unknowns of a mesh, of the displacements only if cells were bisected since."""
    model = problem.model
    if (model.mesh.gauge_refinement == 1.0 or not model.gauges) and not model.mesh.borders:
        return int(problem.body.stiffness.upper.shape[0])
    made = mesh_solid if model.domain == "solid" else mesh_section
    return int(made(model.design, model.mesh, model.first_contact.contact_box, symmetry(model))[0].points.size)


def _spacing(problem: Problem) -> float:
    """Return the typical distance (mm) of contact points where contact is predicted."""
    x0, x1, z0, z1 = problem.model.first_contact.contact_box
    at = problem.points.points
    inside = (at[:, 0] >= x0) & (at[:, 0] <= x1) & (at[:, 2] >= z0) & (at[:, 2] <= z1)
    return float(np.sqrt(np.median(problem.points.area[inside if inside.any() else slice(None)])))


def is_unstructured(model: Model) -> bool:
    """Return whether pytetwild meshes the finger or the object."""
    soft = model.object_compliance is not None and model.object.body_mesher != "swept"
    return model.domain == "solid" and (soft or model.mesh.mesher != "swept")
