"""One press in one way, timed by stage: element, mesh, increments, solver; and the paper's way, as a reference solver.

Linear elements, and quadratic ones where the product takes mixed ones, are no options of the product: they go through
its own steps here, one by one, on another mesh or with another form.
"""

from __future__ import annotations

import math
import resource
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.assembly import stiffness
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import Mesh
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface import local_rows
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import candidate_points, contact_rows, mesh_part
from finger3d.mechanics.discretise.contact_points import MARGIN, ContactPoints
from finger3d.mechanics.discretise.problem import CondensedBody, ContactSystem, Problem, free_surface
from finger3d.mechanics.discretise.symmetry import active_dofs, held_dofs, symmetry, unfold_points
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.objects import vertical_frame

from ._increments import PlainCoulomb
from ._press import changed, converged, fig9_finger, in_increments

MU = 0.25
QUANTITIES = ("force", "contact_length", "stick_length", "friction_sum", "gauge_strain")
SECTION, SOLID, HALF = "section", "solid", "half cylinder"
LARGE = {body: f"{body}, large deformation" for body in (SECTION, SOLID)}


@dataclass(frozen=True)
class Case:
    """A press, and how it is computed.

    Attributes
    ----------
    body : SECTION and SOLID are the Fig. 9 finger at nu = .49 in plane strain and 20 mm wide, pressed 10 mm, and LARGE
        the same at large deformation; HALF is the paper's half cylinder of 5 mm in plane stress, nu = .3, pressed 1 mm
    size, base : edge lengths (mm) at the contact and far from it
    element : mixed, quadratic or linear
    counts : increments; the one condensed body is pressed once for each
    nu : another Poisson's ratio
    way : condensed; or "each iteration": one factorisation of the whole body in every iteration, as in the paper;
        or "plain increments": condensed, in the increments of that way
    """

    body: str
    size: float
    base: float
    element: str = "mixed"
    mesher: str = "swept"
    counts: tuple[int, ...] = (10,)
    solver: str = "pardiso"
    way: str = "condensed"
    nu: float | None = None

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Case:
        """From a dict with lists for tuples, as JSON has it."""
        return cls(**{**given, "counts": tuple(given["counts"])})


def processor_s() -> float:
    """Processor time of this process and of those it waited for, s: other work on the machine changes it least."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def model_of(case: Case) -> Model:
    """The model of a case with ten increments, and one gauge at a point."""
    mesher: Any = case.mesher
    mesh = MeshOptions(case.size, case.base, mesher)
    usual = 0.3 if case.body == HALF else 0.49
    nu = usual if case.nu is None else case.nu
    law = Coulomb(MU) if case.way == "condensed" else PlainCoulomb(MU)
    given: dict[str, Any] = {"material": Isotropic(1.0, nu), "mesh": mesh, "friction": law}
    if case.body == HALF:
        design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
        gauge = Gauge("g", 1.5, 4.2, angle=math.pi / 4)
        return Model(design, legs=(Leg(1.0),), gauges=(gauge,), domain="plane-stress", **given)
    # at large deformation the strain of the section along 30 degrees is near zero there, a twentieth of that along 60
    gauge = Gauge("g", 36.0, 40.0, angle=math.pi / 3 if case.body == LARGE[SECTION] else math.pi / 6)
    domain: Any = "solid" if case.body in (SOLID, LARGE[SOLID]) else "plane-strain"
    model = Model(fig9_finger(), legs=(Leg(10.0),), gauges=(gauge,), domain=domain, **given)
    return LargeDeformation().apply(model) if case.body in LARGE.values() else model


def straight(mesh: Mesh) -> Mesh:
    """The linear mesh of a quadratic one's vertices."""
    number = np.full(len(mesh.points), -1)
    number[mesh.vertices] = np.arange(len(mesh.vertices))
    d = mesh.dim
    return Mesh(
        mesh.points[mesh.vertices],
        number[mesh.cells[:, : d + 1]],
        {k: number[f[:, :d]] for k, f in mesh.facets.items()},
    )


