"""Calibration of several readings together: their curves, and the covariance of their errors.

The readings r = e(mu) + error have the covariance ``C = D + sum_t sd_t^2 s_t s_t^T``.  The sum is over the tolerances
that all readings share (depth, modulus, Poisson's ratio, tilt) with the slopes s_t of the readings, and the diagonal D
has what every reading has of its own: noise, interpolation, place of a gauge, mesh, increments, and the part of a
shared tolerance that is not linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float, TreeView
from finger3d.errors import Finger3dError
from finger3d.sensor.curve import QUANTITIES, Calibration, failed_rows, mesh_rows, ranges_text, typical

SHARED = ("depth_mm", "E_percent", "nu", "tilt_deg")
"""Tolerances that change all readings together."""

_LEAST_NOISE = 1e-3  # relative to the noise of a calibration: an exact reading leaves the covariance regular


@dataclass(frozen=True, repr=False, eq=False)
class JointCalibration:
    """Calibrations of several readings (k) in the same presses.

    Attributes
    ----------
    readings : a calibration for each reading, all at the same mu
    limit : standard deviation of mu beyond which the readings are called coarse
    scene, hash, about : as in `Calibration`
    """

    readings: tuple[Calibration, ...]
    limit: float
    scene: TreeView = field(default_factory=dict)
    hash: str = ""
    about: TreeView = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return one line: readings, range of mu, number of points."""
        return (
            f"<JointCalibration of {', '.join(self.names)}: {len(self.mu)} values of mu, "
            f"{self.mu[0]:g} to {self.mu[-1]:g}>"
        )

    def _repr_html_(self) -> str:
        from finger3d._notebook import card

        rows = [(name.strip(), str(said)) for name, said in joint_summary(self)]
        return card(f"Readings {', '.join(self.names)}", f"{len(self.mu)} values of mu", rows, [self.verdict()])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the readings."""
        return tuple(c.name for c in self.readings)

    @property
    def mu(self) -> Float:
        """Calibrated coefficients of friction (n,), ascending."""
        return self.readings[0].mu

    @property
    def grid(self) -> Float:
        """Mu (m,) on which the likelihood is evaluated, as in `Calibration`."""
        return self.readings[0].grid

    @property
    def failed(self) -> tuple[tuple[float, str], ...]:
        """Coefficients of friction that did not converge, and why."""
        return self.readings[0].failed

    @property
    def noise(self) -> Float:
        """Standard deviation (k,) of the noise of every reading, in its unit."""
        return np.array([c.noise for c in self.readings])

    @property
    def tolerance_names(self) -> tuple[str, ...]:
        """Names of the tolerances of any reading."""
        return tuple(dict.fromkeys(t.name for c in self.readings for t in c.tolerances))

    def of(self, names: Sequence[str]) -> JointCalibration:
        """Return the calibration of some of the readings, in this order."""
        known = {c.name: c for c in self.readings}
        for name in names:
            if name not in known:
                raise Finger3dError(f"{name}: not calibrated; the readings are {', '.join(self.names)}")
        return JointCalibration(tuple(known[n] for n in names), self.limit, self.scene, self.hash, self.about)

    def at(self, mu: ArrayLike) -> Float:
        """Return the readings (m, k) at mu (m,)."""
        return np.stack([c.at(mu) for c in self.readings], axis=-1)

    def slope(self, mu: ArrayLike) -> Float:
        """Return d reading / d mu (m, k) at mu (m,)."""
        return np.stack([c.slope(mu) for c in self.readings], axis=-1)

    def covariance(
        self, mu: ArrayLike, noise: Float | None = None, tolerances: bool = True, without: str = ""
    ) -> Float:
        """Return the covariance (m, k, k) of the readings at mu (m,).

        Parameters
        ----------
        noise : (k,) standard deviations in place of those of the calibration
        tolerances : whether tolerances count
        without : name of a tolerance that is known exactly, or ``"noise"``
        """
        at = np.atleast_1d(np.asarray(mu, dtype=float))
        scale = self.noise
        own = np.array([c.curve_error(at) ** 2 for c in self.readings]).T
        if without != "noise":
            own = own + np.maximum(scale if noise is None else noise, _LEAST_NOISE * scale) ** 2
        shared = [np.zeros((len(at), len(self.readings))) for _ in SHARED]
        for i, c in enumerate(self.readings if tolerances else ()):
            for t in (t for t in c.tolerances if t.name != without):
                square = np.interp(at, c.mu, t.spread) ** 2
                if t.name in SHARED:
                    effect = t.sd * np.interp(at, c.mu, t.slope)
                    shared[SHARED.index(t.name)][:, i] = effect
                    square = np.maximum(square - effect**2, 0.0)
                own[:, i] += square
        found = np.zeros((len(at), len(scale), len(scale)))
        found[:, np.arange(len(scale)), np.arange(len(scale))] = np.maximum(own, (_LEAST_NOISE * scale) ** 2)
        for effect in shared:
            found += effect[:, :, None] * effect[:, None, :]
        return found

    def mu_sd(self, mu: ArrayLike, without: str = "", tolerances: bool = True) -> Float:
        """Return the standard deviation (m,) of mu, ``1 / sqrt(s^T C^-1 s)`` with the slopes s of the readings."""
        slope = np.atleast_2d(self.slope(np.atleast_1d(mu)))
        slope = slope / self.noise
        covariance = self.covariance(mu, without=without, tolerances=tolerances) / np.outer(self.noise, self.noise)
        information = np.einsum("mi,mi->m", slope, np.linalg.solve(covariance, slope[:, :, None])[:, :, 0])
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / np.sqrt(np.maximum(information, 0.0)))

    def reductions(self, mu: ArrayLike) -> dict[str, Float]:
        """Return, for the noise and each tolerance, the share (m,) of the variance of mu that it alone adds.

        It is the reduction of the variance if that quantity were known exactly.  Shares need not sum to 1.
        """
        whole = self.mu_sd(mu) ** 2
        with np.errstate(invalid="ignore"):
            return {
                name: np.nan_to_num(1.0 - self.mu_sd(mu, without=name) ** 2 / whole)
                for name in ("noise", *self.tolerance_names)
            }

    @cached_property
    def trusted(self) -> tuple[tuple[float, float], ...]:
        """Intervals in which the standard deviation of mu is within the limit, the widest first."""
        good = np.concatenate([[0], (self.mu_sd(self.grid) <= self.limit).astype(int), [0]])
        ends = np.flatnonzero(np.diff(good)).reshape(-1, 2)
        found = [(float(self.grid[a]), float(self.grid[b - 1])) for a, b in ends if b - a > 1]
        return tuple(sorted(found, key=lambda pair: pair[0] - pair[1]))

    def verdict(self) -> str:
        """Return in one sentence where the readings together determine mu."""
        spread = self.mu_sd(self.grid)
        best = int(np.argmin(spread))
        where = ranges_text(self.trusted)
        return (
            f"readings {', '.join(self.names)} together: with all that is not known exactly mu is found to "
            f"{self.limit:g} or better: {where}; to +- {spread[best]:.2g} at best (mu = {self.grid[best]:.2g})"
        )


def joint_summary(calibration: JointCalibration) -> list[tuple[str, str]]:
    """Return the table that concludes a calibration of several readings."""
    c = calibration
    at = typical(c.mu)
    shares = sorted(c.reductions([at]).items(), key=lambda item: -float(item[1][0]))
    rows = [
        (f"mu within {c.limit:g}", f"{ranges_text(c.trusted)}, with all tolerances"),
        (f"mu +- at mu = {at:.3g}", f"{float(c.mu_sd([at])[0]):.2g} by all readings together"),
        *(
            (f"  {one.name} alone", f"{_alone(one, at)}; noise {one.noise:g} {_unit(one)}".rstrip())
            for one in c.readings
        ),
        ("variance of mu", "would fall by so much if one of these were known exactly"),
        *((f"  {name}", f"{100.0 * float(share[0]):.1f} %") for name, share in shares),
    ]
    rows[1:1] = mesh_rows(c.about)
    return rows + failed_rows(c.failed)


def _alone(calibration: Calibration, mu: float) -> str:
    """Return the standard deviation of mu by one reading, in words where it contains no information."""
    sd = float(calibration.mu_sd([mu])[0])
    return f"{sd:.2g}" if np.isfinite(sd) else "not determined there"


def _unit(calibration: Calibration) -> str:
    """Return the unit of a reading; nothing for a strain."""
    return QUANTITIES[calibration.kind][1].replace("1", "")
