"""Rigid objects, analytic or triangulated, and their first contact with the finger."""

from finger3d.objects.first_contact import ContactPath, InitialContact, first_contact_height, initial_contact
from finger3d.objects.registry import OBJECTS
from finger3d.objects.shapes import Axis, Cylinder, Plane, RigidObject, Sphere, Wave, Wedge, vertical_frame
from finger3d.objects.slope import Slopes, slope_of
from finger3d.objects.triangulated import MeshObject

__all__ = [
    "OBJECTS",
    "Axis",
    "ContactPath",
    "Cylinder",
    "InitialContact",
    "MeshObject",
    "Plane",
    "RigidObject",
    "Slopes",
    "Sphere",
    "Wave",
    "Wedge",
    "first_contact_height",
    "initial_contact",
    "slope_of",
    "vertical_frame",
]
