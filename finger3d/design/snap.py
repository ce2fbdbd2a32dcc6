"""Put the nodes of a tetrahedral mesh back onto the CAD faces that fTetWild left by up to its envelope.

A boundary facet belongs to the CAD face it is nearest to and parallel with; a node belongs to the faces of its facets,
and goes where these surfaces meet. Mid-edge nodes likewise.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from finger3d.design.faceted import Faceted, moved_onto
from finger3d.design.quality import cell_angles_deg, curved_jacobians
from finger3d.design.surfaces import Plane
from finger3d.design.tessellate import Body, CadFace
from finger3d.mesh import EDGES, Mesh, boundary, quadratic

Float = NDArray[np.float64]
Int = NDArray[np.int64]
Bool = NDArray[np.bool_]

MIN_DIHEDRAL_DEG = 3.0
"""Cells flatter than this are repaired, or the mesh is made anew. Good meshes were seen at 12 to 27 degrees."""

_PARALLEL = 0.05  # singular values below this share stem from faces that touch smoothly: one condition, not two
_SMOOTH = 1e-3  # share of the body by which a node near such a seam may miss one of the two
_REPAIRS = 100
_FEW = 0.01  # of all cells: where a crease of the surface runs through them


class UnusableMeshError(Exception):
    """This mesh will not do; another attempt may."""


def snap(points: Float, tets: Int, body: Body) -> Mesh:
    """The quadratic mesh with labelled facets, on the CAD surfaces, made from linear tets near them.

    Raises
    ------
    UnusableMeshError
        The boundary is open, a node finds no place, or cells stay flat or inverted.
    """
    faces = boundary(tets, 3)
    check_closed(faces)
    sets = _node_sets(points, faces, _cad_faces(points, faces, body), body)
    points = project(points, sets, body.faces)
    points, tets, sets = repair(points, tets, sets)
    faces = boundary(tets, 3)
    check_closed(faces)
    owner = _cad_faces(points, faces, body, sets)
    labels = np.array([f.label for f in body.faces])
    mesh = quadratic(Mesh(points, tets, {str(label): faces[labels[owner] == label] for label in np.unique(labels)}))
    mesh = _straightened(_curve(mesh, body))
    if (bad := int(np.sum(curved_jacobians(mesh) <= 0.0))) > 0:
        raise UnusableMeshError(f"{bad} curved cells turned inside out at the surface")
    return mesh


def _straightened(mesh: Mesh) -> Mesh:
    """The mesh with straight edges in the cells that curved edges turned inside out, if these are few."""
    bad = curved_jacobians(mesh) <= 0.0
    if not bad.any() or bad.mean() > _FEW:
        return mesh
    cells, points = mesh.cells[bad], mesh.points.copy()
    points[cells[:, 4:]] = points[cells[:, EDGES[3]]].mean(axis=2)
    return replace(mesh, points=points)


def check_closed(faces: Int) -> None:
    """Refuse a boundary in which some edge does not belong to exactly two facets."""
    edges = np.sort(faces[:, EDGES[2]].reshape(-1, 2), axis=1)
    count = np.unique(edges, axis=0, return_counts=True)[1]
    if not len(faces) or (count != 2).any():
        raise UnusableMeshError("its boundary is not closed")


def _cad_faces(points: Float, faces: Int, body: Body, sets: Bool | None = None) -> Int:
    """Number of the CAD face (m,) under every boundary facet; of those all its nodes lie on, if `sets` is given."""
    a, b, c = (points[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    twice = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(twice, 1e-300)[:, None]
    middle = (a + b + c) / 3.0
    longest = np.max([np.linalg.norm(q - p, axis=1) for p, q in pairwise((a, b, c, a))], axis=0)
    cost = np.empty((len(body.faces), len(faces)))
    for i, f in enumerate(body.faces):
        distance, gradient = f.surface.distance(middle)
        outside = np.linalg.norm(np.maximum(0.0, np.maximum(f.low - middle, middle - f.high)), axis=1)
        away = (np.abs(distance) + outside) / longest
        cost[i] = away + 1.0 - f.sign * np.einsum("ij,ij->i", normal, gradient)
    if sets is not None:
        shared = np.logical_and.reduce(sets[faces], axis=1)
        none = np.logical_not(shared.any(axis=1))
        cost += np.where(shared | none[:, None], 0.0, 1e3).T
    return np.argmin(cost, axis=0)


def _node_sets(points: Float, faces: Int, owner: Int, body: Body) -> Bool:
    """Which CAD faces (n, f) every node belongs to; each CAD corner takes its nearest boundary node."""
    sets = np.zeros((len(points), len(body.faces)), dtype=bool)
    sets[faces.ravel(), np.repeat(owner, 3)] = True
    nodes = np.unique(faces)
    for corner, meeting in zip(body.corners, body.corner_faces, strict=True):
        nearest = nodes[np.argmin(np.linalg.norm(points[nodes] - corner, axis=1))]
        sets[nearest, list(meeting)] = True
    return sets


def project(points: Float, sets: Bool, faces: tuple[CadFace, ...]) -> Float:
    """Move every point (n, 3) onto all surfaces of its set (n, f), by Newton steps of least length."""
    points = points.copy()
    scale = float(np.ptp(points, axis=0).max())
    groups, member = np.unique(sets, axis=0, return_inverse=True)
    member = member.reshape(-1)
    for g, row in enumerate(groups):
        chosen = [faces[i] for i in np.flatnonzero(row)]
        if not chosen:
            continue
        at = np.flatnonzero(member == g)
        p = points[at]
        if faceted := [f.surface for f in chosen if isinstance(f.surface, Faceted)]:
            if (found := moved_onto(faceted, p)) is None:
                raise UnusableMeshError("a surface node lies between patches that do not meet")
            points[at] = found
            continue
        for _ in range(20):
            pairs = [f.surface.distance(p) for f in chosen]
            distance = np.stack([d for d, _ in pairs], axis=1)
            normals = np.stack([n for _, n in pairs], axis=1)
            if np.abs(distance).max() < 1e-13 * scale:
                break
            inverse = np.linalg.pinv(normals, rcond=_PARALLEL)
            p = p - np.einsum("nxk,nk->nx", inverse, distance)
        if np.abs(distance).max() > scale * (_SMOOTH if _touching(normals) else 1e-7):
            raise UnusableMeshError("a surface node finds no place on its CAD faces")
        for f in chosen:
            if isinstance(f.surface, Plane) and f.surface.axis is not None:
                p[:, f.surface.axis] = f.surface.origin[f.surface.axis]
        points[at] = p
    return points


def _touching(normals: Float) -> bool:
    """Whether two of the surfaces (n, k, 3) run along each other, so that they meet in no sharp edge."""
    along = np.abs(np.einsum("nix,njx->nij", normals, normals)) - np.eye(normals.shape[1])
    return bool(along.max() > 0.9)


def repair(points: Float, tets: Int, sets: Bool) -> tuple[Float, Int, Bool]:
    """Collapse short edges until no cell is flat or inverted; points and sets without the nodes that went."""
    for _ in range(_REPAIRS):
        angles = cell_angles_deg(points, tets)
        worst = int(np.argmin(angles))
        if angles[worst] >= MIN_DIHEDRAL_DEG:
            break
        tets = _collapsed(points, tets, sets, tets[worst])
    else:
        raise UnusableMeshError("too many flat cells")
    used = np.unique(tets)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return points[used], number[tets], sets[used]


def _collapsed(points: Float, tets: Int, sets: Bool, cell: Int) -> Int:
    """The tets after the shortest edge of a cell that may go has gone."""
    edges = cell[EDGES[3]]
    faces = boundary(tets, 3)
    outer = {tuple(e) for e in np.sort(faces[:, EDGES[2]].reshape(-1, 2), axis=1).tolist()}
    for u, v in edges[np.argsort(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))]:
        on_surface = sets[u].any() and sets[v].any()
        if on_surface and (min(u, v), max(u, v)) not in outer:
            continue
        for gone, kept in ((u, v), (v, u)):
            if (sets[gone] & ~sets[kept]).any():
                continue
            near = (tets == gone).any(axis=1)
            moved = tets[near & ~(tets == kept).any(axis=1)]
            moved = np.where(moved == gone, kept, moved)
            if len(moved) and cell_angles_deg(points, moved).min() < MIN_DIHEDRAL_DEG:
                continue
            fewer = np.vstack([tets[~near], moved])
            try:
                check_closed(boundary(fewer, 3))
            except UnusableMeshError:
                continue
            return fewer
    raise UnusableMeshError("a flat cell at the surface could not be removed")


def _curve(mesh: Mesh, body: Body) -> Mesh:
    """Put the mid-edge nodes of boundary facets onto the CAD faces of the facets that hold the edge."""
    faces = np.vstack(list(mesh.facets.values()))
    labels = np.repeat(list(mesh.facets), [len(f) for f in mesh.facets.values()])
    corner = _cad_faces(mesh.points, faces[:, :3], body)
    known = np.array([f.label for f in body.faces])
    if not np.array_equal(known[corner], labels):
        raise UnusableMeshError("a facet's label is not that of the CAD face next to it")
    sets = np.zeros((len(mesh.points), len(body.faces)), dtype=bool)
    sets[faces[:, 3:].ravel(), np.repeat(corner, 3)] = True
    return replace(mesh, points=project(mesh.points, sets, body.faces))
