"""Error bars of a press: what its mesh and its increments leave unsaid, from another run of each.

The companion has about twice the edge lengths, so at best an eighth of the cells of a solid and a quarter of those of a
section; what it changes is taken to the mesh at hand by the order of convergence (Richardson).  A mesh than which none
is coarser is small, and gets a finer companion.  The order is that of quadratic elements with a bonded corner, 2 lambda
(Williams 1952), for smooth data it would be higher.  `finger3d.accuracy.point_resolution` bounds the bars of lengths
and areas from below.  An object that yields is meshed anew with the finger, so a bar covers both.
``validation/error_bars.py`` says how far the estimates may be trusted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.accuracy.point_resolution import Grain
from finger3d.errors import Finger3dError, UnresolvedError
from finger3d.fem.traces import surface
from finger3d.io import AREAS, MAIN
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import MeshOptions, Model
from finger3d.mechanics.solve import Problem, build, contact_box, symmetry
from finger3d.mechanics.step_halving import TIMES, as_solved, error_by_count, last_frame, other_counts, step_error
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.swept import mesh_section
from finger3d.objects import Sphere
from finger3d.objects.triangulated import MeshObject

Float = NDArray[np.float64]
Say = Callable[[str], None]
Told = Callable[[Problem, StepResult], dict[str, float]]

FACTOR = 2.0
_FINER = 0.5
"""Where no mesh is coarser; such a mesh is small.  Its square where a curved body is finer already than was asked."""

_FACTOR_WHERE_GRADED = 3.0
"""Of a swept companion beside an unstructured mesh, if at 2 it has as many unknowns, fine all along x and z."""

_LEAST_UNSTRUCTURED = 15_000
"""Unknowns; asked for longer edges, pytetwild gives a curved body few less, and takes longer than for a finer mesh."""

_FACTOR_WHERE_STEPS_FACTOR = 2.5
"""Of a section whose every step factors anew: at 2 its companion would take half as long as the press itself."""

ORDER = 1.2
"""Of the corners of the base at nu = 0.49, the lowest of all (validation/bonded_layer.py)."""

_LEAST_RATIO = 1.25
_STEPS_SHARE, _STEPS_S = 0.15, 0.2
"""More increments may take this share of the time so far, or so many seconds."""

_READ_S = 1.0
"""Reading meshes from the cache takes less, making them by pytetwild more."""

_FLOOR = 0.1
"""An edge told by points of distance h leaves a force uncertain by about this times (h/a)^2, friction and strains by
this times h/a; calibrated in validation/error_bars.py, where changes that cancel would promise more."""

_FORCES = ("normal_force_N", "force_N_per_mm")


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated errors of the last step, in the unit of each number.

    Attributes
    ----------
    discretisation, steps : by name, those of `MAIN` and ``gauge_<name>``
    method : one line on how, or ``no estimate: ...``
    seconds : what the estimate took
    beside : the numbers of the companion
    ratio : how many times longer its edges are; below 1 where it is the finer one
    """

    discretisation: dict[str, float]
    steps: dict[str, float]
    method: str
    seconds: float = 0.0
    beside: dict[str, float] = field(default_factory=dict)
    ratio: float = math.nan

    def as_dict(self) -> dict[str, Any]:
        """For summary.json."""
        return {key: getattr(self, key) for key in ("discretisation", "steps", "method", "seconds")}

    def of(self, name: str) -> float | None:
        """Both errors of a number together, None without an estimate."""
        found = [part[name] for part in (self.discretisation, self.steps) if name in part]
        return sum(found) if name in self.discretisation else None


def main_numbers(problem: Problem, frame: StepResult) -> dict[str, float]:
    """The numbers that get an error bar, by name."""
    told = measure(problem.points, frame)
    return {name: told[name] for name in (*MAIN, *AREAS)} | {f"gauge_{k}": v for k, v in told["gauges"].items()}


