"""Mean traction of a support, from the forces that hold it."""

from __future__ import annotations

import numpy as np
import pytest

from finger3d.errors import Finger3dError
from finger3d.fem.reactions import mean_traction_weights
from finger3d.fem.simplex import quadratic
from tests.meshes import edge_load, grid


@pytest.mark.parametrize("dim", [2, 3])
def test_forces_of_a_quadratic_traction_read_it(dim: int) -> None:
    mesh = quadratic(grid((3,) * dim, 0.2))

    def traction(at: np.ndarray) -> np.ndarray:
        return (1.0 + at[:, :1] ** 2 - 0.5 * at[:, -1:] * (dim == 3)) * np.eye(dim)[1]

    forces = edge_load(mesh, "y-", traction)[:, 1]
    places = np.zeros((2, dim))
    places[:, 0], places[:, 2:] = [0.3, 0.6], 0.4
    weights = mean_traction_weights(mesh, "y-", places)
    # shape functions of the face hold it exactly
    assert weights @ forces == pytest.approx(traction(places)[:, 1].mean(), rel=1e-10)


def test_a_place_beside_the_face_is_refused() -> None:
    with pytest.raises(Finger3dError, match=r"\[1\.5, 0\.0\] mm .* y-"):
        mean_traction_weights(quadratic(grid((2, 2))), "y-", np.array([[0.5, 0.0], [1.5, 0.0]]))
