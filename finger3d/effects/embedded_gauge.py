"""Stiffness of embedded gauges: every gauge is a thin foil in the body, stiff along its length.

A foil of section thickness x width adds ``int E A eps(u) eps(v) ds`` to the body's stiffness, eps the strain along it.
It is cut into bars whose ends follow the mesh's displacements; each bar's strain is one more condensed row, and its
stiffness a spring on that row, so the body keeps its one factorisation (Woodbury).  In a solid the bars lie side by
side over the foil's width along z; in a section the foil is spread over the finger's width.

The compliance of the body under a foil's own forces is not taken from the mesh, which would need cells of a hundredth
of the foil, but from a foil in an infinite body (`finger3d.fem.kelvin`).  This neglects the effect of the body's
surface, which decays within the foil's length (see validation/embedded_gauge_study.py).  The foil has no bending and
no shear stiffness, and no volume.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from finger3d._ranges import Length, Modulus, at_most
from finger3d._types import Float, Int
from finger3d.effects.base import fill
from finger3d.errors import Finger3dError
from finger3d.fem.kelvin import FoilPatches, InfiniteBody
from finger3d.fem.locate import cells_at
from finger3d.fem.material import Isotropic
from finger3d.fem.simplex import Mesh, reflect_into_part
from finger3d.fem.traces import displacement_rows
from finger3d.mechanics.cost import AddedCost, PressCost
from finger3d.mechanics.gauges import Gauge
from finger3d.mechanics.model import EmbeddedBars, Model

_ROWS = {2: 16, 3: 96}
"""Condensed rows of a foil with its mirror images, by dimension; for the estimated cost."""

_FOIL_S = {2: 0.02, 3: 0.2}
"""Seconds to discretise a foil, by dimension."""

_COINCIDENT = 1e-9  # mm, and radians


@dataclass(frozen=True)
class Strips:
    """Foils along the gauges of a model: Young's modulus (MPa) and section (mm).

    `patches` are the divisions of a foil along and across, in a section and in a solid; the default is within half a
    percent of finer divisions.
    """

    E_MPa: float
    thickness_mm: float
    width_mm: float
    patches: tuple[tuple[int, int], tuple[int, int]] = ((16, 1), (12, 8))

    def added_cost(self, model: Model, press: PressCost) -> AddedCost:
        """Return the cost of the foils' rows and of the press without foils."""
        foils, d = len(model.gauges), press.dim
        rows = _ROWS[d] * foils
        share = min(rows / max(d * press.contact_points, 1.0), 1.0)
        return AddedCost(
            seconds=share * press.seconds["condensation"] + press.seconds["contact"] + _FOIL_S[d] * foils,
            memory_mb=40e-6 * rows**2,
            reason=f"{rows} more rows, and every step once more without the foils",
        )

    def mirrors(self, model: Model) -> frozenset[str]:
        """Return the symmetry planes of all foils together."""
        foils = [_geometry(gauge) for gauge in model.gauges]
        images = {
            "x": [replace(g, x_mm=-g.x_mm, angle=math.pi - g.angle) for g in model.gauges],
            "z": [replace(g, z_mm=-g.z_mm) for g in model.gauges],
        }
        return frozenset(
            axis for axis, image in images.items() if all(any(_coincide(_geometry(g), h) for h in foils) for g in image)
        )

    def discretise(self, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> EmbeddedBars:
        """Return the bars of all foils; bars that are mirror images of each other share a row.

        The meshed part has its share of the energy of all foils, those in a mirror image included.
        """
        copies = 2 ** len(axes)
        foils = [
            FoilPatches.of(g.middle, g.direction, g.length_mm, self.width_mm, *self.patches[mesh.dim - 2])
            for g in model.gauges
        ]
        bars: dict[tuple[float, ...], tuple[Float, sp.csr_matrix]] = {}
        numbers = np.concatenate([_insert(bars, foil, mesh, axes) for foil in foils])
        stiff = self.E_MPa * self.thickness_mm * np.concatenate([foil.area for foil in foils])
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
    materials, found = model.materials(mesh.part_labels), dict[int, str]()
    part = np.zeros(len(mesh.cells), dtype=np.int64) if mesh.part is None else mesh.part
    for gauge in model.gauges:
        for place in (gauge.middle, *gauge.ends):
            inside, _ = reflect_into_part(place, np.ones(3), axes, mesh.dim)
            for cell, _ in cells_at(mesh, inside):
                found.setdefault(int(part[cell]), gauge.name)
    if len(found) > 1:
        first, second = list(found.values())[:2]
        where = (
            f'gauge "{first}" crosses an interface' if first == second else f'gauges "{first}" and "{second}" do not'
        )
        raise Finger3dError(
            f"effects.embedded_gauge: all foils must lie in one part of the finger, and {where}; move them, or press "
            "with the foils of one part at a time"
        )
    return materials[next(iter(found), 0)].isotropic("effects.embedded_gauge")


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
    ends, known, numbers = foil.centres, {}, []
    order = {key: i for i, key in enumerate(bars)}

    def displacement(point: Float) -> sp.csr_matrix:
        if tuple(point) not in known:
            inside, signs = reflect_into_part(point, np.ones(3), axes, mesh.dim)
            known[tuple(point)] = displacement_rows(mesh, inside, signs)
        return known[tuple(point)]

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


def _geometry(gauge: Gauge) -> Float:
    """Return middle (mm), direction within half a turn, and length, which identify a foil."""
    return np.array([gauge.x_mm, gauge.y_mm, gauge.z_mm, gauge.angle % math.pi, gauge.length_mm])


def _coincide(a: Float, b: Float) -> bool:
    apart = np.abs(a - b)
    apart[3] = min(apart[3], math.pi - apart[3])
    return bool((apart <= _COINCIDENT).all())


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.embedded_gauge]: the foil of every [[gauge]].

    Attributes
    ----------
    E_MPa : Young's modulus along the foil
    thickness_mm, width_mm : its section
    """

    slot: ClassVar[str] = "inclusions"

    E_MPa: Modulus
    thickness_mm: Length
    width_mm: Length

    def apply(self, model: Model) -> Model:
        """Fill the slot of the inclusions; every gauge must be a foil inside the finger."""
        here = "effects.embedded_gauge"
        if not model.gauges:
            raise Finger3dError(f"{here}: the scene has no [[gauge]]; add one, or take the effect out")
        names = {gauge.name for gauge in model.gauges}
        for i, gauge in enumerate(model.gauges):
            if gauge.is_point:
                raise Finger3dError(f"gauge.{i}.length_mm = 0.0: must be above 0 with {here}: a foil has a length")
            if f"{gauge.name}_free" in names:
                raise Finger3dError(
                    f'gauge.name = "{gauge.name}_free": {here} gives this name to the free strain of "{gauge.name}"; '
                    "choose another"
                )
            room = 0.5 * model.design.width_mm - abs(gauge.z_mm)
            if 0.5 * self.width_mm > room:
                raise Finger3dError(
                    f'{here}.width_mm = {self.width_mm}: gauge "{gauge.name}" would stick out of the finger; '
                    f"must be at most {at_most(2.0 * room)} there"
                )
        if self.thickness_mm > model.mesh.size_mm:
            raise Finger3dError(
                f"{here}.thickness_mm = {self.thickness_mm}: thicker than an element; must be at most mesh.size_mm = "
                f"{model.mesh.size_mm}, or the mesh coarser"
            )
        return fill(model, "inclusions", Strips(self.E_MPa, self.thickness_mm, self.width_mm), "embedded_gauge")
