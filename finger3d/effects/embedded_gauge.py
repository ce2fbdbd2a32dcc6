"""The gauges' own stiffness: every gauge is a thin foil in the body, stiff along its length.

A foil of section thickness x width adds ``int E A eps(u) eps(v) ds`` to the body's stiffness, eps the strain along it.
It is a chain of bars whose ends follow the mesh's own displacements; each bar's strain is one more condensed row, and
its stiffness a spring on that row, so the body keeps its one factorisation (Woodbury).  In a solid the chain is laid
several times side by side over the foil's width along z (a line would sink into the body without end as the mesh is
refined); in a section the foil is spread over the finger's width.  The foil carries no bending and no shear, and takes
no room.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import scipy.sparse as sp
from annotated_types import Gt
from numpy.typing import NDArray

from finger3d.effects.base import fill
from finger3d.errors import Finger3dError
from finger3d.fem.surface import displacement_row, locate
from finger3d.mesh import EDGES, Mesh
from finger3d.model import Gauge, Model
from finger3d.problem import folded

Float = NDArray[np.float64]
Positive = Annotated[float, Gt(0)]

_BARS_PER_CELL = 2.0
_BARS = (4, 60)  # least and most along a foil
_LINES = (3, 15)  # and side by side
_SAME = 1e-9  # mm, and radians


@dataclass(frozen=True)
class Strips:
    """Foils along the gauges of a model: Young's modulus (MPa) and section (mm)."""

    E_MPa: float
    thickness_mm: float
    width_mm: float

    def mirrors(self, model: Model) -> frozenset[str]:
        """Planes about which the foils, all together, are mirror images."""
        places = [_place(gauge) for gauge in model.gauges]
        images = {
            "x": [replace(g, x_mm=-g.x_mm, angle=math.pi - g.angle) for g in model.gauges],
            "z": [replace(g, z_mm=-g.z_mm) for g in model.gauges],
        }
        return frozenset(
            axis for axis, seen in images.items() if all(any(_same(_place(g), p) for p in places) for g in seen)
        )

    def rows(self, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> tuple[sp.csr_matrix, Float]:
        """Rows (s, n d) that read the bars' strains, and their stiffness (s,) N mm in the meshed part.

        The part has its share of the foils' energy: all of them count, read from the part where they lie in an image.
        """
        bars: dict[tuple[float, ...], tuple[sp.csr_matrix, float]] = {}
        for gauge in model.gauges:
            along, lines = self._counts(gauge, mesh, axes)
            cuts = np.linspace(0.0, 1.0, along + 1)[:, None]
            stiff = self.E_MPa * self.thickness_mm * self.width_mm / lines * gauge.length_mm / along / 2 ** len(axes)
            for start, end in self._lines(gauge, lines):
                nodes = start + cuts * (end - start)
                for a, b in zip(nodes[:-1], nodes[1:], strict=True):
                    images = sorted((folded(p, gauge.direction, axes, mesh.dim)[0] for p in (a, b)), key=tuple)
                    key = tuple(np.round(np.concatenate(images), 9) + 0.0)
                    row, before = bars[key] if key in bars else (_strain_between(mesh, a, b, axes), 0.0)
                    bars[key] = (row, before + stiff)
        return sp.vstack([row for row, _ in bars.values()], format="csr"), np.array([s for _, s in bars.values()])

    def reads(self, model: Model, mesh: Mesh, axes: tuple[str, ...]) -> list[sp.csr_matrix]:
        """Mean strain over every foil, its width included."""
        out = []
        for gauge in model.gauges:
            ends = self._lines(gauge, self._counts(gauge, mesh, axes)[1])
            out.append(sp.csr_matrix(sum(_strain_between(mesh, a, b, axes) for a, b in ends) / len(ends)))
        return out

    def _counts(self, gauge: Gauge, mesh: Mesh, axes: tuple[str, ...]) -> tuple[int, int]:
        """Bars along a foil, and side by side."""
        size = _cell_size(mesh, gauge, axes)
        along = int(np.clip(math.ceil(_BARS_PER_CELL * gauge.length_mm / size), *_BARS))
        lines = int(np.clip(math.ceil(_BARS_PER_CELL * self.width_mm / size), *_LINES)) if mesh.dim == 3 else 1
        return along, lines

    def _lines(self, gauge: Gauge, count: int) -> list[tuple[Float, Float]]:
        """Ends (3,) mm of the lines side by side that stand for a foil."""
        aside = (np.arange(count) - 0.5 * (count - 1)) * self.width_mm / count
        start, end = gauge.ends
        return [(start + [0.0, 0.0, z], end + [0.0, 0.0, z]) for z in aside]


def _strain_between(mesh: Mesh, start: Float, end: Float, axes: tuple[str, ...]) -> sp.csr_matrix:
    """Row (1, n d) of the mean strain along the line between two places (3,) of the whole finger."""
    length = float(np.linalg.norm(end - start))
    near, far = (displacement_row(mesh, *folded(p, (end - start) / length, axes, mesh.dim)) for p in (start, end))
    return sp.csr_matrix((far - near) / length)


def _place(gauge: Gauge) -> Float:
    """Middle (mm), direction within half a turn, and length: what tells foils apart."""
    return np.array([gauge.x_mm, gauge.y_mm, gauge.z_mm, gauge.angle % math.pi, gauge.length_mm])


def _same(a: Float, b: Float) -> bool:
    apart = np.abs(a - b)
    apart[3] = min(apart[3], math.pi - apart[3])
    return bool((apart <= _SAME).all())


def _cell_size(mesh: Mesh, gauge: Gauge, axes: tuple[str, ...]) -> float:
    """Mean edge length (mm) of the cell that holds a gauge's middle, or the image of it."""
    found = locate(mesh, folded(gauge.middle, gauge.direction, axes, mesh.dim)[0])
    if not found:
        raise Finger3dError(f"gauge {gauge.name!r} lies outside the body; move it inward")
    ends = mesh.points[mesh.cells[found[0][0]]][EDGES[mesh.dim]]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())


@dataclass(frozen=True)
class Effect:
    """Settings of [effects.embedded_gauge]: the foil of every [[gauge]].

    Attributes
    ----------
    E_MPa : Young's modulus along the foil
    thickness_mm, width_mm : its section
    """

    E_MPa: Positive
    thickness_mm: Positive
    width_mm: Positive

    def apply(self, model: Model) -> Model:
        """Fill the inclusions slot; every gauge must be a foil that fits."""
        here = "effects.embedded_gauge"
        if not model.gauges:
            raise Finger3dError(f"{here}: the scene has no [[gauge]]; add one, or take the effect out")
        names = {gauge.name for gauge in model.gauges}
        for i, gauge in enumerate(model.gauges):
            if gauge.length_mm == 0.0:
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
                    f"must be at most {2.0 * room:.6g} there"
                )
        if self.thickness_mm > model.mesh.size_mm:
            raise Finger3dError(
                f"{here}.thickness_mm = {self.thickness_mm}: thicker than an element; must be at most mesh.size_mm = "
                f"{model.mesh.size_mm}, or the mesh coarser"
            )
        return fill(model, "inclusions", Strips(self.E_MPa, self.thickness_mm, self.width_mm), "embedded_gauge")
