"""Plain increments, in which a point that closes is held where it was at their start, with errors of first order."""

from __future__ import annotations

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult


class PlainCoulomb(Coulomb):
    """Coulomb's law in plain increments, as the integral equations, Maeno 2004 and most codes solve it.

    A point that closes in an increment slips from the place it had at its start.
    """

    @property
    def is_defined_by_increments(self) -> bool:
        """True: the place where a point touches is not used."""
        return True


def stored_mJ(problem: Problem, step: StepResult) -> float:
    """Elastic energy in small strain, from contact forces and displacements at the end of an increment."""
    state = step.meshed_state
    world = np.einsum("ca,cak->ck", state.contact.force, state.contact.own_bases)
    return 0.5 * problem.symmetry.total(np.einsum("ck,ck->c", world, state.body))


def imbalance(problem: Problem, step: StepResult) -> float:
    """Work less stored energy less dissipation, over the work."""
    return (step.external_work_mJ - stored_mJ(problem, step) - step.dissipation_mJ) / step.external_work_mJ
