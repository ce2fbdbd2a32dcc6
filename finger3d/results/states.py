"""steps.npz: the displacement and the contact of chosen increments, for the 3D view, `finger3d show` and Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np
from numpy.typing import ArrayLike

from finger3d._extras import require
from finger3d._types import Array, freeze_arrays
from finger3d.contact.state import ContactState
from finger3d.contact.zones import Zone, edges_of, zones
from finger3d.errors import Finger3dError
from finger3d.fem.mesh import CONTACT, FREE_FACES, Mesh, middles
from finger3d.geometry.surface import Triangles
from finger3d.io import atomic, read_arrays, write_arrays
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, contact_table
from finger3d.objects import PlacedObject
from finger3d.results.summary import without_round_off

if TYPE_CHECKING:
    import pyvista


_MOST_TRIANGLES = 20_000
"""Triangles of the object that are kept for pictures, at most."""

MOST = 10
"""Largest number of stored increments; each costs a back substitution, and a displacement of every node on disk."""


@dataclass(frozen=True)
class States:
    """Chosen increments of a press on the whole finger; numbers in single precision, the exact ones are in the CSVs.

    Attributes
    ----------
    points : (n, d) mm at rest, in the order of fields.vtu
    cells, facets : (e, k), (t, j) as in `finger3d.fem.mesh.Mesh`; facets of all labels together
    part : (e,) number of the part that each cell belongs to, 0 for the main body
    facet_face : (t,) number in `finger3d.fem.mesh.FREE_FACES` of the face of each facet, -1 for any other
    nodes : (m,) numbers of the contact points among `points`, in the order of contact.csv
    face : (m,) number of the face that each contact point belongs to
    compliance : (m,) 1/MPa, as in `finger3d.mechanics.discretise.contact_points.ContactPoints`
    step : (s,) number of each increment, from 1
    target : (s, 6) depth_mm, slide_x_mm, slide_z_mm, turn_x_deg, turn_y_deg, turn_z_deg
    displacement : (s, n, d) mm
    pressure, shear_x, shear_y, shear_z : (s, m) MPa, traction on the finger
    gap : (s, m) mm
    status : (s, m) 0 open, 1 stick, 2 slip
    object_points, object_faces : (v, 3) mm, (f, 3) triangles of the object in its own coordinates; none if too many
    object_rotation, object_place : (s, 3, 3), (s, 3) mm, its pose at each increment
    """

    points: Array
    cells: Array
    part: Array
    facets: Array
    facet_face: Array
    nodes: Array
    face: Array
    compliance: Array
    step: Array
    target: Array
    displacement: Array
    pressure: Array
    shear_x: Array
    shear_y: Array
    shear_z: Array
    gap: Array
    status: Array
    object_points: Array
    object_faces: Array
    object_rotation: Array
    object_place: Array

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def dim(self) -> int:
        """2 for a section, 3 for a solid."""
        return int(self.points.shape[1])

    @property
    def half_width_mm(self) -> float:
        """Largest abs(z) of a solid, 0 of a section."""
        return float(np.abs(self.points[:, 2:]).max(initial=0.0))

    def index(self, step: int, folder: str | Path) -> int:
        """Return the place of a step, which is counted from 1, among those that are kept in a folder.

        Raises
        ------
        Finger3dError
            If it is not among them.
        """
        kept: list[int] = self.step.tolist()
        if step not in kept:
            raise Finger3dError(f"{folder}: increment {step} is not among the kept ones: {', '.join(map(str, kept))}")
        return kept.index(step)

    @property
    def corners(self) -> Array:
        """Corners (t, d) of the boundary's facets, oriented outward."""
        return self.facets[:, : self.dim]

    @property
    def on_contact(self) -> Array:
        """Whether each facet (t,) belongs to a face with contact points."""
        return np.isin(self.facet_face, np.append(np.unique(self.face), CONTACT))

    @cached_property
    def contact_facets(self) -> Array:
        """Numbers (k, d) of the contact points at the corners of the facets on faces with them; -1 where none is."""
        number = np.full((len(FREE_FACES), len(self.points)), -1)
        number[self.face, self.nodes] = np.arange(len(self.nodes))
        return np.asarray(number[self.facet_face[self.on_contact][:, None], self.corners[self.on_contact]])

    def zones(self, k: int) -> tuple[Zone, Zone]:
        """Return the zones of contact and of stick at the k-th kept increment."""
        shear = np.linalg.norm([self.shear_x[k], self.shear_y[k], self.shear_z[k]], axis=0)
        # tractions as forces on unit areas; the direction of friction does not count
        traction = np.zeros((len(self.nodes), self.dim))
        traction[:, 0], traction[:, 1] = self.pressure[k], shear
        rest = np.zeros((len(self.nodes), self.dim - 1))
        state = ContactState(self.status[k], traction, self.gap[k].astype(float), rest, rest)
        places = np.zeros((len(self.nodes), 3))  # z = 0 in a section
        places[:, : self.dim] = self.points[self.nodes]
        edges = edges_of(self.contact_facets[(self.contact_facets >= 0).all(axis=1)])
        return zones(state, places, np.ones(len(places)), self.compliance.astype(float), edges)

    def on_points(self, name: str, k: int, face: int | None = None) -> Array:
        """Return a contact field of the k-th kept increment at all points (n,), 0 where there are no contact points.

        Values are those of one face, or of all faces; at a crease, of the face with the larger pressure.
        """
        values, own = getattr(self, name)[k], np.argsort(self.pressure[k], kind="stable")
        out = np.zeros(len(self.points), dtype=values.dtype)
        own = own if face is None else own[self.face[own] == face]
        out[self.nodes[own]] = values[own]  # the last of equal indices counts
        ends, between = middles(self.facets[self.on_contact if face is None else self.facet_face == face], self.dim)
        out[between] = out[ends].min(axis=1) if name == "status" else out[ends].mean(axis=1)
        return out

    def object_at(self, k: int) -> Array:
        """Return the corners (f, 3, 3) mm of the object's triangles at the k-th kept increment."""
        moved = self.object_points @ self.object_rotation[k].T + self.object_place[k]
        return np.asarray(moved[self.object_faces])


