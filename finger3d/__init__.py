"""Frictional contact of an elastic, finger-shaped tactile sensor in 3D.

Names are loaded when they are first used, so that ``import finger3d`` stays light. The main job is
``finger3d.press("scene.toml", "out")``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from finger3d.contact.law import Coulomb
    from finger3d.design import designs
    from finger3d.errors import Finger3dError, MissingError, Outcome
    from finger3d.job import press
    from finger3d.mesh import Mesh
    from finger3d.model import Gauge, Leg, Material, MeshOptions, Model
    from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
    from finger3d.reduced import Condensed
    from finger3d.scene import Scene, load, parse

    __version__: str

_HOME = {
    "Condensed": "reduced",
    "Coulomb": "contact.law",
    "Cylinder": "objects",
    "Finger3dError": "errors",
    "Gauge": "model",
    "Leg": "model",
    "Material": "model",
    "Mesh": "mesh",
    "MeshOptions": "model",
    "MissingError": "errors",
    "Model": "model",
    "Outcome": "errors",
    "Plane": "objects",
    "Scene": "scene",
    "Sphere": "objects",
    "Wave": "objects",
    "Wedge": "objects",
    "designs": "design",
    "load": "scene",
    "parse": "scene",
    "press": "job",
}

__all__ = [
    "Condensed",
    "Coulomb",
    "Cylinder",
    "Finger3dError",
    "Gauge",
    "Leg",
    "Material",
    "Mesh",
    "MeshOptions",
    "MissingError",
    "Model",
    "Outcome",
    "Plane",
    "Scene",
    "Sphere",
    "Wave",
    "Wedge",
    "__version__",
    "designs",
    "load",
    "parse",
    "press",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("finger3d")
    if name in _HOME:
        return getattr(importlib.import_module(f"finger3d.{_HOME[name]}"), name)
    raise AttributeError(f"module 'finger3d' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
