"""Mean traction of a support, from the forces that hold it."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.mesh.simplex import quadratic
from finger3d.fem.recovery.reactions import mean_traction_weights
from tests.meshes import edge_load, grid


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_of_a_quadratic_traction_read_it(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))

    def traction(at: np.ndarray) -> np.ndarray:
        return (1.0 + at[:, :1] ** 2 - 0.5 * at[:, -1:] * (dim == 3)) * np.eye(dim)[1]

    forces = edge_load(mesh, "y-", traction)[:, 1]
    boxes = np.array([[[0.1, 0.15], [0.4, 0.3]], [[0.5, 0.55], [0.9, 0.8]]])[:, :, : dim - 1]
    weights = mean_traction_weights(mesh, "y-", boxes)
    total, extent = 0.0, 0.0
    for (low, *_), (high, *_), below, above in zip(*boxes.transpose(1, 0, 2), (0.15, 0.55), (0.3, 0.8), strict=True):
        of_x, z = high - low + (high**3 - low**3) / 3.0, above - below
        of_z = 0.5 * (above**2 - below**2)
        total += of_x if dim == 2 else of_x * z - 0.5 * of_z * (high - low)
        extent += high - low if dim == 2 else (high - low) * z
    # shape functions of the face hold it exactly
    assert weights @ forces == pytest.approx(total / extent, rel=1e-10)


def test_boxes_that_tile_a_face_share_every_force() -> None:
    mesh = quadratic(grid((3, 3, 3), 0.2))
    cuts = np.array([0.0, 0.23, 0.61, 1.0])
    total = np.zeros(len(mesh.points))
    for x0, x1 in itertools.pairwise(cuts):
        for z0, z1 in itertools.pairwise(cuts):
            box = np.array([[[x0, z0], [x1, z1]]])
            total += (x1 - x0) * (z1 - z0) * mean_traction_weights(mesh, "y-", box)
    assert total[np.unique(mesh.facets["y-"])] == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_traction_that_jumps_between_parts_is_not_smeared(dim: int) -> None:
    """Quadratic on the stiffer part and constant on the softer one: both sides are read exactly."""
    mesh = quadratic(grid((4,) * dim, 0.2))
    stiff = mesh.points[mesh.cells[:, : dim + 1]].mean(axis=1)[:, 0] > 0.5
    mesh = replace(mesh, part=stiff.astype(np.int64), part_labels=("stiff",))
    split = replace(mesh, facets=dict(mesh.facets))
    facets = mesh.facets["y-"]
    right = mesh.points[facets[:, :dim]].mean(axis=1)[:, 0] > 0.5
    split.facets.update(left=facets[~right], right=facets[right])
    forces = edge_load(split, "left", lambda at: np.full((len(at), 1), 0.3) * np.eye(dim)[1])[:, 1]
    forces += edge_load(split, "right", lambda at: (2.0 + at[:, :1] ** 2) * np.eye(dim)[1])[:, 1]
    left, beside = (
        np.array([[[low] + [0.1] * (dim - 2), [high] + [0.8] * (dim - 2)]]) for low, high in ((0.2, 0.5), (0.5, 0.9))
    )
    exact = 2.0 + (0.9**3 - 0.5**3) / 3.0 / 0.4
    for box, mean in ((left, 0.3), (beside, exact)):
        jumping = mean_traction_weights(mesh, "y-", box, moduli=(1.0, 50.0)) @ forces
        assert jumping == pytest.approx(mean, rel=1e-9)
        assert abs(mean_traction_weights(mesh, "y-", box) @ forces / mean - 1.0) > 1e-3


def test_a_box_beside_the_face_is_refused() -> None:
    with pytest.raises(Finger3dError, match="40 % of it is not on the face y-"):
        mean_traction_weights(quadratic(grid((2, 2))), "y-", np.array([[[0.7], [1.2]]]))
