"""Fisher information of readings about mu, with the tolerances marginalised.

The unknowns are mu and the tolerances that all readings share, each in units of its standard deviation.  A reading with
slope s against mu, effects f of the shared tolerances, and variance d of its own adds ``v v^T / d`` with v = (s, f) to
the Fisher matrix.  The information about mu alone is the Schur complement of the other unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from finger3d._types import Float


@dataclass(frozen=True)
class ReadingEffects:
    """Effects of mu and tolerances on candidates for a reading (c), at several mu (m).

    Attributes
    ----------
    effects : (c, m, 1 + q) slope against mu, and change for one standard deviation of each shared tolerance
    variance : (c, m) of the noise and of what every reading has of its own
    """

    effects: Float
    variance: Float

    @property
    def fisher(self) -> Float:
        """Fisher matrices (c, m, 1 + q, 1 + q) of the candidates."""
        v = self.effects
        return np.asarray(v[..., :, None] * v[..., None, :] / self.variance[..., None, None])


def prior(shared: int, mu_sd: float) -> Float:
    """Return the Fisher matrix (1 + q, 1 + q) without readings; `mu_sd` is what is known of mu beforehand."""
    return np.diag([mu_sd**-2, *np.ones(shared)])


def mu_sd(fisher: Float) -> Float:
    """Return the standard deviation (...) of mu from Fisher matrices (..., 1 + q, 1 + q)."""
    information, mixed, others = fisher[..., 0, 0], fisher[..., 1:, 0], fisher[..., 1:, 1:]
    if not mixed.shape[-1]:
        return np.asarray(1.0 / np.sqrt(information))
    left = information - np.einsum("...i,...i->...", mixed, np.linalg.solve(others, mixed[..., None])[..., 0])
    return np.asarray(1.0 / np.sqrt(left))
