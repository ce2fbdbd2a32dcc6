"""Error bars of a press: what its mesh and its increments leave unsaid, from a coarser run of each.

The coarse companion has about twice the edge lengths, so an eighth of the cells of a solid and a quarter of those of a
section; what it changes is taken down to the mesh at hand by the order of convergence (Richardson).  The order is that
of quadratic elements with a bonded corner, 2 lambda (Williams 1952), for smooth data it would be higher.  A length is
told by points, so its error is never below half their spacing.  ``validation/error_bars.py`` says how far the
estimates may be trusted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.errors import Finger3dError
from finger3d.fem.surface import surface
from finger3d.history import Frame, measure
from finger3d.kinematics import SmallStrain
from finger3d.model import Leg, Model
from finger3d.objects import Sphere
from finger3d.objects.mesh import MeshObject
from finger3d.solve import AUTO_START, Problem, build, contact_zone, march, symmetry

Float = NDArray[np.float64]

MAIN = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")
"""The numbers that get an error bar, beside every gauge."""

FACTOR = 2.0
_FACTOR_WHERE_STEPS_FACTOR = 2.5
"""Of a section whose every step factors anew: at 2 its companion would take half as long as the press itself."""

ORDER = 1.2
"""Of the corners of the base at nu = 0.49, the lowest of all (validation/bonded_layer.py)."""

STEP_ORDER = 1.0
_LEAST_RATIO = 1.25
_STEPS_SHARE, _STEPS_S = 0.15, 0.2
"""More increments may take this share of the time so far, or so many seconds."""

_FLOOR = 0.1
"""An edge told by points of distance h leaves a force uncertain by about this times (h/a)^2, friction and strains by
this times h/a; calibrated in validation/error_bars.py, where changes that cancel would promise more."""

_LENGTHS = ("contact_half_length_mm", "stick_half_length_mm")


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated errors of the last step, in the unit of each number.

    Attributes
    ----------
    discretisation, steps : by name, those of `MAIN` and ``gauge_<name>``
    method : one line on how, or ``no estimate: ...``
    seconds : what the estimate took
    """

    discretisation: dict[str, float]
    steps: dict[str, float]
    method: str
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """For summary.json."""
        return asdict(self)

    def of(self, name: str) -> float | None:
        """Both errors of a number together, None without an estimate."""
        found = [part[name] for part in (self.discretisation, self.steps) if name in part]
        return sum(found) if name in self.discretisation else None


def main_numbers(problem: Problem, frame: Frame) -> dict[str, float]:
    """The numbers that get an error bar, by name."""
    told = measure(problem.points, frame)
    return {name: told[name] for name in MAIN} | {f"gauge_{k}": v for k, v in told["gauges"].items()}


def coarser(model: Model, factor: float = FACTOR) -> Model:
    """The companion: edge lengths times a factor, within the finger; swept where the design has a section."""
    design, options = model.design, model.mesh
    section = min(design.height_mm, 2.0 * design.half_length_mm)
    base = min(factor * options.base_size_mm, section)
    size = min(factor * options.size_mm, base, design.width_mm if model.domain == "solid" else math.inf)
    mesher: Any = "swept" if hasattr(design, "section") else options.mesher
    return replace(model, mesh=replace(options, size_mm=size, base_size_mm=base, mesher=mesher))


@dataclass(frozen=True)
class Grain:
    """How finely the contact points tell: their distance (mm) along x, and the larger of that over the half-length of
    the contact and of their distance along z over the half width.
    """

    spacing_mm: float
    share: float

    @classmethod
    def of(cls, problem: Problem, frame: Frame) -> Grain:
        """Of a frame; medians where points touch."""
        points, reach = problem.points, measure(problem.points, frame)["contact_half_length_mm"]
        half_width = points.half_width_mm
        if points.dim == 3 and problem.model.mesh.mesher != "swept":
            step = float(np.sqrt(np.median(points.area)))
            return cls(step, _share(step, reach, step, half_width))
        at = np.round(points.points, 9)
        line = np.unique(at[at[:, 2] == 0.0, 0])
        near = line[np.abs(line - frame.lowest[0]) <= 1.2 * reach]
        steps = np.diff(near if len(near) > 1 else line)
        step = float(np.median(steps)) if len(steps) else problem.model.mesh.size_mm
        across = np.diff(np.unique(at[:, 2]))
        return cls(step, _share(step, reach, float(np.median(across)) if len(across) else 0.0, half_width))


def _share(along: float, reach: float, across: float, half_width: float) -> float:
    return min(1.0, max(along / max(reach, along), across / half_width))