def chosen(count: int, most: int = MOST) -> list[int]:
    """Numbers of at most `most` of `count` increments, spread evenly, the last among them.

    >>> chosen(3), chosen(21, 5)
    ([0, 1, 2], [0, 5, 10, 15, 20])
    """
    return np.unique(np.round(np.linspace(count - 1, 0, min(count, most))).astype(int)).tolist() if count else []


def states_of(
    problem: Problem, steps: Sequence[StepResult], mesh: Mesh, parent: Array, sign: Array, last: Array
) -> States:
    """Recover chosen increments.

    Parameters
    ----------
    steps : those that converged, in turn
    mesh, parent, sign : the whole finger, and where each node comes from (`finger3d.fem.mesh.unfold`)
    last : (n, d) mm, displacement of the whole finger at the end, which is known already
    """
    from finger3d.fem.recovery import displacement

    kept = chosen(len(steps))
    u = np.empty((len(kept), *mesh.points.shape), dtype=np.float32)
    parts = [steps[number].meshed_state for number in kept[:-1]]
    for k, unknowns in enumerate(formulation_of(problem.model).unknowns(problem, parts)):
        u[k] = displacement(problem.mesh, unknowns)[parent] * sign
    u[-1] = last
    tables = [contact_table(problem.points, steps[i]) for i in kept]
    at = [steps[i].target for i in kept]
    placed = [problem.placed(target) for target in at]
    thing = _object_drawing(problem, placed)

    def columns(name: str) -> Array:
        return np.array([t[name] for t in tables], dtype=np.float32)

    return States(
        **_of_mesh(mesh),
        nodes=problem.points.nodes.astype(np.int32),
        face=problem.points.face.astype(np.int8),
        compliance=problem.points.compliance.astype(np.float32),
        step=np.array(kept) + 1,
        target=np.array([(t.depth_mm, t.slide_x_mm, t.slide_z_mm, *np.degrees(t.turns)) for t in at]),
        displacement=u,
        **{name: columns(f"{name}_MPa") for name in ("pressure", "shear_x", "shear_y", "shear_z")},
        gap=columns("gap_mm"),
        status=np.array([steps[i].state.status for i in kept], dtype=np.int8),
        object_points=thing.points.astype(np.float32),
        object_faces=thing.faces.astype(np.int32),
        object_rotation=np.array([p.turned for p in placed]),
        object_place=np.array([p.place for p in placed]),
    )


