"""The options that the meshers read."""

from __future__ import annotations

from typing import Literal, Protocol

Mesher = Literal["ftetwild", "netgen", "swept"]
"""Unstructured tetrahedra by fTetWild or netgen, or tetrahedra swept along z."""

Zone = tuple[float, float, float, float]
"""x_min, x_max, z_min, z_max in mm: where contact is predicted."""


class MeshSizes(Protocol):
    """Edge lengths of a mesh, and the mesher of solids."""

    @property
    def size_mm(self) -> float:
        """Edge length in the contact zone."""

    @property
    def base_size_mm(self) -> float:
        """Edge length far from the contact zone."""

    @property
    def mesher(self) -> Mesher:
        """Mesher of solids."""

    @property
    def layers(self) -> int:
        """Least number of layers of a swept mesh over half the width."""
