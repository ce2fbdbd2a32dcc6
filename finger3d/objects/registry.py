"""The objects that a scene's ``[object]`` table may name, by shape. A new object is one more entry."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from finger3d.objects.rigid import RigidObject
from finger3d.objects.shapes import Cylinder, Plane, Sphere, Wedge
from finger3d.objects.triangulated import ObjectFile
from finger3d.objects.wave import Wave

OBJECTS: Mapping[str, type[RigidObject]] = MappingProxyType(
    {"plane": Plane, "cylinder": Cylinder, "sphere": Sphere, "wedge": Wedge, "wave": Wave, "mesh": ObjectFile}
)