def mesh_error(
    fine: Mapping[str, float], coarse: Mapping[str, float], ratio: float, grains: tuple[Grain, Grain]
) -> dict[str, float]:
    """Discretisation error by name.

    Parameters
    ----------
    fine, coarse : main numbers of the run and of its companion
    ratio : how many times longer the companion's edges are
    grains : of both
    """
    found, gain = {}, ratio**ORDER - 1.0
    strain = max((abs(v) for k, v in fine.items() if k.startswith("gauge_")), default=0.0)
    for name, value in fine.items():
        change = abs(value - coarse[name])
        if name in _LENGTHS:
            # the companion's own rounding to points is no change of the length
            change = max(0.0, change - 0.5 * grains[1].spacing_mm)
            found[name] = max(change / gain, 0.5 * grains[0].spacing_mm)
        else:
            share = _FLOOR * grains[0].share ** (2 if name == "normal_force_N" else 1)
            found[name] = max(change / gain, share * (strain if name.startswith("gauge_") else abs(value)))
    return {k: float(v) for k, v in found.items() if math.isfinite(v)}


def companion(problem: Problem) -> Problem:
    """The coarser problem beside one, condensed; all of the contact face is kept where the problem keeps it all.

    Raises
    ------
    Finger3dError
        Where the mesh is so coarse that none is coarser.
    """
    costly = problem.dim == 2 and not isinstance(problem.model.kinematics, SmallStrain)
    model = coarser(problem.model, _FACTOR_WHERE_STEPS_FACTOR if costly else FACTOR)
    _check_cost(problem, model)
    beside = built_like(problem, model)
    if _ratio(problem, beside) < _LEAST_RATIO:
        raise Finger3dError("the mesh is so coarse that no coarser one tells anything; lower mesh.size_mm")
    return beside


def built_like(problem: Problem, model: Model) -> Problem:
    """Another model condensed, to all of its contact face where the problem keeps all of its own."""
    everything = len(surface(problem.mesh, "contact", problem.thickness).nodes) == len(problem.surface.nodes)
    return build(model, margin=math.inf) if everything else build(model)


def _check_cost(problem: Problem, model: Model) -> None:
    """Refuse a companion that pytetwild would have to mesh although the problem itself took its meshes from the cache,
    and one whose object it would mesh: on a ball of 0.5 mm that took four times as long as the press.
    """
    unstructured = isinstance(model.object, Sphere | MeshObject) and model.domain == "solid"
    if model.object_compliance is not None and unstructured:
        raise Finger3dError("a coarser mesh of the elastic object would take longer than the press")
    if model.domain != "solid" or model.mesh.mesher == "swept" or not problem.report.from_cache:
        return
    from finger3d.design.tetwild import cached

    if not cached(model.design, model.mesh, contact_zone(model), symmetry(model)):
        raise Finger3dError(
            "a coarser mesh is not in the cache, and making one would take longer than the press; it is made together "
            "with the mesh itself"
        )


def compared(problem: Problem, frame: Frame, beside: Problem, last: Frame) -> dict[str, float]:
    """Discretisation error by name, of a frame of a problem, from that of its companion."""
    grains = Grain.of(problem, frame), Grain.of(beside, last)
    return mesh_error(main_numbers(problem, frame), main_numbers(beside, last), _ratio(problem, beside), grains)


def _ratio(problem: Problem, beside: Problem) -> float:
    """How many times longer the edges are, by the unknowns: those at the base are bounded by the finger."""
    return float((problem.stiffness.upper.shape[0] / beside.stiffness.upper.shape[0]) ** (1.0 / problem.dim))


def strain_error(problem: Problem, frame: Frame, beside: Problem, fine: Float, coarse: Float) -> Float:
    """Discretisation error (m,) of a gauge's strain (m,) at several coefficients of friction, from its companion's;
    the grain is that of a last `frame` at any of them.
    """
    share = Grain.of(problem, frame).share
    found = np.abs(fine - coarse) / (_ratio(problem, beside) ** ORDER - 1.0)
    return np.maximum(found, _FLOOR * share * np.abs(fine).max(initial=0.0))


def relative(numbers: Mapping[str, float], errors: Mapping[str, float]) -> dict[str, float]:
    """Errors as shares: of a force, of itself; of a length, of the contact's; of a strain, of the largest read."""
    strain = max((abs(v) for k, v in numbers.items() if k.startswith("gauge_")), default=0.0)
    found = {}
    for name, error in errors.items():
        if name in _LENGTHS:
            scale = numbers["contact_half_length_mm"]
        else:
            scale = strain if name.startswith("gauge_") else abs(numbers[name])
        found[name] = error / scale if scale > 0.0 else (math.inf if error > 0.0 else 0.0)
    return found


def worst(numbers: Mapping[str, float], errors: Mapping[str, float]) -> tuple[str, float]:
    """The number with the largest relative error, and that error."""
    shares = relative(numbers, errors)
    name = max(shares, key=lambda k: shares[k])
    return name, shares[name]


