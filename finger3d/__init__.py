"""Frictional contact of an elastic, finger-shaped tactile sensor in 3D.

Names are loaded when they are first used, so that ``import finger3d`` stays light. The main job is
``finger3d.press("scene.toml", "out")``; without a folder the files go with what it returns:

>>> import finger3d
>>> result = finger3d.press("scene.toml")
>>> result.summary()["outcome"]
'converged'

The designs make plain build123d solids, which any viewer shows and any CAD program takes:

>>> finger = finger3d.designs()["half_cylinder"](radius_mm=5.0, width_mm=2.0)
>>> solid = finger.solid()
>>> round(solid.volume, 2), type(solid).__name__
(78.54, 'Solid')
>>> import build123d
>>> build123d.export_step(solid, "finger.step")
True
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from finger3d._lazy import from_home

if TYPE_CHECKING:
    from finger3d.analyses.press import press
    from finger3d.analyses.reduced import Condensed
    from finger3d.analyses.result import PressResult
    from finger3d.contact.friction import Coulomb
    from finger3d.errors import Finger3dError, MissingError, Outcome
    from finger3d.fem.simplex import Mesh
    from finger3d.geometry.registry import designs
    from finger3d.mechanics.model import Gauge, Leg, Material, MeshOptions, Model
    from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
    from finger3d.scene import Scene, load, parse

    __version__: str

_HOME = {
    "Condensed": "analyses.reduced",
    "Coulomb": "contact.friction",
    "Cylinder": "objects",
    "Finger3dError": "errors",
    "Gauge": "mechanics.model",
    "Leg": "mechanics.model",
    "Material": "mechanics.model",
    "Mesh": "fem.simplex",
    "MeshOptions": "mechanics.model",
    "MissingError": "errors",
    "Model": "mechanics.model",
    "Outcome": "errors",
    "Plane": "objects",
    "PressResult": "analyses.result",
    "Scene": "scene",
    "Sphere": "objects",
    "Wave": "objects",
    "Wedge": "objects",
    "designs": "geometry.registry",
    "load": "scene",
    "parse": "scene",
    "press": "analyses.press",
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
    "PressResult",
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


_load = from_home(__name__, _HOME)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("finger3d")
    return _load(name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