def assembled(case: Case) -> tuple[Problem, dict[str, float]]:
    """The problem of a case, meshed and assembled with its elements but not condensed; and processor time (s)."""
    model = model_of(case)
    way, axes = model.first_contact, symmetry(model)
    begin = processor_s()
    mesh, report = mesh_part(model, way.contact_box, axes)
    start, meshed = time.perf_counter(), processor_s()
    if case.element == "linear":
        mesh = straight(mesh)
    constants = model.material.elasticity(model.domain == "plane-stress")
    elastic = replace(constants, mixed=case.element == "mixed")
    thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
    matrix = stiffness(mesh, elastic, thickness)
    face = candidate_points(model, free_surface(model, mesh, thickness), way.first_contact_mm, MARGIN)
    mirrored, points = unfold_points(model, mesh, face, axes, elastic)
    held, nothing = held_dofs(mesh, axes, model.held_ends), np.zeros((0, 0))
    body = CondensedBody(
        mesh=mesh, report=report, elastic=elastic, stiffness=matrix, thickness=thickness, fixed_dofs=held,
        condensed=None,  # type: ignore[arg-type]
    )  # fmt: skip
    system = ContactSystem(
        surface=face, points=points, delassus=nothing, reading_rows=nothing, active_dofs=active_dofs(face, axes),
        first_contact_mm=way.first_contact_mm,
    )  # fmt: skip
    seconds = {**report.seconds, "assembly": time.perf_counter() - start}
    processor = {"mesh": meshed - begin, "assembly": processor_s() - meshed}
    problem = Problem(model=model, condensed_body=body, symmetry=mirrored, system=system, seconds=seconds)
    return problem, processor


def rows_of(problem: Problem) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Rows of the contact points that may move, and of the gauges."""
    contact = local_rows(problem.surface, vertical_frame(problem.dim))[problem.system.active_dofs]
    gauges = [gauge.row(problem.mesh, problem.axes) for gauge in problem.model.gauges]
    return contact, sp.vstack(gauges, format="csr")


def condensed(problem: Problem, solver: str | None = None) -> Problem:
    """The problem, condensed as `build` does it."""
    body, system, rows = problem.body, problem.system, sp.vstack(rows_of(problem), format="csr")
    small = condense(body.stiffness, body.fixed_dofs, rows, solver)
    count = len(problem.model.gauges)
    delassus, reading_rows = contact_rows(small.compliance, system.active_dofs, system.surface, count)
    return replace(
        problem, condensed_body=replace(body, condensed=small),
        system=replace(system, delassus=delassus, reading_rows=reading_rows),
    )  # fmt: skip


def free_part(problem: Problem) -> sp.csr_matrix:
    """Upper triangle of the stiffness of the unknowns that are not held."""
    upper = problem.body.stiffness.upper
    free = np.setdiff1d(np.arange(upper.shape[0]), problem.body.fixed_dofs)
    return upper[free][:, free].tocsr()


def factored(upper: sp.csr_matrix) -> tuple[float, float]:
    """Wall and processor time (s) of one plain factorisation (PARDISO, symmetric indefinite), analysis included."""
    from pypardiso import PyPardisoSolver

    solver = PyPardisoSolver(mtype=-2)
    for number, value in ((1, 1), (2, 3), (10, 13), (21, 1)):  # as in finger3d.fem.solvers.pardiso
        solver.set_iparm(number, value)
    solver.set_phase(12)
    upper.sort_indices()
    begin, spent = time.perf_counter(), processor_s()
    solver._call_pardiso(upper, np.zeros((upper.shape[0], 1)))
    seconds = time.perf_counter() - begin, processor_s() - spent
    solver.free_memory(everything=True)
    return seconds


def in_steps(problem: Problem, count: int, workspace: Workspace | None = None) -> list[StepResult]:
    """Frames of a press in so many increments."""
    return converged(changed(problem, legs=in_increments(problem.model.legs, count)), workspace)


def numbers(points: ContactPoints, frame: StepResult) -> dict[str, float]:
    """The quantities as a press reports them."""
    values = measure(points, frame)
    return {
        "force": values["normal_force_N"],
        "contact_length": values["contact_half_length_mm"],
        "stick_length": values["stick_half_length_mm"],
        "friction_sum": values["friction_sum_N"],
        "gauge_strain": values["gauges"]["g"],
        "outward_x": values["outward_friction_x_N"],
        "outward_z": values["outward_friction_z_N"],
    }
