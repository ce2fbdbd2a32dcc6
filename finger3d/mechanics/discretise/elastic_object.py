"""Elastic object: its compliance is added to that of the finger at the contact points.

The object is meshed and condensed like the finger, in small strain, and held where it is gripped: the lower half of a
cylinder or ball on its cut; behind a plane, wedge or wave a block as long and wide as the finger, on its far face; a
body from a file on its highest plane.  Its surface is read at the finger's own contact points, as the same weighted
means (`finger3d.fem.surface`), so the two meshes need not match and contact forces are equal and opposite.
"""

from __future__ import annotations

import math
import time
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.assembly import Stiffness, stiffness
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import Mesh, axis_numbers, reflected
from finger3d.fem.solvers.condense import condense
from finger3d.fem.surface import facing_trace
from finger3d.geometry.design import Design, designs
from finger3d.mechanics.discretise.body_mesh import stretched_object, with_points_of
from finger3d.mechanics.discretise.problem import MeshedObject, Problem
from finger3d.mechanics.discretise.symmetry import held_dofs
from finger3d.mechanics.model import ElasticObject, MeshOptions, Model
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.sizing import Mesher, Zone
from finger3d.meshing.swept import mesh_section
from finger3d.objects import HeldBody, PlacedObject, vertical_frame
from finger3d.progress import QUIET, Progress

_SURFACE = 401  # places along x and z where the highest point of a wedge or wave is looked for
_SWAPPED = {
    "x": "z",
    "z": "x",
    "symmetry_x": "symmetry_z",
    "symmetry_z": "symmetry_x",
    "ends": "walls",
    "walls": "ends",
}
"""Axes and labels of faces where x and z change places."""


@dataclass(frozen=True)
class ObjectResponse:
    """Elastic response of the object at the contact points.

    Attributes
    ----------
    compliance : (c, d, c, d) array, mm/N
        Zero in the directions that symmetry holds.
    mesh : of the object, if this is the response of its own mesh
    factorizations : of the object
    seconds : time of each stage by name
    """

    compliance: Float
    mesh: MeshedObject | None
    factorizations: int
    seconds: dict[str, float]

    def __post_init__(self) -> None:
        freeze_arrays(self)


def object_response(
    problem: Problem, thing: ElasticObject, zone: Zone, report: Progress, like: Problem | None = None
) -> ObjectResponse:
    """Mesh and condense an elastic object; return its compliance at the contact points of the finger.

    Parameters
    ----------
    zone : (x_min, x_max, z_min, z_max), mm
        Where the object touches the finger; its mesh is fine there.
    report : receives the messages
    like : problem whose object has the same cells, if there is one
    """
    start = time.perf_counter()
    own = like.system.object_mesh if like else None
    body = _moved(like, own, problem, thing) if like and own else object_mesh(problem, thing, zone, report)
    mesh, whole = body.mesh, body.is_whole
    meshing = time.perf_counter() - start
    report.say(f"condensing the object's {mesh.points.size} unknowns")
    held = held_dofs(mesh, () if whole else problem.axes, problem.model.held_ends)
    matrix, rows = assembled_object(problem, thing, mesh, whole)
    condensed = condense(matrix, held, rows)
    active, (c, d) = problem.system.active_dofs, problem.surface.points.shape
    out = np.zeros((c * d, c * d))
    out[np.ix_(active, active)] = condensed.compliance
    seconds = {"object_mesh": meshing, "object_condensation": condensed.seconds}
    return ObjectResponse(out.reshape(c, d, c, d), body, condensed.factorizations, seconds)


def object_mesh(problem: Problem, thing: ElasticObject, zone: Zone, report: Progress) -> MeshedObject:
    """Return the mesh of an elastic object."""
    model = problem.model
    return ObjectBody(model, thing.height_mm or model.design.height_mm, zone, problem.axes, report).mesh()


def _moved(like: Problem, body: MeshedObject, problem: Problem, thing: ElasticObject) -> MeshedObject:
    """Return the elastic object of a problem, `like`, with the dimensions of both bodies of another one."""
    own, model = like.model, problem.model
    height = own.object_compliance.height_mm if own.object_compliance else None
    if (model.design, model.object, thing.height_mm) == (own.design, own.object, height):
        return body
    held = own.object.held_body(own.design, body.mesh.dim == 3)
    if held is None or held.mesher == "swept" or body.mesh.dim == 2:
        with suppress(Finger3dError):  # where a structured mesh of the other dimensions has other cells
            other = object_mesh(problem, thing, own.first_contact.contact_box, QUIET).mesh
            return replace(body, mesh=with_points_of(body.mesh, other))
    return replace(body, mesh=stretched_object(body.mesh, own, model))


def assembled_object(
    problem: Problem, thing: ElasticObject, mesh: Mesh, whole: bool
) -> tuple[Stiffness, sp.csr_matrix]:
    """Return the stiffness of an elastic object, and the rows (r, n d) of the contact directions that move."""
    model, axes, frame = problem.model, problem.axes, vertical_frame(problem.dim)
    if whole and axes:  # the body is meshed whole: all images of a point are pressed alike
        rows = _all_images(problem, mesh, frame) / math.sqrt(2 ** len(axes))
    else:
        rows = sp.kron(facing_trace(problem.surface, mesh, "contact"), frame, format="csr")
    law = Isotropic(thing.E_MPa, thing.nu).elasticity(model.domain == "plane-stress")
    matrix = stiffness(mesh, law, problem.body.thickness)
    return matrix, rows[problem.system.active_dofs]