def step_error(problem: Problem, numbers: Mapping[str, float], times: float = 4.0) -> dict[str, float]:
    """Error by increments, by name: what `times` as many change, on the same condensation.

    Four times as many bound the error in 97 % of the cases of ``validation/error_bars.py``, twice in 94 %, half in
    85 %: few increments and half of them often agree by chance.
    """
    counts = _counts(problem.model.legs)
    others = [max(1, round(times * n)) for n in counts]
    if others == counts:
        raise Finger3dError("a single increment cannot be halved")
    legs = tuple(replace(leg, steps=n) for leg, n in zip(problem.model.legs, others, strict=True))
    trial = replace(problem, model=replace(problem.model, legs=legs))
    other = main_numbers(trial, last_frame(trial))
    ratio = sum(counts) / sum(others)
    gain = abs(ratio**STEP_ORDER - 1.0)
    found = {name: abs(value - other[name]) / gain for name, value in numbers.items()}
    return {k: float(v) for k, v in found.items() if math.isfinite(v)}


def estimate(problem: Problem, frames: Sequence[Frame], spent: Mapping[str, float]) -> ErrorEstimate:
    """Estimate the errors of the last frame by a coarser mesh and by more increments.

    Parameters
    ----------
    problem, frames : the press as it was solved, all increments good
    spent : seconds by stage, which say how many more increments are affordable, and on which mesh

    Returns
    -------
    ErrorEstimate
        Without numbers, and with the reason, where there is no companion; nothing of it can fail a press.
    """
    start = time.perf_counter()
    try:
        mesh, steps, method = _estimated(problem, frames, spent)
    except (Finger3dError, RuntimeError, ValueError, np.linalg.LinAlgError, MemoryError) as error:
        mesh, steps, method = {}, {}, f"no estimate: {error}"
    return ErrorEstimate(mesh, steps, method, time.perf_counter() - start)


def _estimated(
    problem: Problem, frames: Sequence[Frame], spent: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float], str]:
    if not frames or not frames[-1].outcome.ok:
        raise Finger3dError("the last step did not converge")
    # increments chosen by halving are numbers by now
    model = replace(problem.model, legs=_as_solved(problem.model.legs, len(frames)))
    fine = replace(problem, model=model)
    beside = companion(fine)
    begin = time.perf_counter()
    last = last_frame(beside)
    coarse_s = time.perf_counter() - begin
    mesh = compared(fine, frames[-1], beside, last)
    here, times = _finer_steps(spent["contact"], coarse_s, max(_STEPS_SHARE * sum(spent.values()), _STEPS_S))
    where = (fine, frames[-1]) if here else (beside, last)
    steps = step_error(where[0], main_numbers(*where), times)
    options = beside.model.mesh
    count = {4.0: "four times", 2.0: "twice", 0.5: "half"}[times]
    place = "" if here else " on the coarse mesh"
    method = (
        f"mesh: {beside.stiffness.upper.shape[0]} dofs ({options.mesher if problem.dim == 3 else 'structured'}, "
        f"{options.size_mm:.4g} and {options.base_size_mm:.4g} mm) beside, order {ORDER}; "
        f"steps: {count} as many{place}, order {STEP_ORDER:g}"
    )
    return mesh, steps, method


def _finer_steps(fine_s: float, coarse_s: float, budget: float) -> tuple[bool, float]:
    """Whether the increments are judged on the mesh at hand or beside it, and how many times as many are afforded."""
    choices = [(True, 4.0), (False, 4.0), (True, 2.0), (False, 2.0)]
    cost = {True: fine_s, False: coarse_s}
    return next(((here, times) for here, times in choices if times * cost[here] <= budget), (False, 0.5))


def last_frame(problem: Problem) -> Frame:
    """March to the end.

    Raises
    ------
    Finger3dError
        Where an increment does not converge.
    """
    frame = None
    for frame in march(problem):
        if not frame.outcome.ok:
            raise Finger3dError(f"a run with {problem.model.mesh.size_mm:.4g} mm did not converge ({frame.outcome})")
    if frame is None:
        raise Finger3dError("there are no increments to march")
    return frame


def _counts(legs: Sequence[Leg]) -> list[int]:
    return [leg.steps if isinstance(leg.steps, int) else AUTO_START for leg in legs]


def _as_solved(legs: tuple[Leg, ...], count: int) -> tuple[Leg, ...]:
    """The legs with their automatic increments as many as `count` frames in all tell."""
    free = [leg for leg in legs if leg.steps == "auto"]
    fixed = sum(leg.steps for leg in legs if isinstance(leg.steps, int))
    each = (count - fixed) // max(1, len(free))
    return tuple(replace(leg, steps=each) if leg.steps == "auto" else leg for leg in legs)
