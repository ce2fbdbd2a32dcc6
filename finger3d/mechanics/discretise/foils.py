"""Stiffness of embedded gauges: every gauge is a thin foil in the body, stiff along its length.

A foil of section thickness x width adds ``int E A eps(u) eps(v) ds`` to the body's stiffness, eps the strain along it.
It is cut into bars whose ends follow the mesh's displacements; each bar's strain is one more condensed row, and its
stiffness a spring on that row, so the body keeps its one factorisation (Woodbury).  In a solid the bars lie side by
side over the foil's width along z; in a section the foil is spread over the finger's width.

The compliance of the body under a foil's own forces is not taken from the mesh, which would need cells of a hundredth
of the foil, but from a foil in an infinite body (`finger3d.fem.embedded`).  This neglects the effect of the
body's surface, which decays within the foil's length (see validation/embedded_gauge_study.py).  The foil has no bending
and no shear stiffness, and no volume.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from finger3d._types import Float, Int, freeze_arrays
from finger3d.errors import Finger3dError
from finger3d.fem.embedded import AddedStiffness, Bars, FoilPatches, InfiniteBody
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh import Mesh, cells_at, reflect_into_part
from finger3d.fem.surface import displacement_rows
from finger3d.mechanics.model import Foils, Model
from finger3d.mechanics.readings import Gauge


@dataclass(frozen=True)
class EmbeddedBars:
    """Stiff inclusions of a meshed part, divided into bars.

    Attributes
    ----------
    directions : (s, d) unit vectors
    relative : (s d, n d) sparse, 1/mm
        Displacement of one end of every bar relative to the other, over its length.
    bar_stiffness : (s,) array, N mm
        Stiffness of the bars that belongs to the part.
    gauge_weights : (g, s) array
        Strain of each gauge of the model from the strains of the bars.
    self_compliance : (s, s) array, 1/(N mm)
        Strain of the bars per unit force of the bars in an infinite body; it replaces that of the mesh, which does not
        resolve a bar.
    """

    directions: Float
    relative: sp.csr_matrix
    bar_stiffness: Float
    gauge_weights: Float
    self_compliance: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def rows(self) -> sp.csr_matrix:
        """Rows (s, n d) of the bars' strains from small displacements."""
        count, d = self.directions.shape
        along = sp.csr_matrix((self.directions.ravel(), np.arange(count * d), np.arange(count + 1) * d))
        return sp.csr_matrix(along @ self.relative)

    def in_mesh(self, compliance: Float) -> AddedStiffness:
        """Return the stiffness of the bars in a mesh that has the compliance (s, s) at their places."""
        lacking = self.self_compliance - compliance
        both = np.vstack([self.gauge_weights, np.eye(len(self.bar_stiffness))])
        return AddedStiffness(
            bars=Bars(self.directions, self.relative, self.bar_stiffness, lacking),
            gauge_weights=self.gauge_weights,
            bar_stiffness=self.bar_stiffness,
            subgrid_compliance=both @ lacking @ both.T,
        )


def foil_mirrors(model: Model) -> frozenset[str]:
    """Return the planes, "x" and "z", about which the foils of all gauges together are symmetric."""
    foils = {_place(gauge) for gauge in model.gauges}
    images = {
        "x": [replace(g, x_mm=-g.x_mm, angle=math.pi - g.angle) for g in model.gauges],
        "z": [replace(g, z_mm=-g.z_mm) for g in model.gauges],
    }
    return frozenset(axis for axis, image in images.items() if {_place(gauge) for gauge in image} <= foils)


