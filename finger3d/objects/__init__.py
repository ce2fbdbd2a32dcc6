"""Rigid objects: the shape of the surface that is pressed on the finger, analytic or triangulated; where it touches."""

from finger3d.objects.first_contact import Approach, approach, first_touch
from finger3d.objects.shapes import Axis, Cylinder, Plane, RigidObject, Sphere, Wave, Wedge, vertical_frame
from finger3d.objects.slope import Slopes, slope_of
from finger3d.objects.triangulated import MeshObject

__all__ = [
    "Approach",
    "Axis",
    "Cylinder",
    "MeshObject",
    "Plane",
    "RigidObject",
    "Slopes",
    "Sphere",
    "Wave",
    "Wedge",
    "approach",
    "first_touch",
    "slope_of",
    "vertical_frame",
]
