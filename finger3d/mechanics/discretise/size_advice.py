"""Advice on the edge length of the mesh, which is given only where such a mesh fits into memory."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from finger3d.mechanics.discretise.contact_geometry import MARGIN
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.model import Model
from finger3d.mechanics.path import targets
from finger3d.meshing.generate import is_meshable
from finger3d.objects import PlacedObject

_LATTICE, _STATIONS = 100, 4
"""Places along each side of the finger at which the object is looked for, and poses along each leg."""


def is_meshable_at(model: Model, size: float) -> bool:
    """Return whether a press with an edge length (mm) in the contact zone is estimated to fit into memory."""
    options = replace(model.mesh, size_mm=size, base_size_mm=max(size, model.mesh.base_size_mm))
    dim, zone, axes = 3 if model.domain == "solid" else 2, model.first_contact.contact_box, symmetry(model)
    extents = [2.0 * model.design.half_length_mm, model.design.width_mm][: dim - 1]
    rows = dim * _candidate_share(model) * math.prod(extent / size for extent in extents) / 2 ** len(axes)
    return is_meshable(model.design, options, zone, dim, axes, rows)


def _candidate_share(model: Model) -> float:
    """Return the share of the finger's plan that comes near the object, where contact points are candidates."""
    width, line = model.design.width_mm * (model.domain == "solid"), np.linspace(-0.5, 0.5, _LATTICE)
    x, z = np.reshape(np.meshgrid(2.0 * model.design.half_length_mm * line, width * line), (2, -1))
    y, path = model.design.top(x, z), targets(tuple(replace(leg, steps=_STATIONS) for leg in model.legs))
    placed = (PlacedObject.of(model.object, model.first_contact.first_contact_mm, pose) for pose in path)
    near = np.any([obj.overlap(x, y, z) > -MARGIN * model.largest_depth_mm for obj in placed], axis=0)
    return float(near.mean())


def size_advice(model: Model, size: float, effect: str, otherwise: str) -> str:
    """Return the advice of an edge length (mm), rounded down, and its effect, or of something else without memory."""
    size = rounded_down(size)
    if is_meshable_at(model, size):
        return f"mesh.size_mm = {size:g} {effect}"
    return f"no mesh.size_mm whose press fits into this machine's memory {effect}; {otherwise}"


def rounded_down(size: float) -> float:
    """Return a length rounded down to two digits."""
    unit = 10.0 ** (math.floor(math.log10(size)) - 1)
    return float(f"{math.floor(size / unit * (1.0 + 1e-12)) * unit:.2g}")
