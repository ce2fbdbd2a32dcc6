"""Frictional contact of an elastic, finger-shaped tactile sensor in 3D.

The commands that compute are functions, too: `press`, `compare`, `calibrate`, `estimate`, `identify`, `sweep`,
`optimise`, `place_gauges` (``optimise --gauges``), `export` and `plan`. Names are loaded when they are
first used, so that ``import finger3d`` is quick.

>>> import finger3d
>>> result = finger3d.press("scene.toml")
>>> result.last.outcome
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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from finger3d._api import export, identify, optimise, place_gauges, plan, sweep
    from finger3d.analyses.calibrate.run import calibrate
    from finger3d.analyses.compare.run import compare
    from finger3d.analyses.press import press
    from finger3d.analyses.reduced import ReducedModel
    from finger3d.analyses.result import PressResult
    from finger3d.contact.friction import Coulomb
    from finger3d.errors import Finger3dError, MissingError, Outcome
    from finger3d.fem.material import Isotropic
    from finger3d.fem.simplex import Mesh
    from finger3d.geometry.registry import designs
    from finger3d.mechanics.gauges import Gauge
    from finger3d.mechanics.model import Leg, MeshOptions, Model
    from finger3d.mold.options import MoldOptions
    from finger3d.objects import Cylinder, Plane, Sphere, Wave, Wedge
    from finger3d.scene import Scene, load, parse
    from finger3d.sensor import estimate

    __version__: str

_HOME = {
    "ReducedModel": "analyses.reduced",
    "Coulomb": "contact.friction",
    "Cylinder": "objects",
    "Finger3dError": "errors",
    "Gauge": "mechanics.model",
    "Leg": "mechanics.model",
    "Isotropic": "fem.material",
    "Mesh": "fem.simplex",
    "MeshOptions": "mechanics.model",
    "MissingError": "errors",
    "Model": "mechanics.model",
    "MoldOptions": "mold.options",
    "Outcome": "errors",
    "Plane": "objects",
    "PressResult": "analyses.result",
    "Scene": "scene",
    "Sphere": "objects",
    "Wave": "objects",
    "Wedge": "objects",
    "calibrate": "analyses.calibrate.run",
    "compare": "analyses.compare.run",
    "designs": "geometry.registry",
    "estimate": "sensor",
    "export": "_api",
    "identify": "_api",
    "load": "scene",
    "optimise": "_api",
    "parse": "scene",
    "place_gauges": "_api",
    "plan": "_api",
    "press": "analyses.press",
    "sweep": "_api",
}
"""Module of each public name."""

__all__ = [
    "ReducedModel",
    "Coulomb",
    "Cylinder",
    "Finger3dError",
    "Gauge",
    "Leg",
    "Isotropic",
    "Mesh",
    "MeshOptions",
    "MissingError",
    "Model",
    "MoldOptions",
    "Outcome",
    "Plane",
    "PressResult",
    "Scene",
    "Sphere",
    "Wave",
    "Wedge",
    "__version__",
    "calibrate",
    "compare",
    "designs",
    "estimate",
    "export",
    "identify",
    "load",
    "optimise",
    "parse",
    "place_gauges",
    "plan",
    "press",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("finger3d")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
