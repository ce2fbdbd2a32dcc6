"""Rigid objects as elements: facets on the surface, all of them positive, the face on the outside first."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.analyses.calculix.objects import MOST_FACETS, object_elements
from finger3d.objects import Cylinder, MeshObject, ObjectPose, PlacedObject, Plane, RigidObject, Sphere, Wave, Wedge
from tests.bodies import ball, box
from tests.given_meshes import refused

LOW, HIGH = np.array([-10.0, 0.0, -4.0]), np.array([10.0, 8.0, 4.0])
SAGITTA = 2e-3
POSES = (ObjectPose(0.0), ObjectPose(1.0), ObjectPose(1.0, slide_x_mm=0.5, turn_z=0.2))
OBJECTS = [
    Plane(tilt=0.1),
    Cylinder(radius_mm=6.0),
    Cylinder(radius_mm=6.0, axis="x", x_mm=1.0),
    Sphere(radius_mm=6.0, z_mm=1.0),
    Wedge(angle=0.4, tip_radius_mm=1.0),
    Wedge(angle=0.4),
    Wave(wavelength_mm=5.0, amplitude_mm=0.5),
    MeshObject(surface=box(4.0, 4.0, 4.0)),
]


def placed(obj: RigidObject) -> list[PlacedObject]:
    return [PlacedObject.of(obj, 8.0, pose) for pose in POSES]


@pytest.mark.parametrize("obj", OBJECTS, ids=lambda o: type(o).__name__)
def test_facets_lie_on_the_surface_and_elements_behind_it(obj: RigidObject) -> None:
    poses = placed(obj)
    made, motion = object_elements(poses, LOW - 2.0, HIGH + 2.0, SAGITTA, 3)
    width = 3 if made.kind == "C3D4" else 4
    corners = made.nodes[made.elements]
    face = corners[:, :width]
    exact = isinstance(obj, MeshObject)  # whose triangles are the surface
    np.testing.assert_allclose(poses[0].distance(face.reshape(-1, 3))[0], 0.0, atol=1e-9)
    away = np.abs(poses[0].distance(face.mean(axis=1))[0]).max()
    assert away <= (1e-9 if exact else 1.01 * SAGITTA)
    normal = np.cross(face[:, 1] - face[:, 0], face[:, -1] - face[:, 0])
    behind = corners[:, width:].mean(axis=1) - face.mean(axis=1)
    assert (np.einsum("ij,ij->i", normal, behind) > 0.0).all()  # the order that makes the volume positive
    assert (poses[0].distance(face.mean(axis=1) + 0.05 * behind)[0] < 0.0).all()
    for pose, moved in zip(poses, motion, strict=True):
        np.testing.assert_allclose(pose.to_own(made.nodes + moved), poses[0].to_own(made.nodes), atol=1e-9)


@pytest.mark.parametrize("obj", OBJECTS[:-1], ids=lambda o: type(o).__name__)
def test_segments_of_a_section(obj: RigidObject) -> None:
    pose = PlacedObject.of(obj, 8.0)
    made, _ = object_elements([pose], LOW - 2.0, HIGH + 2.0, SAGITTA, 2)
    assert made.kind == "CPE4"
    a, b, c, d = np.moveaxis(made.nodes[made.elements][..., :2], 1, 0)
    for p, q, r in ((a, b, c), (b, c, d), (c, d, a)):
        assert ((q - p)[:, 0] * (r - p)[:, 1] - (q - p)[:, 1] * (r - p)[:, 0] > 0.0).all()
    if isinstance(obj, Cylinder | Sphere) and getattr(obj, "axis", "z") == "z":
        np.testing.assert_allclose(np.linalg.norm(a - [obj.x_mm, 14.0], axis=1), 6.0, rtol=1e-9)


def test_facets_far_from_the_finger_are_left_out() -> None:
    many = MeshObject(surface=ball(300.0, 80, 160))
    made, _ = object_elements([PlacedObject.of(many, 8.0)], LOW - 2.0, HIGH + 2.0, SAGITTA, 3)
    assert 0 < len(made.elements) < 0.1 * len(many.triangles.faces)
    assert "model.domain" in refused(lambda: object_elements([PlacedObject.of(many, 8.0)], LOW, HIGH, SAGITTA, 2))
    fine = MeshObject(surface=ball(5.0, 75, 150))
    line = refused(lambda: object_elements([PlacedObject.of(fine, 8.0)], LOW - 99.0, HIGH + 99.0, SAGITTA, 3))
    assert f" {len(fine.triangles.faces)} facets " in line
    assert f" {MOST_FACETS}: " in line