def press_numbers(problem: Problem, frame: StepResult) -> dict[str, float]:
    """Those of a press that get an error bar: the main numbers and both energies."""
    energies = {"external_work_mJ": frame.external_work_mJ, "dissipation_mJ": frame.dissipation_mJ}
    return main_numbers(problem, frame) | energies


def coarser(model: Model, factor: float = FACTOR) -> Model:
    """The companion: edge lengths times a factor, within the finger; swept where the design has a section.

    A swept companion may have a single layer over half the width: with two it would be no coarser along z than a mesh
    whose edges are longer than a quarter of the width.
    """
    design, options = model.design, model.mesh
    section = min(design.height_mm, 2.0 * design.half_length_mm)
    base = min(factor * options.base_size_mm, section)
    size = min(factor * options.size_mm, base, design.width_mm if model.domain == "solid" else math.inf)
    mesher: Any = "swept" if design.section() is not None else options.mesher
    return replace(model, mesh=replace(options, size_mm=size, base_size_mm=base, mesher=mesher, layers=1))


def mesh_error(
    told: Mapping[str, float], other: Mapping[str, float], ratio: float, grains: tuple[Grain, Grain]
) -> dict[str, float]:
    """Discretisation error by name.

    Parameters
    ----------
    told, other : numbers of the run and of its companion: those of `MAIN`, gauges, or those of `compare`
    ratio : how many times longer the companion's edges are; below 1 where it is the finer one
    grains : of both
    """
    found = {}
    by = gain(ratio)
    strain = max((abs(v) for k, v in told.items() if k.startswith("gauge_")), default=0.0)
    for name, value in told.items():
        change = abs(value - other[name])
        if is_length(name):
            ends = 0.5 if "_half_" in name else 1.0
            # the companion's own rounding to points is no change of the length
            change = max(0.0, change - ends * grains[1].spacing_mm)
            found[name] = max(change / by, ends * grains[0].spacing_mm, grains[0].least.get(name, 0.0))
        elif name in AREAS:
            change = max(0.0, change - grains[1].least.get(name, 0.0))
            found[name] = max(change / by, grains[0].least.get(name, 0.0))
        else:
            share = _FLOOR * grains[0].share ** (2 if name in _FORCES else 1)
            scale = strain if name.startswith("gauge_") else abs(value)
            if grains[0].alone and name.startswith("friction_sum"):
                scale = max(scale, *(abs(told[key]) for key in _FORCES if key in told))
            found[name] = max(change / by, share * scale, grains[0].least.get(name, 0.0))
    return {k: float(v) for k, v in found.items() if math.isfinite(v)}


def gain(ratio: float) -> float:
    """The change to a companion over the error of the run, edges being `ratio` times as long there (Richardson)."""
    return abs(ratio**ORDER - 1.0)


def is_length(name: str) -> bool:
    """Whether a number is a length, which points tell."""
    return name.endswith(("_length_mm", "_length_end_mm"))


def companion(problem: Problem, say: Say = lambda text: None) -> Problem:
    """The problem beside one, condensed: coarser, or finer where none is coarser.

    What cannot be swept is meshed once, which may take as long as its own mesh did, and then lies in the cache.

    Raises
    ------
    Finger3dError
        Where neither mesh can be made, or none differs enough to tell anything.
    """
    coarse, fine = companions(problem.model, problem.mesh.points.size)
    for chosen, enough in ((coarse, lambda r: r >= _LEAST_RATIO), (fine, lambda r: r <= 1.0 / _LEAST_RATIO)):
        for options in chosen:
            if beside := _built_if(problem, replace(problem.model, mesh=options), enough, say):
                return beside
    raise Finger3dError("no other mesh differs enough from this one to tell anything; change mesh.size_mm")


