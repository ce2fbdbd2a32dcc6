"""One scene as different models: pressed on a mesh and on a coarser companion, and measured per width."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d.errors import Outcome
from finger3d.history import ContactPoints, Frame, contact_table, measure
from finger3d.increments import automatic, refine
from finger3d.model import Model
from finger3d.solve import Problem, build, march

Float = NDArray[np.float64]

COARSER = 1.5
"""Edge lengths of the companion mesh of a model, in those of the mesh itself."""

_FINER = 3.0
"""How much finer a section is also solved: it costs little, and two meshes seldom agree there by chance."""

_SAFETY = 3.0
"""On the error that a mesh and a coarser one tell (Roache 1998, grid convergence index); 1.25 with a much finer one."""

_SCATTER = 2.0
"""The same for what jumps from mesh to mesh rather than follow a rate: strains at a point, peaks."""

_POINTS = 600
"""Contact points of the meshed part up to which a solid of another width is quick (a few seconds)."""

LINES = ("z = 0", "end")


@dataclass(frozen=True)
class Case:
    """What one model of the scene says at the end of its path.

    Attributes
    ----------
    model : plane stress, plane strain, solid, or solid with held ends
    size_mm : edge length at the contact
    numbers : quantity -> value, forces per width; see `measured`
    errors : quantity -> error bar, from the companion mesh; empty without one
    lines : line along x ("z = 0", "end") -> columns x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa, status
    outcome : of the path; anything but CONVERGED leaves `numbers` empty
    companion : the numbers on the companion mesh, 1.5 times coarser
    """

    model: str
    width_mm: float
    size_mm: float
    mesher: str
    outcome: Outcome
    numbers: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    lines: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    seconds: float = 0.0
    companion: Mapping[str, float] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether there are numbers to compare."""
        return self.outcome.ok

    @property
    def force_error(self) -> float:
        """Relative error of the force; 0 where it is not known."""
        return self.errors.get("force_N_per_mm", 0.0) / abs(self.numbers.get("force_N_per_mm", 1.0) or 1.0)

    @property
    def is_section(self) -> bool:
        """Whether it is one of the two plane models."""
        return self.model.startswith("plane")

    def as_dict(self) -> dict[str, Any]:
        """For compare.json."""
        return {
            "model": self.model, "width_mm": self.width_mm, "size_mm": self.size_mm, "mesher": self.mesher,
            "outcome": str(self.outcome), "numbers": dict(self.numbers), "errors": dict(self.errors),
            "lines": {k: dict(v) for k, v in self.lines.items()}, "seconds": self.seconds,
        }  # fmt: skip


def corner_order(nu: float, plane_stress: bool = False) -> float:
    """Order 2 lambda in which forces converge, from r^lambda at the ends of the held base (Williams 1952).

    Where a held face meets a free one at a right angle, in plane strain and along an edge of a solid,
    ``sin^2(lambda pi/2) = (4 (1 - nu)^2 - lambda^2)/(3 - 4 nu)``: the order is 1.19 at nu = 0.5, 1.42 at 0.3, and 2 (no
    singularity) at 0.  The edge of a contact that slips is milder: 3.
    """
    from scipy.optimize import brentq

    poisson = nu / (1.0 + nu) if plane_stress else nu

    def left_over(power: float) -> float:
        return float(math.sin(power * math.pi / 2) ** 2 - (4 * (1 - poisson) ** 2 - power**2) / (3 - 4 * poisson))

    grid = np.linspace(0.5, 1.0, 201)
    values = [left_over(p) for p in grid]
    for a, b, fa, fb in zip(grid[:-1], grid[1:], values[:-1], values[1:], strict=True):
        if fa < 0.0 < fb:
            return 2.0 * float(brentq(left_over, a, b))
    return 2.0


def resized(model: Model, size_mm: float) -> Model:
    """The model on another mesh, all edge lengths scaled alike."""
    base = model.mesh.base_size_mm * size_mm / model.mesh.size_mm
    return replace(model, mesh=replace(model.mesh, size_mm=size_mm, base_size_mm=base))


def widened(model: Model, width_mm: float) -> Model:
    """A solid of another width: structured, no finer than the scene's, and coarse enough to be quick."""
    design = replace(model.design, width_mm=width_mm)
    free = 4 // 2 ** len(set(model.object.mirrors()) & {"x", "z"})
    size = min(model.mesh.size_mm, width_mm / COARSER)
    largest = min(min(design.height_mm, design.half_length_mm) / 4.0, width_mm) / COARSER

    def points(size_mm: float) -> float:
        layers = max(2, math.ceil(width_mm / (4.0 * size_mm)))
        return free * (design.half_length_mm / size_mm + 1) * (layers + 1)

    while points(size) > _POINTS and 1.2 * size <= largest:
        size *= 1.2
    return resized(replace(model, design=design, mesh=replace(model.mesh, mesher="swept")), size)