def discretised_foils(inclusions: Foils, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> EmbeddedBars:
    """Return the bars of all foils; bars that are mirror images of each other share a row.

    The meshed part has its share of the energy of all foils, those in a mirror image included.
    """
    copies = 2 ** len(axes)
    foils = [
        FoilPatches.of(g.middle, g.direction, g.length_mm, inclusions.width_mm, *inclusions.patches[mesh.dim - 2])
        for g in model.gauges
    ]
    bars: dict[tuple[float, ...], tuple[Float, sp.csr_matrix]] = {}
    numbers = np.concatenate([_insert(bars, foil, mesh, axes) for foil in foils])
    stiff = inclusions.E_MPa * inclusions.thickness_mm * np.concatenate([foil.area for foil in foils])
    bar_stiffness = np.bincount(numbers, stiff, len(bars)) / copies
    gauge = np.repeat(np.arange(len(foils)), [len(foil.area) for foil in foils])
    gauge_weights = np.zeros((len(foils), len(bars)))
    np.add.at(gauge_weights, (gauge, numbers), stiff / np.bincount(gauge, stiff)[gauge])
    weights = np.zeros((len(bars), len(numbers)))
    weights[numbers, np.arange(len(numbers))] = stiff / (copies * bar_stiffness[numbers])
    around = _surroundings(model, mesh, axes)
    self_compliance = copies * weights @ _infinite_body_compliance(model, around, foils) @ weights.T
    directions, relative = zip(*bars.values(), strict=True)
    rows = sp.vstack(relative, format="csr")
    return EmbeddedBars(np.array(directions), rows, bar_stiffness, gauge_weights, self_compliance)


def _surroundings(model: Model, mesh: Mesh, axes: tuple[str, ...]) -> Isotropic:
    """Return the material that all foils lie in.

    Raises
    ------
    Finger3dError
        If they lie in several parts: each foil must be surrounded by the material that unloads it.
    """
    materials, gauge_of_part = model.materials(mesh.part_labels), dict[int, str]()
    part = np.zeros(len(mesh.cells), dtype=np.int64) if mesh.part is None else mesh.part
    for gauge in model.gauges:
        for place in (gauge.middle, *gauge.ends):
            inside, _ = reflect_into_part(place, np.ones(3), axes, mesh.dim)
            for cell, _ in cells_at(mesh, inside):
                gauge_of_part.setdefault(int(part[cell]), gauge.name)
    if len(gauge_of_part) > 1:
        first, second = list(gauge_of_part.values())[:2]
        where = (
            f'gauge "{first}" crosses an interface' if first == second else f'gauges "{first}" and "{second}" do not'
        )
        raise Finger3dError(
            f"effects.embedded_gauge: all foils must lie in one part of the finger, and {where}; move them, or press "
            "with the foils of one part at a time"
        )
    return materials[next(iter(gauge_of_part), 0)]


def _infinite_body_compliance(model: Model, material: Isotropic, foils: list[FoilPatches]) -> Float:
    """Return the compliance of all bars in an infinite body."""
    section = None if model.domain == "solid" else model.design.width_mm
    body = InfiniteBody(material.E_MPa, material.nu, model.domain == "plane-stress", section)
    compliance = np.block([[a.strain_due_to(b, body) for b in foils] for a in foils])
    return np.asarray(0.5 * (compliance + compliance.T))


def _insert(
    bars: dict[tuple[float, ...], tuple[Float, sp.csr_matrix]], foil: FoilPatches, mesh: Mesh, axes: tuple[str, ...]
) -> Int:
    """Insert the bars of a foil that are missing, each with its direction and the rows of its relative displacement.

    Returns the numbers (bars,) of all of the foil's bars.
    """
    ends, point_rows, numbers = foil.centres, {}, []
    order = {key: i for i, key in enumerate(bars)}

    def displacement(point: Float) -> sp.csr_matrix:
        if tuple(point) not in point_rows:
            inside, signs = reflect_into_part(point, np.ones(3), axes, mesh.dim)
            point_rows[tuple(point)] = displacement_rows(mesh, inside, signs)
        return point_rows[tuple(point)]

    for a, b in zip(ends[:-1].reshape(-1, 3), ends[1:].reshape(-1, 3), strict=True):
        key = _key(a, b, axes, mesh.dim)
        if key not in bars:
            order[key] = len(bars)
            length = np.linalg.norm(b - a)
            bars[key] = (b - a)[: mesh.dim] / length, sp.csr_matrix((displacement(b) - displacement(a)) / length)
        numbers.append(order[key])
    return np.array(numbers)


def _key(a: Float, b: Float, axes: tuple[str, ...], dim: int) -> tuple[float, ...]:
    """Return a key that a bar shares with its mirror images."""
    images = sorted((reflect_into_part(p, p, axes, dim)[0] for p in (a, b)), key=tuple)
    return tuple(np.round(np.concatenate(images), 9) + 0.0)


def _place(gauge: Gauge) -> tuple[float, ...]:
    """Return a key of middle (mm), direction within half a turn, and length, which identify a foil."""
    twice = 2.0 * gauge.angle
    place = [gauge.x_mm, gauge.y_mm, gauge.z_mm, math.cos(twice), math.sin(twice), gauge.length_mm]
    return tuple(np.round(place, 9) + 0.0)
