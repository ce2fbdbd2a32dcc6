"""Check of the arrays of a reduced model that was read from a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def check_arrays(arrays: Mapping[str, Any], d: int, gauges: int) -> None:
    """Raise ValueError or KeyError unless types and shapes of all arrays fit together, and numbers are finite."""
    c, p = len(arrays["face_nodes"]), len(arrays["nodes"])
    wanted: dict[str, tuple[int, ...]] = {
        "compliance": (c * d, c * d), "gauge_rows": (gauges, c * d), "parent": (p,), "sign": (p, d), "share": (p,),
        "nodes": (p,), "points": (p, 3), "area": (p,), "band": (2,),
    }  # fmt: skip
    if "bare_compliance" in arrays:
        wanted |= {"bare_compliance": (c * d, c * d), "bare_gauge_rows": (gauges, c * d)}
    for face in ("face", "other"):
        m, samples, entries = (len(arrays[f"{face}_{name}"]) for name in ("nodes", "samples", "mean"))
        wanted |= {
            f"{face}_nodes": (m,), f"{face}_points": (m, d), f"{face}_area": (m,), f"{face}_samples": (samples, d),
            f"{face}_mean": (entries,), f"{face}_mean_at": (entries,), f"{face}_mean_rows": (m + 1,),
        }  # fmt: skip
    if not c:
        raise ValueError("no contact points")
    whole = ("nodes", "parent", "mean_at", "mean_rows")
    for name, shape in wanted.items():
        values = arrays[name]
        kinds = "iu" if name.endswith(whole) else "f"
        if values.shape != shape or values.dtype.kind not in kinds:
            raise ValueError(f"{name} does not fit")
    for name, values in arrays.items():
        if values.dtype.kind not in "iufb" or not np.isfinite(values).all():
            raise ValueError(f"{name} holds other things than finite numbers")
    if not ((arrays["parent"] >= 0) & (arrays["parent"] < c)).all():
        raise ValueError("parent is out of range")
    edges = arrays["edges"]
    if edges.ndim != 2 or edges.shape[1] != 2 or edges.dtype.kind not in "iu" or not ((edges >= 0) & (edges < p)).all():
        raise ValueError("edges do not fit")
    faces = arrays.get("object_faces", np.zeros(0))
    if faces.size and not 0 <= faces.min() <= faces.max() < len(arrays["object_points"]):
        raise ValueError("object_faces is out of range")
