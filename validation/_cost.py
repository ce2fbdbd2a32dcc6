"""One press in one way, timed by stage: element, mesh, increments, solver; and the paper's way, as a reference solver.

Linear elements, and quadratic ones where the product takes mixed ones, are no options of the product: they go through
its own steps here, one by one, on another mesh or with another form.
"""

from __future__ import annotations

import math
import resource
import time
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh.simplex import Mesh
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface.traces import BoundarySurface, local_rows
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import candidate_points, contact_rows
from finger3d.mechanics.discretise.contact_geometry import MARGIN
from finger3d.mechanics.discretise.contact_points import ContactPoints
from finger3d.mechanics.discretise.problem import CondensedBody, ContactSystem, Problem, free_surface
from finger3d.mechanics.discretise.symmetry import active_dofs, held_dofs, symmetry, unfold_points
from finger3d.mechanics.formulation import Workspace
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import StepResult, measure
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.report import MeshReport
from finger3d.meshing.structured.swept import mesh_section
from finger3d.objects import vertical_frame

from ._increments import PlainCoulomb
from ._press import changed, converged, fig9_finger

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
    if case.body == HALF:
        design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
        gauge = Gauge("g", 1.5, 4.2, angle=math.pi / 4)
        return Model(
            design, Isotropic(1.0, nu), mesh, (Leg(1.0),), friction=law, gauges=(gauge,), domain="plane-stress"
        )
    # at large deformation the strain of the section along 30 degrees is near zero there, a twentieth of that along 60
    gauge = Gauge("g", 36.0, 40.0, angle=math.pi / 3 if case.body == LARGE[SECTION] else math.pi / 6)
    domain: Any = "solid" if case.body in (SOLID, LARGE[SOLID]) else "plane-strain"
    model = Model(fig9_finger(), Isotropic(1.0, nu), mesh, (Leg(10.0),), friction=law, gauges=(gauge,), domain=domain)
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


@dataclass(frozen=True)
class Parts:
    """An assembled body, not yet condensed: what `build` has in hand before it condenses."""

    model: Model
    mesh: Mesh
    report: MeshReport
    elastic: Elasticity
    stiffness: Stiffness
    surface: BoundarySurface
    active_dofs: NDArray[np.int64]
    rows: sp.csr_matrix
    gauges: sp.csr_matrix
    fixed_dofs: NDArray[np.int64]
    first_contact_mm: float
    axes: tuple[str, ...]
    seconds: dict[str, float] = field(default_factory=dict)
    processor_seconds: dict[str, float] = field(default_factory=dict)

    @property
    def thickness(self) -> float:
        """Of a section, mm; 1 for a solid."""
        return 1.0 if self.mesh.dim == 3 else self.model.design.width_mm


def assembled(model: Model, element: str) -> Parts:
    """Mesh and assemble a model with elements of a kind."""
    way, axes = model.first_contact, symmetry(model)
    make = mesh_solid if model.domain == "solid" else mesh_section
    begin = processor_s()
    mesh, report = make(model.design, model.mesh, way.contact_box, axes)
    start, meshed = time.perf_counter(), processor_s()
    if element == "linear":
        mesh = straight(mesh)
    constants = model.material.elasticity(model.domain == "plane-stress")
    elastic = replace(constants, mixed=element == "mixed")
    thickness = 1.0 if mesh.dim == 3 else model.design.width_mm
    matrix = stiffness(mesh, elastic, thickness)
    face = candidate_points(model, free_surface(model, mesh, thickness), way.first_contact_mm, MARGIN)
    kept = active_dofs(face, axes)
    rows = local_rows(face, vertical_frame(mesh.dim))[kept]
    gauges = sp.vstack([g.row(mesh, axes) for g in model.gauges], format="csr")
    seconds = {**report.seconds, "assembly": time.perf_counter() - start}
    processor = {"mesh": meshed - begin, "assembly": processor_s() - meshed}
    held = held_dofs(mesh, axes, model.held_ends)
    return Parts(
        model, mesh, report, elastic, matrix, face, kept, rows, gauges, held, way.first_contact_mm, axes, seconds,
        processor,
    )  # fmt: skip


def condensed(parts: Parts, solver: str | None = None) -> Problem:
    """The problem, as `build` makes it."""
    small = condense(parts.stiffness, parts.fixed_dofs, sp.vstack([parts.rows, parts.gauges], format="csr"), solver)
    delassus, reading_rows = contact_rows(small.compliance, parts.active_dofs, parts.surface, len(parts.model.gauges))
    mirrored, points = unfold_points(parts.model, parts.mesh, parts.surface, parts.axes, parts.elastic)
    return Problem(
        model=parts.model,
        condensed_body=CondensedBody(
            mesh=parts.mesh,
            report=parts.report,
            elastic=parts.elastic,
            stiffness=parts.stiffness,
            thickness=parts.thickness,
            fixed_dofs=parts.fixed_dofs,
            condensed=small,
        ),
        symmetry=mirrored,
        system=ContactSystem(
            surface=parts.surface,
            points=points,
            delassus=delassus,
            reading_rows=reading_rows,
            active_dofs=parts.active_dofs,
            first_contact_mm=parts.first_contact_mm,
        ),
        seconds={**parts.seconds, "condensation": small.seconds},
    )


def in_steps(problem: Problem, count: int, workspace: Workspace | None = None) -> list[StepResult]:
    """Frames of a press in so many increments."""
    legs = tuple(replace(leg, steps=count) for leg in problem.model.legs)
    return converged(changed(problem, legs=legs), workspace)


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