def solved(name: str, model: Model, least: float = 0.0) -> Case:
    """Press the model on its mesh and on others, which tell the error bars.

    A section is judged by a finer mesh, a solid by a coarser one.  `least` is a relative error that no number is said
    to beat: for a solid that of the sections on the same in-plane mesh.
    """
    start = time.perf_counter()
    size = model.mesh.size_mm
    coarse, fine = measured_on(name, resized(model, COARSER * size)), measured_on(name, model)
    order = corner_order(model.material.nu, model.domain == "plane-stress")
    other, factor = coarse, _SAFETY / (COARSER**order - 1.0)
    if model.domain != "solid":
        other, factor = measured_on(name, resized(model, size / _FINER)), 1.25 / (1.0 - _FINER**-order)
    seconds = time.perf_counter() - start
    if not (fine.ok and other.ok and coarse.ok):
        return replace(fine, seconds=seconds)
    changed = {key: abs(value - other.numbers[key]) for key, value in fine.numbers.items()}
    least = max(least, factor * changed["force_N_per_mm"] / abs(fine.numbers["force_N_per_mm"]))
    errors = {}
    for key, value in fine.numbers.items():
        # nothing is better known than the force, though two meshes may agree in it by chance
        errors[key] = max((factor if key.endswith("_N_per_mm") else _SCATTER) * changed[key], least * abs(value))
        if key.endswith(("_length_mm", "_length_end_mm")):
            # known to a point at either end
            errors[key] = max(changed[key], 2.0 * size)
    return replace(fine, errors=errors, seconds=seconds, companion=coarse.numbers)


def measured_on(name: str, model: Model) -> Case:
    """The model pressed on its own mesh only: numbers without error bars."""
    # all of the contact face: how far contact reaches differs from model to model
    problem = build(model, margin=math.inf)
    frame = _last(problem)
    width = model.design.width_mm
    mesher = "swept" if problem.dim == 2 else model.mesh.mesher
    empty = Case(name, width, model.mesh.size_mm, mesher, frame.outcome)
    if not frame.outcome.ok:
        return empty
    return replace(empty, numbers=measured(problem.points, frame), lines=lines_along_x(problem.points, frame))


def _last(problem: Problem) -> Frame:
    frames: tuple[Frame, ...] = ()
    if automatic(problem):
        for finer, _ in refine(problem):
            frames = finer
    else:
        frames = tuple(march(problem))
    return frames[-1]


def measured(points: ContactPoints, frame: Frame) -> dict[str, float]:
    """Numbers of a frame that a section and a solid share: N per mm of width, mm, MPa, strains."""
    numbers = measure(points, frame)
    width = 2.0 * points.half_width_mm
    friction = np.abs(points.friction(frame.state.force)).sum(axis=0)
    out = {
        "force_N_per_mm": numbers["normal_force_N"] / width,
        "friction_sum_N_per_mm": numbers["friction_sum_N"] / width,
        "friction_along_x_N_per_mm": float(friction[0]) / width,
        "friction_along_z_N_per_mm": float(friction[2]) / width,
        "outward_friction_x_N_per_mm": numbers["outward_friction_x_N"] / width,
        "contact_length_mm": 2.0 * numbers["contact_half_length_mm"],
        "stick_length_mm": 2.0 * numbers["stick_half_length_mm"],
    }
    if "contact_half_length_end_mm" in numbers:
        out["contact_length_end_mm"] = 2.0 * numbers["contact_half_length_end_mm"]
    middle = lines_along_x(points, frame)["z = 0"]
    out["peak_pressure_MPa"] = float(np.max(middle["pressure_MPa"], initial=0.0))
    return out | {f"gauge_{name}": float(strain) for name, strain in numbers["gauges"].items()}


def lines_along_x(points: ContactPoints, frame: Frame) -> dict[str, dict[str, Any]]:
    """Tractions along x at z = 0, and for a solid at its end; points in the band stand in where none is on the line."""
    table = contact_table(points, frame.state)
    z = table["z_mm"]
    exact = 1e-6 * points.half_width_mm
    middle = np.flatnonzero(np.abs(z) <= exact)
    if len(middle) < 5:
        middle = np.flatnonzero(np.abs(z) <= points.band_mm)
    chosen = {"z = 0": middle}
    if points.dim == 3:
        chosen["end"] = np.flatnonzero(np.abs(z - points.half_width_mm) <= exact)
    keys = ("x_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa", "status")
    out = {}
    for name, on in chosen.items():
        on = on[np.argsort(table["x_mm"][on], kind="stable")]
        out[name] = {k: np.asarray(table[k])[on].tolist() for k in keys}
    return out