def _of_mesh(mesh: Mesh) -> dict[str, Array]:
    """Return the fields of states that a mesh has."""
    facets = {label: f for label, f in mesh.facets.items() if len(f)}
    faces = {label: FREE_FACES.index(label) if label in FREE_FACES else -1 for label in facets}
    return {
        "points": mesh.points.astype(np.float32),
        "cells": mesh.cells.astype(np.int32),
        "part": (np.zeros(len(mesh.cells)) if mesh.part is None else mesh.part).astype(np.int8),
        "facets": np.concatenate(list(facets.values())).astype(np.int32),
        "facet_face": np.concatenate([np.full(len(f), faces[label], dtype=np.int8) for label, f in facets.items()]),
    }


def facing(fingers: tuple[States, States], mesh: Mesh, closed_mm: Array) -> States:
    """Return the states of two fingers that face each other, of which each has those of the second in its own frame.

    Parameters
    ----------
    mesh : of both at first touch
    closed_mm : (s,) by how much the second has come down at each increment
    """
    first, second = fingers
    moved = second.displacement * np.array([1.0, -1.0, 1.0], dtype=np.float32)[: first.dim]
    moved[:, :, 1] -= closed_mm[:, None]
    both = {name: np.concatenate([getattr(first, name), getattr(second, name)], axis=-1) for name in _OF_CONTACT_POINTS}
    return replace(
        first,
        **_of_mesh(mesh),
        **both,
        nodes=np.concatenate([first.nodes, second.nodes + len(first.points)]),
        displacement=np.concatenate([first.displacement, moved], axis=1),
        shear_y=np.concatenate([first.shear_y, -second.shear_y], axis=1),
    )


_OF_CONTACT_POINTS = "face", "compliance", "pressure", "shear_x", "shear_z", "gap", "status"
"""Fields that two fingers have one after the other along their last axis."""


def _object_drawing(problem: Problem, placed: Sequence[PlacedObject]) -> Triangles:
    """Return the object's triangles in its own coordinates, as far as they reach over the finger in some poses."""
    half = problem.model.design.half_length_mm, 0.5 * problem.model.design.width_mm
    beside = max(float(np.hypot(*p.place[::2])) for p in placed)
    reach, thing = 1.1 * float(np.hypot(*half)) + beside, problem.model.object
    if problem.model.centre_of_mass_mm is not None:  # all of what two fingers hold
        reach = max(reach, float(np.abs(thing.highest_point).max()))
    found = thing.drawing(reach)
    return found if len(found.faces) <= _MOST_TRIANGLES else Triangles(found.points[:0], found.faces[:0])


def write_states(path: str | Path, states: States) -> None:
    """Write steps.npz."""
    write_arrays(path, {f.name: getattr(states, f.name) for f in fields(States)})


def load_states(path: str | Path) -> States:
    """Read steps.npz.

    Raises
    ------
    Finger3dError
        If it cannot be read, is damaged, or is of another version.
    """
    try:
        data = read_arrays(path)
        if missing := [f.name for f in fields(States) if f.name not in data]:
            raise ValueError(f"{missing[0]} is missing")
    except (OSError, ValueError) as error:
        why = " ".join(str(error).split())
        raise Finger3dError(f"{path}: cannot be read as steps of a press ({why}); press the scene again") from None
    return States(**{f.name: data[f.name] for f in fields(States)})


