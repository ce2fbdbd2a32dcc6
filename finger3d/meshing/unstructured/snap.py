"""Move boundary nodes of a tetrahedral mesh onto the CAD faces, from which fTetWild deviates by up to its envelope.

A boundary facet belongs to the CAD face it is nearest to and parallel with; a node belongs to the faces of its facets
and is moved to where they meet; of faces that join smoothly only the nearest counts. The same holds for mid-edge nodes.
A facet between two parts of a body belongs to a CAD face between these parts.

Two faces without a crease between them, such as a fillet and the flat it starts from, define no line on which a node
could be placed.  A node one edge length h from the seam is up to h^2/8R off one of the surfaces; moved onto both, it
would slide along them past its neighbours.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.fem.mesh import FACETS, TET4, TRI3, Mesh, cell_angles_deg, curved_jacobians, quadratic
from finger3d.geometry.cad import OUTSIDE
from finger3d.geometry.faceted import Faceted, moved_onto
from finger3d.geometry.surface import Triangles, connected
from finger3d.geometry.tessellate import CadFace, ImplicitPlane, Tessellation

_MOST_SAMPLES = 20_000
"""Largest number of points with which the surface of a part is sampled."""


class PartFacets(NamedTuple):
    """Facets between cells of different parts, and of the surface.

    Attributes
    ----------
    faces : (m, 3) oriented outward from the part inside them
    inside, outside : (m,) numbers of the parts on their sides; outside is OUTSIDE at the surface
    """

    faces: Int
    inside: Int
    outside: Int

    @property
    def free(self) -> Int:
        """Facets (k, 3) of the surface."""
        return np.asarray(self.faces[self.outside == OUTSIDE])


def part_facets(tets: Int, part: Int | None = None) -> PartFacets:
    """Return the facets of linear cells (t, 4) that belong to one cell only, or to cells of two parts (t,)."""
    faces = tets[:, FACETS[3]].reshape(-1, 3)
    owner = np.zeros(len(faces), dtype=np.int64) if part is None else np.repeat(part, 4)
    key = np.sort(faces, axis=1)
    order = np.lexsort([owner, key[:, 2], key[:, 1], key[:, 0]])
    twice = (key[order[1:]] == key[order[:-1]]).all(axis=1)
    single = ~(np.append(twice, False) | np.append(False, twice))
    first, second = order[:-1][twice], order[1:][twice]
    between = owner[first] != owner[second]
    chosen = np.concatenate([order[single], first[between]])
    outside = np.concatenate([np.full(single.sum(), OUTSIDE), owner[second[between]]])
    back = np.argsort(chosen, kind="stable")  # in the order of the cells
    chosen, outside = chosen[back], outside[back]
    return PartFacets(faces[chosen], owner[chosen], outside)


def parts_of(points: Float, body: Tessellation) -> Int:
    """Return the number (n,) of the part that holds each point (n, 3), OUTSIDE for points in none."""
    parts = np.full(len(points), OUTSIDE)
    depth = np.zeros(len(points))
    for number in range(len(body.part_labels) + 1):
        surface = body.part(number)
        if not len(surface.faces):
            continue
        box = np.all((surface.low <= points) & (points <= surface.high), axis=1)
        distance = np.ones(len(points))
        distance[box] = surface.signed_distance(points[box])[0]
        deeper = distance < depth
        parts[deeper], depth[deeper] = number, distance[deeper]
    return parts


def thickness(surface: Triangles) -> float:
    """Return twice the volume over the area of a closed surface, mm: the thickness of a layer."""
    return float(2.0 * surface.volume / np.linalg.norm(surface.area_vectors, axis=1).sum())


def points_on(surface: Triangles, step: float) -> Float:
    """Return points (n, 3), mm, on a surface, about a step (mm) apart."""
    area = np.linalg.norm(surface.area_vectors, axis=1)
    count = int(np.clip(4.0 * area.sum() / step**2, 100, _MOST_SAMPLES))
    random = np.random.default_rng(0)  # the same points every time
    chosen = random.choice(len(area), count, p=area / area.sum())
    weight = random.dirichlet(np.ones(3), count)
    return np.asarray(np.einsum("nk,nkd->nd", weight, surface.corners[chosen]))


Bool = NDArray[np.bool_]

SMOOTH = np.cos(np.radians(6.0))
"""Creases below 6 degrees count as none: an edge of length h that cuts across one misses it by h/80 at most, and a node
put onto two surfaces at a smaller angle moves by more than ten times its distance from them."""

_PLANES = ("base", "symmetry_x", "symmetry_z")  # stay exactly planar, whatever runs into them


class Seams:
    """The seams of a body, sampled where its tessellation has points on them."""

    def __init__(self, body: Tessellation) -> None:
        self.faces = body.faces
        self.exact_plane = np.array([f.label in _PLANES and isinstance(f.surface, ImplicitPlane) for f in body.faces])
        self._triangles = [Triangles(body.points, body.triangles[body.face == i]) for i in range(len(body.faces))]
        self._samples: dict[tuple[int, int], tuple[Float, Bool]] = {}
        if any(isinstance(f.surface, Faceted) for f in body.faces):
            return  # patches of an STL body are smooth themselves, and end at creases
        used = [np.unique(t.faces) for t in self._triangles]
        for i, j in combinations(range(len(body.faces)), 2):
            if len(shared := np.intersect1d(used[i], used[j])):
                seam_points = body.points[shared]
                a, b = (body.faces[k].sign * body.faces[k].surface.distance(seam_points)[1] for k in (i, j))
                self._samples[i, j] = seam_points, np.einsum("ij,ij->i", a, b) > SMOOTH

    def one_per_smooth_group(self, points: Float, sets: Bool, candidates: Bool | None = None) -> Bool:
        """Return the sets (n, f) with one face of each smooth group: an exact plane, or the one nearest to the point.

        The `candidates` (n, f) belong to a group as well if they join a face of the set smoothly.
        """
        from scipy.spatial import cKDTree

        count = sets.shape[1]
        members = sets if candidates is None else sets | candidates
        links = []
        for (i, j), (seam_points, smooth) in self._samples.items():
            both = np.flatnonzero(members[:, i] & members[:, j])
            if len(both) and smooth.any():
                both = both[smooth[cKDTree(seam_points).query(points[both])[1]]]
                links.append(np.stack([both * count + i, both * count + j]))
        if not links or not (pairs := np.hstack(links)).size:
            return sets
        group = connected(sets.size, *pairs)
        several = np.unique(pairs)
        several = several[np.isin(group[several], group[several[sets.ravel()[several]]])]
        distance = self.distance(points, several // count, several % count)
        first = several[np.lexsort([distance, ~self.exact_plane[several % count], group[several]])]
        chosen = first[np.unique(group[first], return_index=True)[1]]
        rows = sets.copy()
        rows.ravel()[several] = False
        rows.ravel()[chosen] = True
        return rows

    def reduce_to_nearest(self, points: Float, sets: Bool) -> Bool:
        """Return the sets (n, f) reduced to the exact planes and the nearest of the other faces."""
        others = sets & ~self.exact_plane
        node, face = np.nonzero(others)
        order = np.lexsort([self.distance(points, node, face), node])
        node, face = node[order], face[order]
        first = np.unique(node, return_index=True)[1]
        rows: NDArray[np.bool_] = sets & self.exact_plane
        rows[node[first], face[first]] = True
        return rows

    def reduce_to_exact_planes(self, points: Float, sets: Bool) -> Bool:
        """Return the sets (n, f) reduced to the exact planes, if there are any."""
        planes = sets & self.exact_plane
        return np.where(planes.any(axis=1)[:, None], planes, sets)

    def distance(self, points: Float, node: Int, face: Int) -> Float:
        """Distance (k,), mm, of points[node] from the triangles of the faces (k,)."""
        out = np.empty(len(node))
        for i in np.unique(face):
            at = points[node[face == i]]
            out[face == i] = np.linalg.norm(self._triangles[i].closest(at)[0] - at, axis=1)
        return out


MIN_DIHEDRAL_DEG = 3.0
"""Cells flatter than this are repaired, or the mesh is made anew. Good meshes were seen at 12 to 27 degrees."""

_RANK_TOLERANCE = 0.05  # singular values below this share stem from faces that are parallel: one condition, not two
_MAX_MOVE = 0.5  # of its edges' mean length: a node that would have to move farther to a crease is not placed on it
_MAX_OUTSIDE = 2.0  # of its longest edge: a facet that lies farther outside a face's box is not on it
_MAX_COLLAPSES = 100
_MAX_STRAIGHTENED = 0.01  # of all cells: where a crease of the surface runs through them


class UnusableMeshError(Exception):
    """The mesh is unusable; another attempt of the mesher may succeed."""


def snap(points: Float, tets: Int, body: Tessellation, part: Int | None = None) -> Mesh:
    """Return a quadratic mesh with labelled facets on the CAD surfaces, from linear tets near them.

    `part` (t,) is the number of the part of each tet, for a body of several parts.

    Raises
    ------
    UnusableMeshError
        If the boundary is open, a node cannot be placed, or cells remain flat or inverted.
    """
    seams = Seams(body)
    facets = part_facets(tets, part)
    check_parts_closed(facets)
    sets = _node_sets(points, facets.faces, _cad_faces(points, facets, body), body)
    points, sets = snap_nodes(points, sets, seams, _MAX_MOVE * _edge_lengths(points, facets.faces))
    points, tets, sets, part = repair(points, tets, sets, part)
    facets = part_facets(tets, part)
    check_parts_closed(facets)
    owner = _cad_faces(points, facets, body, sets)
    label = np.array([f.label for f in body.faces])[owner]
    labelled = {str(name): facets.faces[label == name] for name in np.unique(label)}
    mesh = quadratic(Mesh(points, tets, labelled, part, body.part_labels))
    mesh = _straighten_inverted(_snap_mid_edge_nodes(mesh, owner[np.argsort(label, kind="stable")], sets, seams))
    if (bad := int(np.sum(curved_jacobians(mesh) <= 0.0))) > 0:
        raise UnusableMeshError(f"{bad} curved cells turned inside out at the surface")
    return replace(mesh, facets={name: f for name, f in mesh.facets.items() if name})  # facets between parts have none


def _edge_lengths(points: Float, faces: Int) -> Float:
    """Mean length (n,), mm, of the boundary edges at every node; 0 inside."""
    edges = faces[:, TRI3.edges].reshape(-1, 2)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    count = np.bincount(edges.ravel(), minlength=len(points))
    return np.asarray(np.bincount(edges.ravel(), np.repeat(length, 2), len(points)) / np.maximum(count, 1))


def _straighten_inverted(mesh: Mesh) -> Mesh:
    """Return the mesh with straight edges in cells that curved edges have inverted, if these are few."""
    bad = curved_jacobians(mesh) <= 0.0
    if not bad.any() or bad.mean() > _MAX_STRAIGHTENED:
        return mesh
    cells = mesh.cells[bad]
    points = mesh.points.copy()
    points[cells[:, 4:]] = points[cells[:, TET4.edges]].mean(axis=2)
    return replace(mesh, points=points)


def check_closed(faces: Int) -> None:
    """Raise an error if an edge of the boundary does not belong to exactly two facets."""
    edges = np.sort(faces[:, TRI3.edges].reshape(-1, 2), axis=1)
    count = np.unique(edges, axis=0, return_counts=True)[1]
    if not len(faces) or (count != 2).any():
        raise UnusableMeshError("its boundary is not closed")


def check_parts_closed(facets: PartFacets) -> None:
    """Raise an error if the surface of a part has an edge that does not belong to exactly two facets."""
    check_closed(facets.free)
    for number in np.unique([facets.inside, facets.outside]) if (facets.outside != OUTSIDE).any() else []:
        if number != OUTSIDE:
            check_closed(facets.faces[(facets.inside == number) | (facets.outside == number)])


def _cad_faces(points: Float, facets: PartFacets, body: Tessellation, sets: Bool | None = None) -> Int:
    """Return the number (m,) of the CAD face of each facet, between the same parts if there is one.

    With `sets`, all nodes of the facet lie on it.
    """
    faces = facets.faces
    a, b, c = (points[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    twice = np.linalg.norm(normal, axis=1)
    normal /= np.maximum(twice, 1e-300)[:, None]
    middle = (a + b + c) / 3.0
    longest = np.max([np.linalg.norm(q - p, axis=1) for p, q in pairwise((a, b, c, a))], axis=0)
    cost = np.empty((len(body.faces), len(faces)))
    for i, f in enumerate(body.faces):
        outside = np.linalg.norm(np.maximum(0.0, np.maximum(f.low - middle, middle - f.high)), axis=1) / longest
        near = outside < _MAX_OUTSIDE
        cost[i] = outside + 2.0
        distance, gradient = f.surface.distance(middle[near])
        aligned = f.sign * np.einsum("ij,ij->i", normal[near], gradient)
        cost[i, near] = np.abs(distance) / longest[near] + outside[near] + 1.0 - aligned
        cost[i] += np.where((facets.inside == f.inside) & (facets.outside == f.outside), 0.0, 1e2)
    if sets is not None:
        shared = np.logical_and.reduce(sets[faces], axis=1)
        none = np.logical_not(shared.any(axis=1))
        cost += np.where(shared | none[:, None], 0.0, 1e3).T
    value: Int = np.argmin(cost, axis=0)
    return value


def _node_sets(points: Float, faces: Int, owner: Int, body: Tessellation) -> Bool:
    """Return which CAD faces (n, f) each node belongs to; each CAD corner takes its nearest boundary node."""
    sets = np.zeros((len(points), len(body.faces)), dtype=bool)
    sets[faces.ravel(), np.repeat(owner, 3)] = True
    nodes = np.unique(faces)
    for corner, meeting in zip(body.corners, body.corner_faces, strict=True):
        nearest = nodes[np.argmin(np.linalg.norm(points[nodes] - corner, axis=1))]
        sets[nearest, list(meeting)] = True
    return sets


def snap_nodes(
    points: Float, sets: Bool, seams: Seams, reach: Float, candidates: Bool | None = None
) -> tuple[Float, Bool]:
    """Return points (n, 3) moved onto the CAD faces of their sets (n, f), and the faces that each lies on.

    A point that cannot be moved to where its faces meet, or only by more than its reach (n,), mm, is moved onto the
    nearest of them.  It does not leave the base and the symmetry planes, and leaves the nearest face for one of these
    only if there is no place on both within twice its distance from them.

    Raises
    ------
    UnusableMeshError
        If that fails as well.
    """
    rows = seams.one_per_smooth_group(points, sets, candidates)
    projected, failed = project(points, rows, seams.faces)
    for reduced in (seams.reduce_to_nearest, seams.reduce_to_exact_planes):
        again = failed | ((rows.sum(axis=1) > 1) & (np.linalg.norm(projected - points, axis=1) > reach))
        if again.any():
            rows = rows.copy()
            rows[again] = reduced(points[again], rows[again])
            projected[again], failed[again] = project(points[again], rows[again], seams.faces)
            reach = reach.copy()
            node, face = np.nonzero(rows & again[:, None])
            np.maximum.at(reach, node, 2.0 * seams.distance(points, node, face))
    if failed.any():
        raise UnusableMeshError("a surface node finds no place on its CAD faces")
    return projected, rows


def project(points: Float, sets: Bool, faces: tuple[CadFace, ...]) -> tuple[Float, Bool]:
    """Move every point (n, 3) onto all surfaces of its set (n, f), by Newton steps of least length.

    Returns the points, and a mask (n,) of those that do not lie on all surfaces of their sets.
    """
    points = points.copy()
    failed = np.zeros(len(points), dtype=bool)
    scale = max((float((f.high - f.low).max()) for f in faces), default=0.0)
    groups, member = np.unique(sets, axis=0, return_inverse=True)
    member = member.reshape(-1)
    for g, row in enumerate(groups):
        chosen = [faces[i] for i in np.flatnonzero(row)]
        if not chosen:
            continue
        nodes = np.flatnonzero(member == g)
        p = points[nodes]
        if faceted := [f.surface for f in chosen if isinstance(f.surface, Faceted)]:
            onto = moved_onto(faceted, p)
            failed[nodes] = onto is None
            points[nodes] = p if onto is None else onto
            continue
        for _ in range(20):
            pairs = [f.surface.distance(p) for f in chosen]
            distance = np.stack([d for d, _ in pairs], axis=1)
            normals = np.stack([n for _, n in pairs], axis=1)
            if np.abs(distance).max() < 1e-13 * scale:
                break
            inverse = np.linalg.pinv(normals, rcond=_RANK_TOLERANCE)
            p = p - np.einsum("nxk,nk->nx", inverse, distance)
        failed[nodes] = ~(np.abs(distance).max(axis=1) <= 1e-7 * scale)
        for f in chosen:
            if isinstance(f.surface, ImplicitPlane) and f.surface.axis is not None:
                p[:, f.surface.axis] = f.surface.origin[f.surface.axis]
        points[nodes] = p
    return points, failed


def repair(points: Float, tets: Int, sets: Bool, part: Int | None = None) -> tuple[Float, Int, Bool, Int | None]:
    """Collapse short edges until no cell is flat or inverted; return points, cells, sets and parts that are left."""
    for _ in range(_MAX_COLLAPSES):
        angles = cell_angles_deg(points, tets)
        worst = int(np.argmin(angles))
        if angles[worst] >= MIN_DIHEDRAL_DEG:
            break
        tets, part = _collapse_edge(points, tets, sets, part, tets[worst])
    else:
        raise UnusableMeshError("too many flat cells")
    used = np.unique(tets)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return points[used], number[tets], sets[used], part


def _collapse_edge(points: Float, tets: Int, sets: Bool, part: Int | None, cell: Int) -> tuple[Int, Int | None]:
    """Return the tets and their parts after the shortest collapsible edge of a cell has been collapsed."""
    edges = cell[TET4.edges]
    faces = part_facets(tets, part).faces
    outer = {tuple(e) for e in np.sort(faces[:, TRI3.edges].reshape(-1, 2), axis=1).tolist()}
    for u, v in edges[np.argsort(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1))]:
        on_surface = sets[u].any() and sets[v].any()
        if on_surface and (min(u, v), max(u, v)) not in outer:
            continue
        for removed, kept in ((u, v), (v, u)):
            if (sets[removed] & ~sets[kept]).any():
                continue
            star = (tets == removed).any(axis=1)
            moved = star & ~(tets == kept).any(axis=1)
            changed = np.where(tets[moved] == removed, kept, tets[moved])
            if len(changed) and cell_angles_deg(points, changed).min() < MIN_DIHEDRAL_DEG:
                continue
            left = np.vstack([tets[~star], changed])
            left_part = None if part is None else np.concatenate([part[~star], part[moved]])
            try:
                check_parts_closed(part_facets(left, left_part))
            except UnusableMeshError:
                continue
            return left, left_part
    raise UnusableMeshError("a flat cell at the surface could not be removed")


def _snap_mid_edge_nodes(mesh: Mesh, owner: Int, vertex_sets: Bool, seams: Seams) -> Mesh:
    """Move the mid-edge nodes of boundary facets onto the CAD faces (m,) of these facets.

    A face that joins one of them smoothly is used instead if it is nearer and an end of the edge lies on it, which
    `vertex_sets` (n, f) states.
    """
    faces = np.vstack(list(mesh.facets.values()))
    sets = np.zeros((len(mesh.points), len(seams.faces)), dtype=bool)
    sets[faces[:, 3:].ravel(), np.repeat(owner, 3)] = True
    candidates = np.zeros_like(sets)
    reach = np.zeros(len(sets))
    for middle, (a, b) in zip(faces[:, 3:].T, faces[:, TRI3.edges].transpose(1, 2, 0), strict=True):
        candidates[middle] = vertex_sets[a] | vertex_sets[b]
        reach[middle] = 0.5 * _MAX_MOVE * np.linalg.norm(mesh.points[a] - mesh.points[b], axis=1)
    return replace(mesh, points=snap_nodes(mesh.points, sets, seams, reach, candidates)[0])
