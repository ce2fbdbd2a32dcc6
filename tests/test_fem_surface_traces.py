"""Displacements and strains as rows of the unknowns, and fields of one mesh at the surface of another."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.fem.mesh.simplex import Mesh, quadratic, reflected, signed_volumes
from finger3d.fem.surface.traces import displacement_row, facing_trace, strain_row, surface, values_over
from finger3d.geometry.registry import designs
from finger3d.mechanics.model import MeshOptions
from finger3d.meshing.generate import mesh_solid
from finger3d.meshing.structured.swept import mesh_section
from tests.meshes import grid


@pytest.mark.parametrize("dim", [2, 3])
def test_traces_and_strains_read_a_linear_field_exactly(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))
    slope = np.random.default_rng(1).normal(size=(dim, dim))
    u = mesh.points @ slope.T
    top = surface(mesh, "y+", thickness=2.0)
    assert top.area.sum() == pytest.approx(2.0, rel=1e-13)
    centre = top.average @ top.samples  # the hat's centre of gravity, where a weighted mean of a linear field is read
    assert np.abs(top.trace @ u - centre @ slope.T).max() < 1e-13
    direction = np.eye(dim)[0] * 0.6 + np.eye(dim)[1] * 0.8
    point = np.full(dim, 1 / 3)  # on a shared facet
    assert (strain_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ direction, abs=1e-12
    )
    assert (displacement_row(mesh, point, direction) @ u.ravel())[0] == pytest.approx(
        direction @ slope @ point, abs=1e-12
    )


DESIGNS = designs()


def faced(dim: int) -> tuple[Mesh, Mesh]:
    """A block's mesh, and another, finer one of a round body upside down over it."""
    block = DESIGNS["block"](half_length_mm=3.0, height_mm=2.0, width_mm=4.0)
    round_ = DESIGNS["half_cylinder"](radius_mm=5.0, width_mm=4.0)
    make = mesh_solid if dim == 3 else mesh_section
    below = make(block, MeshOptions(0.7, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    above = make(round_, MeshOptions(0.45, 1.0, "swept"), (-1.0, 1.0, -2.0, 2.0))[0]
    return below, reflected(above, 1)


@pytest.mark.parametrize("dim", [2, 3])
def test_fields_are_read_over_the_points_though_meshes_do_not_match(dim: int) -> None:
    below, above = faced(dim)
    assert (signed_volumes(above) > 0.0).all()
    face = surface(below, "contact")
    values, there = values_over(above, above.facets["contact"], face.samples)
    assert there.all()
    across = [0] if dim == 2 else [0, 2]
    # the place itself, curved facets included, and a linear field
    np.testing.assert_allclose(values @ above.points[:, across], face.samples[:, across], atol=1e-10)
    height = values @ above.points[:, 1]
    np.testing.assert_allclose(height, -np.sqrt(25.0 - face.samples[:, 0] ** 2), atol=1e-4)
    trace = facing_trace(face, above, "contact")
    assert np.abs(trace @ np.ones(len(above.points)) - 1.0).max() < 1e-12


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_reach_the_object_undiminished(dim: int) -> None:
    below, above = faced(dim)
    face = surface(below, "contact")
    trace = facing_trace(face, above, "contact")
    force = np.random.default_rng(0).normal(size=(len(face.nodes), dim))
    reached = trace.T @ force
    assert np.abs(reached.sum(axis=0) - force.sum(axis=0)).max() < 1e-10 * np.abs(force).sum()
    # and their moment, as far as samples stand for the hats
    across = np.cross(face.points, force) if dim == 3 else face.points[:, 0] * force[:, 1]
    moment = np.cross(above.points * [1, 0, 1], reached * [0, 1, 0]) if dim == 3 else above.points[:, 0] * reached[:, 1]
    samples = face.average @ face.samples
    wanted = np.cross(samples * [1, 0, 1], force * [0, 1, 0]) if dim == 3 else samples[:, 0] * force[:, 1]
    assert np.abs(moment.sum(axis=0) - wanted.sum(axis=0)).max() < 1e-9 * np.abs(across).sum()


def test_points_with_nothing_over_them_get_no_object() -> None:
    below, _ = faced(2)
    narrow = DESIGNS["half_cylinder"](radius_mm=1.0, width_mm=4.0)
    above = reflected(mesh_section(narrow, MeshOptions(0.3, 0.5), (-1.0, 1.0, -2.0, 2.0))[0], 1)
    face = surface(below, "contact")
    rows = np.asarray(facing_trace(face, above, "contact").sum(axis=1)).ravel()
    inside = np.abs(face.points[:, 0]) < 0.5
    outside = np.abs(face.points[:, 0]) > 1.5
    assert np.abs(rows[inside] - 1.0).max() < 1e-12
    assert np.abs(rows[outside]).max() == 0.0
