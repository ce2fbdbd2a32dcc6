"""Elastic laws of bodies that consist of several parts, one law in each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from finger3d._types import Float, Int, freeze_arrays
from finger3d.fem.laws.material import Elasticity, Isotropic
from finger3d.fem.mesh.simplex import Mesh


def elasticity_of(materials: Sequence[Isotropic], mesh: Mesh, plane_stress: bool) -> LinearElasticity:
    """Return the small-strain law of a body.

    Parameters
    ----------
    materials : of the parts by their number, the main body first
    mesh : whose cells know their parts

    Notes
    -----
    All parts take the mixed form if one of them is nearly incompressible. Their pressures are discontinuous at
    interfaces.
    """
    if mesh.part is None:
        return materials[0].elasticity(plane_stress)
    mixed = not plane_stress and any(material.is_nearly_incompressible for material in materials)
    return ElasticityByPart(tuple(m.elasticity(plane_stress, mixed) for m in materials), mesh.part)


def moduli_of(elastic: LinearElasticity) -> tuple[float, ...]:
    """Return the shear modulus of each part by its number, MPa."""
    laws = elastic.laws if isinstance(elastic, ElasticityByPart) else (elastic,)
    return tuple(law.shear for law in laws)


def contact_compliance(elastic: LinearElasticity, mesh: Mesh) -> Float:
    """Return the contact compliance ``1 / E*``, 1/MPa, at the nodes (n,) of a mesh, the mean over the cells around it.

    With Lame's constants l and G it is ``(l + 2 G) / (4 G (l + G))``: ``(1 - nu^2) / E``, or ``1 / E`` in plane stress.
    """
    shear = np.array(moduli_of(elastic))[elastic.part if isinstance(elastic, ElasticityByPart) else 0]
    lame = elastic.lame
    of_cell = np.broadcast_to((lame + 2.0 * shear) / (4.0 * shear * (lame + shear)), len(mesh.cells))
    nodes, each = mesh.cells.ravel(), mesh.cells.shape[1]
    count = np.bincount(nodes, minlength=len(mesh.points))
    total = np.bincount(nodes, np.repeat(of_cell, each), len(mesh.points))
    return np.asarray(total / np.maximum(count, 1))


@dataclass(frozen=True)
class ElasticityByPart:
    """Linear elastic laws of a body of several parts; see `finger3d.fem.laws.material.Elasticity`.

    Attributes
    ----------
    laws : of the parts by their number, all in the same form
    part : (e,) number of the part of each cell
    """

    laws: tuple[Elasticity, ...]
    part: Int

    def __post_init__(self) -> None:
        freeze_arrays(self)

    @property
    def mixed(self) -> bool:
        """Whether the pressure is an unknown of its own."""
        return self.laws[0].mixed

    @property
    def shear(self) -> float:
        """Shear modulus of the main body, MPa, by which pressures are scaled."""
        return self.laws[0].shear

    @property
    def lame(self) -> Float:
        """Lame's first constant in each cell (e,), MPa."""
        return np.array([law.lame for law in self.laws])[self.part]

    def of_cells(self, cells: slice | Int) -> LinearElasticity:
        """Return the law of some cells, that of their part if they belong to one."""
        part = self.part[cells]
        return self.laws[part[0]] if len(part) and (part == part[0]).all() else ElasticityByPart(self.laws, part)

    def contract(self, outer: Float) -> Float:
        """Return the element matrices of all cells; see `finger3d.fem.laws.material.Elasticity.contract`."""
        return _by_part(self.part, lambda number, values: self.laws[number].contract(values), outer)

    def stress(self, strain: Float) -> Float:
        """Return the stress (e k, d, d), MPa, of k strains in each cell."""
        part = np.repeat(self.part, len(strain) // max(len(self.part), 1))
        return _by_part(part, lambda number, values: self.laws[number].stress(values), strain)


LinearElasticity: TypeAlias = Elasticity | ElasticityByPart
"""Linear elastic law of a body."""


def _by_part(part: Int, function: Callable[[int, Float], Float], values: Float) -> Float:
    """Return a function of part and values (k, ...), of the shape of the values, applied part by part."""
    out = np.empty_like(values)
    for number in np.unique(part):
        in_part = part == number
        out[in_part] = function(int(number), values[in_part])
    return out