def companions(model: Model, unknowns: float) -> tuple[list[MeshOptions], list[MeshOptions]]:
    """Meshes that may stand beside one of so many unknowns: coarser ones and finer ones, the best first."""
    own, enough = model.mesh, unknowns >= _LEAST_UNSTRUCTURED
    costly = model.domain != "solid" and model.formulation.finite_strain
    longer = coarser(model, _FACTOR_WHERE_STEPS_FACTOR if costly else FACTOR).mesh
    chosen = [longer] if longer.mesher == "swept" or enough else []
    if model.domain == "solid" and own.mesher != longer.mesher:
        chosen.append(coarser(model, _FACTOR_WHERE_GRADED).mesh)
        chosen += [replace(longer, mesher=own.mesher)] if enough else []
    finer = [
        replace(own, size_mm=f * own.size_mm, base_size_mm=f * own.base_size_mm, layers=round(own.layers / f))
        for f in (_FINER, _FINER**2)
    ]
    return chosen, finer


def _built_if(problem: Problem, model: Model, enough: Callable[[float], bool], say: Say) -> Problem | None:
    """A companion, condensed, if the ratio of edges is enough and the object does not pass between its points.

    A structured mesh is looked at first.
    """
    if model.domain != "solid" or model.mesh.mesher == "swept":
        made = mesh_solid if model.domain == "solid" else mesh_section
        mesh = made(model.design, model.mesh, contact_box(model), symmetry(model))[0]
        if not enough((problem.mesh.points.size / mesh.points.size) ** (1.0 / problem.dim)):
            return None
    try:
        beside = built_like(problem, model, say if _unstructured(model) else lambda text: None)
    except UnresolvedError:
        return None
    return beside if enough(_ratio(problem, beside)) else None


def built_like(problem: Problem, model: Model, say: Say = lambda text: None) -> Problem:
    """Another model condensed, to all of its contact face where the problem keeps all of its own."""
    everything = len(surface(problem.mesh, "contact", problem.thickness).nodes) == len(problem.surface.nodes)
    return build(model, say, margin=math.inf) if everything else build(model, say)


def compared(
    problem: Problem, frame: StepResult, beside: Problem, last: StepResult, told: Told = main_numbers
) -> dict[str, float]:
    """Discretisation error by name, of what is told of a frame of a problem, from that of its companion."""
    grains = Grain.of(problem, frame), Grain.of(beside, last)
    return mesh_error(told(problem, frame), told(beside, last), _ratio(problem, beside), grains)


def _ratio(problem: Problem, beside: Problem) -> float:
    """How many times longer the companion's edges are: by the unknowns, as those at the base are bounded by the finger.

    Of two unstructured meshes at the contact, as far from it their edges follow a growth that both share; between an
    unstructured mesh and a swept one, which are graded otherwise, the geometric mean of both.
    """
    by_unknowns = float((problem.stiffness.upper.shape[0] / beside.stiffness.upper.shape[0]) ** (1.0 / problem.dim))
    wild = sum(p.dim == 3 and p.model.mesh.mesher != "swept" for p in (problem, beside))
    if not wild:
        return by_unknowns
    at_contact = _spacing(beside) / _spacing(problem)
    return at_contact if wild == 2 else math.sqrt(by_unknowns * at_contact)


def _spacing(problem: Problem) -> float:
    """Typical distance (mm) of contact points where contact is predicted."""
    x0, x1, z0, z1 = contact_box(problem.model)
    at = problem.points.points
    inside = (at[:, 0] >= x0) & (at[:, 0] <= x1) & (at[:, 2] >= z0) & (at[:, 2] <= z1)
    return float(np.sqrt(np.median(problem.points.area[inside if inside.any() else slice(None)])))


def strain_error(problem: Problem, frame: StepResult, beside: Problem, fine: Float, coarse: Float) -> Float:
    """Discretisation error (m,) of a gauge's strain (m,) at several coefficients of friction, from its companion's;
    the grain is that of a last `frame` at any of them.
    """
    told, other = ({f"gauge_{k}": float(v) for k, v in enumerate(strain)} for strain in (fine, coarse))
    found = mesh_error(told, other, _ratio(problem, beside), (Grain.of(problem, frame),) * 2)
    return np.array([found.get(name, math.nan) for name in told])


