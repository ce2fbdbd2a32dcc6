"""Bars at finite strain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from finger3d.fem.solids.bars import BarRelaxation, Bars


def bars(dim: int) -> Bars:
    """Three bars of unit length in a chain of four points along x."""
    chain = sp.csr_matrix(np.diff(np.eye(4), axis=0))
    yielding = 0.1 * np.array([[2.0, 0.5, 0.1], [0.5, 2.0, 0.5], [0.1, 0.5, 2.0]])
    directions = np.tile(np.eye(dim)[0], (3, 1))
    relative = sp.kron(chain, np.eye(dim), format="csr")
    return Bars(directions, relative, np.array([1.0, 2.0, 3.0]), yielding)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("relaxation", [None, BarRelaxation(0.6, np.array([0.01, 0.0, -0.02]))])
def test_the_tangent_is_the_derivative_of_the_forces(dim: int, relaxation: BarRelaxation | None) -> None:
    made, rng = bars(dim), np.random.default_rng(0)
    u, step, h = 0.3 * rng.normal(size=(4, dim)), rng.normal(size=(4, dim)), 1e-6
    difference = (made.forces(u + h * step, relaxation) - made.forces(u - h * step, relaxation)) / (2.0 * h)
    assert made.tangent(u, relaxation) @ step.ravel() == pytest.approx(difference, rel=1e-6, abs=1e-8)


def test_a_stretch_is_shared_by_bar_and_surroundings() -> None:
    made = bars(3)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    rest = np.outer(np.arange(4.0), np.eye(3)[0])
    u = 1.25 * rest @ turn.T - rest  # every bar is stretched by a quarter, and turned
    tension = made.tension(u)
    assert made.strain(u, np.zeros(3)) == pytest.approx(np.full(3, 0.25), rel=1e-12)
    # e = T / k + S T
    assert tension / made.stiffness + made.yielding @ tension == pytest.approx(np.full(3, 0.25), rel=1e-12)
    assert made.yielded(u) == pytest.approx(made.yielding @ tension, rel=1e-12)
    # forces on a chain balance, and a rigid rotation of the stretched chain turns them
    forces = made.forces(u).reshape(4, 3)
    assert forces.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert forces @ turn == pytest.approx(made.forces(0.25 * rest).reshape(4, 3), abs=1e-12)


def test_bars_at_rest_have_no_force_at_all() -> None:
    # round-off of a foil's stiffness would outweigh the least of the contact forces
    directions = np.random.default_rng(4).normal(size=(3, 3))
    made = replace(bars(3), directions=directions / np.linalg.norm(directions, axis=1)[:, None])
    assert not made.forces(np.zeros((4, 3))).any()
    assert made.strain(1e-20 * np.eye(4, 3), np.zeros(3)).any()