def label(step: int, target: Array) -> str:
    """Return the label of a step from its number, and depth, slides and turns (6,), mm and degrees."""
    depth, x, z, *turns = (without_round_off(float(v)) for v in target)
    slid = "".join(f", slid {v:.4g} mm along {axis}" for v, axis in ((x, "x"), (z, "z")) if v)
    turned = "".join(f", turned {v:.4g} deg about {axis}" for v, axis in zip(turns, "xyz", strict=True) if v)
    return f"increment {step}: {depth:.4g} mm deep{slid}{turned}"


def captions(states: States) -> list[str]:
    """Return the label of each kept step."""
    return [label(int(s), t) for s, t in zip(states.step, states.target, strict=True)]


_VTK_TYPES = ("f8", "f4", "i8", "i4", "i1", "u1")


def write_vtu(
    path: str | Path,
    mesh: Mesh,
    point_data: Mapping[str, ArrayLike],
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write a mesh and its fields for ParaView or PyVista, without loading VTK.

    Points, vectors and tensors of a 2D mesh get a third component of zero.

    Parameters
    ----------
    mesh : linear or quadratic simplices; points in mm
    point_data : name -> (n,) or (n, k), or tensors (n, d, d)
    cell_data : name -> (e,) or (e, k), or (e, d, d)
    """
    whole = [(len(mesh.points), point_data), (len(mesh.cells), cell_data or {})]
    at_points, at_cells = (
        {_escaped(name): _vtk_values(name, np.asarray(values), count, mesh.dim) for name, values in fields.items()}
        for count, fields in whole
    )
    points = _vtk_values("points", mesh.points, len(mesh.points), mesh.dim)
    grid = meshio.Mesh(points, [(mesh.element.name, mesh.cells)], at_points, {k: [v] for k, v in at_cells.items()})
    with atomic(path) as temporary:
        # 64-bit counts of bytes, for fields beyond 4 GB; compression would take ten times as long
        meshio.vtu.write(temporary, grid, compression=None, header_type="UInt64")


def _escaped(name: str) -> str:
    """Return a name as an attribute of XML, which meshio writes as it is."""
    return escape(name).encode("ascii", "xmlcharrefreplace").decode()


def _vtk_values(name: str, values: Array, count: int, dim: int) -> Array:
    """Values as (count,) or (count, k) of a type VTK knows, padded to three dimensions."""
    if values.ndim not in (1, 2, 3) or len(values) != count:
        raise ValueError(f"field {name!r} has shape {values.shape}; its first length must be {count}")
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    elif values.dtype.str[1:] not in _VTK_TYPES:
        values = values.astype(np.float64)
    if dim == 2 and values.ndim > 1 and values.shape[-1] == 2:
        values = np.pad(values, [(0, 0)] + [(0, 1)] * (values.ndim - 1))
    return values.reshape(count, -1) if values.ndim == 3 else values


def grid(folder: str | Path, step: int | None = None) -> pyvista.UnstructuredGrid:
    """Return the finger at rest with its fields, from a folder of results.

    Parameters
    ----------
    step : as in `PressResult.to_pyvista`

    Raises
    ------
    Finger3dError
        If the folder holds no fields, or not that step.
    """
    require("to_pyvista()", "pyvista", instead="read fields.vtu with ParaView")
    import pyvista

    path = Path(folder) / "fields.vtu"
    if not path.exists():
        raise Finger3dError(f"{folder}: holds no fields.vtu; press a scene into it first")
    found = pyvista.read(path)
    if step is None:
        return found
    states = load_states(Path(folder) / "steps.npz")
    k = states.index(step, folder)
    found.point_data.clear()
    found["displacement"] = np.pad(states.displacement[k], [(0, 0), (0, 3 - states.dim)])
    for name in ("pressure", "shear_x", "shear_z", "status"):
        found[name] = states.on_points(name, k)
    return found
