"""Rigid objects, analytic or triangulated, and their first contact with the finger."""

from finger3d.objects.first_contact import ContactPath, InitialContact, first_contact_height, initial_contact
from finger3d.objects.held import HeldBody
from finger3d.objects.placed import PlacedObject
from finger3d.objects.pose import Move, ObjectPose
from finger3d.objects.registry import OBJECTS
from finger3d.objects.rigid import Axis, RigidObject, vertical_frame
from finger3d.objects.shapes import Cylinder, Plane, Sphere, Wedge
from finger3d.objects.tracking import DistanceTracker
from finger3d.objects.triangulated import MeshObject
from finger3d.objects.wave import Wave

__all__ = [
    "OBJECTS",
    "Axis",
    "ContactPath",
    "Cylinder",
    "DistanceTracker",
    "HeldBody",
    "InitialContact",
    "MeshObject",
    "Move",
    "ObjectPose",
    "PlacedObject",
    "Plane",
    "RigidObject",
    "Sphere",
    "Wave",
    "Wedge",
    "first_contact_height",
    "initial_contact",
    "vertical_frame",
]