def estimate(
    problem: Problem,
    frames: Sequence[StepResult],
    spent: Mapping[str, float],
    say: Say = lambda text: None,
    told: Told = main_numbers,
    levels: Sequence[tuple[int, StepResult]] = (),
) -> ErrorEstimate:
    """Estimate the errors of the last frame by another mesh, coarser if there is one, and by other increments.

    Parameters
    ----------
    problem, frames : the press as it was solved, all increments good
    spent : seconds by stage, which say how many more increments are affordable, and on which mesh
    say : told what is being done, where it may take long
    told : the numbers by name of a problem's frame; see `mesh_error` for the names
    levels : number of increments and last frame of every run by which automatic increments were chosen, if all are

    Returns
    -------
    ErrorEstimate
        Without numbers, and with the reason, where there is no companion; nothing of it can fail a press.
    """
    start = time.perf_counter()
    try:
        found = _estimated(problem, frames, spent, say, told, levels)
    except (Finger3dError, RuntimeError, ValueError, np.linalg.LinAlgError, MemoryError) as error:
        found = ErrorEstimate({}, {}, f"no estimate: {error}")
    return replace(found, seconds=time.perf_counter() - start)


def _estimated(
    problem: Problem, frames: Sequence[StepResult], spent: Mapping[str, float], say: Say, told: Told,
    levels: Sequence[tuple[int, StepResult]],
) -> ErrorEstimate:  # fmt: skip
    if not frames or not frames[-1].outcome.ok:
        raise Finger3dError("the last step did not converge")
    # increments chosen by halving are numbers by now
    model = replace(problem.model, legs=as_solved(problem.model.legs, len(frames)))
    own = replace(problem, model=model)
    beside = companion(own, say)
    begin = time.perf_counter()
    last = last_frame(beside)
    beside_s = time.perf_counter() - begin
    mesh = compared(own, frames[-1], beside, last, told)
    ratio = _ratio(own, beside)
    kind = "coarse" if ratio > 1.0 else "finer"
    if len(levels) > 1 and all(leg.steps == "auto" for leg in problem.model.legs):
        used = levels[-4:]
        steps = error_by_count({count: told(own, frame) for count, frame in used}, used[-1][0])
        by = ", ".join(str(count) for count, _ in used)
    else:
        here, way = other_counts(spent["contact"], beside_s, max(_STEPS_SHARE * sum(spent.values()), _STEPS_S))
        where = (own, frames[-1]) if here else (beside, last)
        steps = step_error(where[0], told(*where), told, way)
        by = " and ".join({0.25: "a quarter", 0.5: "half", 2: "twice", 4: "four times"}[t] for t in TIMES[way])
        by += " as many" + ("" if here else f" on the {kind} mesh")
    return ErrorEstimate(
        mesh, steps, f"{_on_mesh(beside, kind)}; steps: {by}, order 1", beside=told(beside, last), ratio=ratio
    )


def _on_mesh(beside: Problem, kind: str) -> str:
    """How the error of the mesh was found, and what was paid once for it."""
    options = beside.model.mesh
    mesher = options.mesher if beside.dim == 3 else "structured"
    told = f"{mesher}, {options.size_mm:.4g} and {options.base_size_mm:.4g} mm"
    told += ", of both bodies" if beside.model.object_compliance else ""
    text = f"mesh: {beside.stiffness.upper.shape[0]} dofs ({told}) beside, {'finer, ' * (kind == 'finer')}order {ORDER}"
    made = beside.seconds["cad"] + beside.seconds["mesh"] + beside.seconds.get("object_mesh", 0.0)
    if _unstructured(beside.model) and made > _READ_S:
        text += f" (meshing took {made:.1f} s; kept in the cache, it is paid once)"
    return text


def _unstructured(model: Model) -> bool:
    """Whether pytetwild meshes the finger or the object."""
    soft = model.object_compliance is not None and isinstance(model.object, Sphere | MeshObject)
    return model.domain == "solid" and (soft or model.mesh.mesher != "swept")
