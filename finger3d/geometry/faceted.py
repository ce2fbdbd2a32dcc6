"""Bodies of triangles without CAD: smooth patches replace CAD faces, and creases between patches replace edges."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float, Int
from finger3d.geometry.surface import Triangles, connected
from finger3d.geometry.surface_checks import mistake
from finger3d.geometry.tessellate import CadFace, Tessellation

_CREASE_COSINE = math.cos(math.radians(35.0))  # between normals; smaller ones separate patches
_MAX_PATCHES = 150  # with more, patches of one label are merged
_LEAST_UPWARD_NORMAL = 1e-3  # of a contact triangle
_NORMAL_TOLERANCE = 1e-6  # of a plane end
_LEAST_BEND = math.radians(0.3)  # angle below which neighbours are coplanar but for round-off
_DECIMATE_FROM = 2000  # triangles; fTetWild needed 3 minutes for 34 000
_MINORITY = 0.1  # of a smooth patch's area: a smaller share takes the label of the rest


@dataclass(frozen=True, eq=False)
class Network:
    """A closed surface and the patch (m,) that every triangle belongs to."""

    surface: Triangles
    patch: Int

    @cached_property
    def _sides(self) -> tuple[Int, Int]:
        """Edges (e, 2), and the patches (e, 2) on their two sides, the smaller one first."""
        a, b, edges = self.surface.neighbours
        return edges, np.sort(np.stack([self.patch[a], self.patch[b]], axis=1), axis=1)

    @cached_property
    def at_point(self) -> list[set[int]]:
        """Patches that meet in every point."""
        patches_at: list[set[int]] = [set() for _ in range(len(self.surface.points))]
        pairs = np.stack([self.surface.faces.ravel(), np.repeat(self.patch, 3)], axis=1)
        for v, p in np.unique(pairs, axis=0):
            patches_at[v].add(int(p))
        return patches_at

    def meeting(self, patches: tuple[int, ...], points: Float) -> Float | None:
        """Return the closest points (n, 3) where all these patches meet, or None if they do not meet."""
        if len(patches) == 2:
            edges, sides = self._sides
            shared = edges[np.all(sides == sorted(patches), axis=1)]
            if len(shared):
                return on_segments(points, self.surface.points[shared])
        corners = [v for v, here in enumerate(self.at_point) if here.issuperset(patches)]
        if not corners:
            return None
        corner_points = self.surface.points[corners]
        value: Float = corner_points[np.argmin(np.linalg.norm(points[:, None] - corner_points, axis=2), axis=1)]
        return value


def on_segments(points: Float, segments: Float) -> Float:
    """Return the closest points (n, d) of segments (s, 2, d)."""
    out = np.zeros_like(points)
    best = np.full(len(points), np.inf)
    for start, stop in segments:
        along = stop - start
        t = np.clip((points - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        projected = start + t[:, None] * along
        distance = np.linalg.norm(points - projected, axis=1)
        closer = distance < best
        out[closer], best[closer] = projected[closer], distance[closer]
    return out


@dataclass(frozen=True, eq=False)
class Faceted:
    """One patch of a network, as a surface with a border."""

    network: Network
    number: int

    @cached_property
    def triangles(self) -> Triangles:
        """The patch's own triangles."""
        return Triangles(self.network.surface.points, self.network.surface.faces[self.network.patch == self.number])

    @cached_property
    def radius(self) -> float:
        """A small radius of curvature on the patch, mm: from the angles between neighbours; inf where it is flat."""
        a, b, edge = self.triangles.neighbours
        angle = np.arccos(np.clip(np.einsum("ij,ij->i", self.triangles.normals[a], self.triangles.normals[b]), -1, 1))
        bent = (angle > _LEAST_BEND) & (angle < math.acos(_CREASE_COSINE))
        if not bent.any():
            return math.inf
        area = np.linalg.norm(self.triangles.area_vectors, axis=1)
        start, end = (self.triangles.points[edge[:, k]] for k in (0, 1))
        across = (area[a] + area[b]) / np.linalg.norm(end - start, axis=1)
        return float(np.quantile(across[bent] / angle[bent], 0.05))

    def distance(self, points: Float) -> tuple[Float, Float]:
        """Distance (n,) from the patch, mm, signed by the side, and the normal (n, 3) of the nearest triangle."""
        near, face, _ = self.triangles.closest(points)
        normal = self.triangles.normals[face]
        out = points - near
        side = np.where(np.einsum("ij,ij->i", out, normal) < 0.0, -1.0, 1.0)
        return side * np.linalg.norm(out, axis=1), normal


