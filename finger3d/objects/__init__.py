"""Rigid objects, analytic or triangulated, and their first contact with the finger."""

from collections.abc import Mapping
from types import MappingProxyType

from finger3d.objects.first_contact import ContactPath, FirstTouch, InitialContact, first_touch, initial_contact
from finger3d.objects.placed import TIME, DistanceTracker, Move, ObjectPose, PlacedObject, SecondFinger
from finger3d.objects.rigid import Axis, HeldBody, RigidObject, vertical_frame
from finger3d.objects.shapes import Box, Cylinder, Plane, Sphere, Wave, Wedge
from finger3d.objects.triangulated import MeshObject, ObjectFile

OBJECTS: Mapping[str, type[RigidObject]] = MappingProxyType(
    {
        "plane": Plane,
        "cylinder": Cylinder,
        "box": Box,
        "sphere": Sphere,
        "wedge": Wedge,
        "wave": Wave,
        "mesh": ObjectFile,
    }
)
"""The objects that a scene's ``[object]`` table may name, by shape. A new object is one more entry."""

__all__ = [
    "OBJECTS",
    "TIME",
    "Axis",
    "Box",
    "ContactPath",
    "Cylinder",
    "DistanceTracker",
    "FirstTouch",
    "HeldBody",
    "InitialContact",
    "MeshObject",
    "Move",
    "ObjectPose",
    "PlacedObject",
    "Plane",
    "RigidObject",
    "SecondFinger",
    "Sphere",
    "Wave",
    "Wedge",
    "first_touch",
    "initial_contact",
    "vertical_frame",
]
