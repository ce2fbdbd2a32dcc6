"""Advice on the edge length of the mesh, which is given only where such a mesh fits into memory."""

from __future__ import annotations

import math
from dataclasses import replace

from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import Model
from finger3d.meshing.generate import is_meshable


def is_meshable_at(model: Model, size: float) -> bool:
    """Return whether a mesh with an edge length (mm) in the contact zone is estimated to fit into memory."""
    options = replace(model.mesh, size_mm=size, base_size_mm=max(size, model.mesh.base_size_mm))
    dim, zone = 3 if model.domain == "solid" else 2, model.first_contact.contact_box
    return is_meshable(model.design, options, zone, dim, symmetry(model))


def size_advice(model: Model, size: float, effect: str, otherwise: str) -> str:
    """Return the advice of an edge length (mm) and its effect, or of something else where memory holds no such mesh."""
    if is_meshable_at(model, size):
        return f"mesh.size_mm = {size:.2g} {effect}"
    return f"no mesh that fits into this machine's memory {effect}; {otherwise}"


def rounded_down(size: float) -> float:
    """Return an edge length rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1.0 + 1e-12)) * unit:.2g}")