def _all_images(problem: Problem, mesh: Mesh, frame: Float) -> sp.csr_matrix:
    """Return rows that sum the displacements of every contact point and its mirror images, each in its own frame."""
    d = problem.dim
    signs = [np.ones(d)]
    for axis in axis_numbers(problem.axes):
        flip = np.where(np.arange(d) == axis, -1.0, 1.0)
        signs += [s * flip for s in signs]
    faces = [replace(problem.surface, samples=problem.surface.samples * sign) for sign in signs]
    return sp.csr_matrix(
        sum(
            sp.kron(facing_trace(face, mesh, "contact"), frame * sign, format="csr")
            for face, sign in zip(faces, signs, strict=True)
        )
    )


@dataclass(frozen=True)
class ObjectBody:
    """Mesh of the object with the edge lengths of the finger; its contact face points down."""

    model: Model
    height_mm: float
    zone: Zone
    axes: tuple[str, ...]
    report: Progress

    def mesh(self) -> MeshedObject:
        """Return the mesh."""
        held = self.model.object.held_body(self.model.design, self.model.domain == "solid")
        return MeshedObject(self._block(), False) if held is None else MeshedObject(self._held(held), held.is_whole)

    def _made(self, design: Design, zone: Zone, mesher: Mesher = "swept", axes: tuple[str, ...] | None = None) -> Mesh:
        """Return the mesh of a design with the edge lengths of the finger; its contact face is on top."""
        extents = [design.height_mm, design.half_length_mm]
        solid = self.model.domain == "solid"
        size = min([self.model.mesh.size_mm, *(0.5 * e for e in extents), *([0.5 * design.width_mm] if solid else [])])
        options = MeshOptions(size, max(size, min(self.model.mesh.base_size_mm, *extents)), mesher)
        axes = self.axes if axes is None else axes
        self.report.say("meshing the object")
        if solid:
            return mesh_solid(design, options, zone, axes, self.report)[0]
        return mesh_section(design, options, zone, axes)[0]

    def _held(self, held: HeldBody) -> Mesh:
        """Return the mesh of a design, turned and moved to where the object is."""
        x0, x1, z0, z1 = self.zone
        corners = held.to_design(np.array([[x0, 0.0, z0], [x1, 0.0, z1]]))
        (low_x, _, low_z), (high_x, _, high_z) = corners.min(axis=0), corners.max(axis=0)
        axes = () if held.is_whole else self.axes
        swap = _SWAPPED if held.is_crosswise else {}
        axes = tuple(swap.get(axis, axis) for axis in axes)
        mesh = self._made(held.design, (low_x, high_x, low_z, high_z), held.mesher, axes)
        cells = reflected(mesh, 1) if held.is_reflected else mesh
        facets = {swap.get(label, label): f for label, f in cells.facets.items()}
        return Mesh(held.to_scene(mesh.points), cells.cells, facets)

    def _block(self) -> Mesh:
        """Return a block behind the surface with the length and width of the finger and a flat far face."""
        finger, obj = self.model.design, self.model.object
        tilt = math.atan(float(obj.profile(np.ones(1), np.zeros(1))[0])) if obj.is_flat else 0.0
        reach = finger.half_length_mm / np.cos(tilt)
        if obj.is_flat:
            low = high = 0.0
        else:
            half = 0.5 * finger.width_mm * (self.model.domain == "solid")
            x, z = np.meshgrid(np.linspace(-reach, reach, _SURFACE), np.linspace(-half, half, 41))
            rises = PlacedObject.of(obj, 0.0).height(x.ravel(), z.ravel())
            low, high = float(rises.min()), float(rises.max())
        height = self.height_mm + high - low
        design = designs()["block"](half_length_mm=reach, height_mm=height, width_mm=finger.width_mm)
        stretch = np.array([1.0, 1.0, 1.0, 1.0]) / [np.cos(tilt), np.cos(tilt), 1.0, 1.0]
        x0, x1, z0, z1 = np.array(self.zone) * stretch
        mesh = reflected(self._made(design, (x0, x1, z0, z1)), 1)
        points, x, y = mesh.points.copy(), mesh.points[:, 0], mesh.points[:, 1] + height
        if obj.is_flat:
            c, s = np.cos(tilt), np.sin(tilt)
            points[:, 0], points[:, 1] = c * x - s * y, s * x + c * y
        else:
            behind, z = y / height, points[:, 2] if mesh.dim == 3 else 0.0 * x  # 0 on the surface, 1 on the far face
            surface = PlacedObject.of(obj, 0.0).height(x, z)
            points[:, 1] = surface * (1.0 - behind) + (high + self.height_mm) * behind
        return Mesh(points, mesh.cells, mesh.facets)