def moved_onto(surfaces: list[Faceted], points: Float) -> Float | None:
    """Return points moved onto one patch, or to where several meet; None if these do not meet."""
    if len(surfaces) == 1:
        return surfaces[0].triangles.closest(points)[0]
    return surfaces[0].network.meeting(tuple(s.number for s in surfaces), points)


def body(surface: Triangles) -> Tessellation:
    """Return a closed surface with its base on y = 0 as a body of labelled patches."""
    base = (surface.corners[:, :, 1] == 0.0).all(axis=1)
    up = _looks_up(surface, base)
    patch = _joined(surface, 2 * base + up)
    if patch.max() + 1 > _MAX_PATCHES:
        patch = np.unique(2 * base + up, return_inverse=True)[1].reshape(-1)
    network = Network(surface, patch)
    faces = []
    for number in range(int(patch.max()) + 1):
        mine = surface.corners[patch == number].reshape(-1, 3)
        along_z = np.abs(surface.normals[patch == number, 2]).min() > 1.0 - _NORMAL_TOLERANCE
        first = int(np.argmax(patch == number))
        label = "base" if base[first] else "contact" if up[first] else "ends" if along_z else "walls"
        faces.append(CadFace(label, Faceted(network, number), mine.min(axis=0), mine.max(axis=0), 1.0))
    many = [v for v, at in enumerate(network.at_point) if len(at) >= 3]
    corner_faces = tuple(tuple(sorted(network.at_point[v])) for v in many)
    return Tessellation(surface.points, surface.faces, patch, tuple(faces), surface.points[many], corner_faces)


def _looks_up(surface: Triangles, base: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask (m,) of contact triangles: those that face up, without single ones in a patch that does not."""
    up = (surface.normals[:, 1] > _LEAST_UPWARD_NORMAL) & ~base
    smooth = _joined(surface, base.astype(np.int64))
    area = np.linalg.norm(surface.area_vectors, axis=1)
    upward = np.bincount(smooth, area * up) / np.maximum(np.bincount(smooth, area), 1e-300)
    up[(upward > 1.0 - _MINORITY)[smooth]] = True
    up[(upward < _MINORITY)[smooth]] = False
    return up


def _joined(surface: Triangles, kind: Int) -> Int:
    """Return the number (m,) of the patch of each triangle; a patch is of one kind and has no crease."""
    a, b, _ = surface.neighbours
    joined = (kind[a] == kind[b]) & (np.einsum("ij,ij->i", surface.normals[a], surface.normals[b]) > _CREASE_COSINE)
    return connected(len(kind), a[joined], b[joined])


def coarser(body: Tessellation, tolerance: float) -> Tessellation:
    """Return the body with fewer triangles for the mesher; its patches, which nodes are snapped to, stay as they are.

    `tolerance` (mm) bounds the displacement of the surface by one removal; removals add up to some twenty times that.
    If the result is not closed, smaller tolerances are tried, and the body is returned unchanged in the end.
    """
    if len(body.triangles) <= _DECIMATE_FROM:
        return body
    for factor in (1.0, 0.5, 0.2, 0.1):
        coarse = _decimated(body, factor * tolerance)
        if not mistake(coarse):
            nearest = Triangles(body.points, body.triangles).closest(coarse.corners.mean(axis=1))[1]
            return replace(body, points=coarse.points, triangles=coarse.faces, face=body.face[nearest])
    return body


def _decimated(body: Tessellation, tolerance: float) -> Triangles:
    from pyvista import PolyData, wrap
    from vtkmodules.vtkFiltersCore import vtkDecimatePro

    decimate = vtkDecimatePro()
    decimate.SetInputData(PolyData(body.points, np.insert(body.triangles, 0, 3, axis=1).ravel()))
    decimate.SetTargetReduction(1.0 - 0.25 * _DECIMATE_FROM / len(body.triangles))
    decimate.PreserveTopologyOn()
    decimate.SplittingOff()
    decimate.AccumulateErrorOn()
    decimate.SetFeatureAngle(20.0)
    decimate.SetErrorIsAbsolute(1)
    decimate.SetAbsoluteError(tolerance)
    decimate.Update()
    made = wrap(decimate.GetOutput())
    return Triangles(np.asarray(made.points, dtype=float), np.asarray(made.regular_faces, dtype=np.int64))
