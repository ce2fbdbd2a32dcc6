"""Meshes that move with the dimensions of a design: their surfaces, volumes and parts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from finger3d.contact.friction import Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.mesh.quality import curved_volume
from finger3d.fem.mesh.simplex import Mesh
from finger3d.geometry.registry import designs
from finger3d.mechanics.discretise.build import build, mesh_part
from finger3d.mechanics.discretise.moved_mesh import stretched
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.mechanics.readings.gauges import Gauge
from finger3d.objects import Plane

CLIPPED = designs()["clipped_cylinder"](radius_mm=6.0, half_length_mm=4.0, edge_height_mm=2.0, width_mm=4.0)
FINGERTIP = designs()["fingertip"](
    radius_mm=6.0, half_length_mm=4.0, edge_height_mm=3.0, width_mm=4.0, skin_mm=1.0, core_half_length_mm=1.5,
    core_height_mm=1.2,
)  # fmt: skip
PARTS = (("skin", Isotropic(2.0, 0.3)), ("core", Isotropic(5.0, 0.3)))
SLIDE = (Leg(0.3, steps=2), Leg(0.3, slide_x_mm=0.05, steps=2))
UNSTRUCTURED = Model(
    CLIPPED, Isotropic(1.0, 0.3), MeshOptions(1.0, 1.6, "ftetwild"), SLIDE, object=Plane(tilt=0.03), symmetry=(),
    friction=Coulomb(0.3), gauges=(Gauge("g", 0.7, 2.1, 0.2, 0.5),),
)  # fmt: skip


def with_dimension(model: Model, name: str, change: float) -> Model:
    return replace(model, design=replace(model.design, **{name: getattr(model.design, name) + change}))


@pytest.mark.parametrize(
    "design", [CLIPPED, designs()["hemisphere"](radius_mm=4.0), FINGERTIP], ids=lambda design: design.name
)
def test_an_unstructured_mesh_stretches_with_the_dimensions(design: Any) -> None:
    model = replace(UNSTRUCTURED, design=design, parts=PARTS if design.part_labels else ())
    mesh = build(model).mesh
    for name in design.dimensions:
        ends = [stretched(mesh, design, with_dimension(model, name, t).design) for t in (-1e-4, 1e-4)]
        growth = (curved_volume(ends[1]) - curved_volume(ends[0])) / curved_volume(mesh)
        wanted = [with_dimension(model, name, t).design.volume_mm3 / design.volume_mm3 for t in (-1e-4, 1e-4)]
        assert growth == pytest.approx(wanted[1] - wanted[0], rel=0.05, abs=1e-9), name  # facets cut off the round


@pytest.mark.parametrize("name", CLIPPED.dimensions)
def test_a_stretched_mesh_is_that_of_the_other_design(name: str) -> None:
    problem = build(replace(UNSTRUCTURED, mesh=MeshOptions(0.8, 1.2, "swept")))
    other = with_dimension(problem.model, name, 0.1).design
    mesh = stretched(problem.mesh, CLIPPED, other)
    x, y, z = mesh.points[np.unique(mesh.facets["contact"])].T
    assert y == pytest.approx(other.top(x, z), abs=1e-8)
    corner = [other.half_length_mm, other.height_mm, 0.5 * other.width_mm]
    assert np.abs(mesh.points).max(axis=0) == pytest.approx(corner, rel=1e-6)
    assert curved_volume(mesh) == pytest.approx(other.volume_mm3, rel=1e-4)


@pytest.mark.parametrize("name", FINGERTIP.dimensions)
def test_parts_follow_the_section_of_a_body(name: str) -> None:
    model = replace(UNSTRUCTURED, design=FINGERTIP, parts=PARTS, mesh=MeshOptions(0.8, 1.2, "swept"))
    other = with_dimension(model, name, 1e-4)
    before, wanted = (mesh_part(one, model.first_contact.contact_box, ())[0] for one in (model, other))
    found = stretched(before, FINGERTIP, other.design)

    def volume(mesh: Mesh, part: int) -> float:
        return curved_volume(replace(mesh, cells=mesh.cells[mesh.part == part], part=None, part_labels=()))

    def changes(after: Mesh) -> list[float]:
        return [volume(after, part) / volume(before, part) - 1.0 for part in range(3)]

    # the arcs of the swept mesh are less fine than those of the section
    assert changes(found) == pytest.approx(changes(wanted), rel=1e-3, abs=1e-9)
