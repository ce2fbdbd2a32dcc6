"""Calibration of a reading: its curve against mu, resolution of mu, and effects of the tolerances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from finger3d._types import Float, TreeView
from finger3d.errors import MissingError
from finger3d.sensor.pchip import MonotoneCubic

Shape = Literal["interpolation", "fit"]

Kind = Literal["gauge", "marker", "taxel"]

QUANTITIES: dict[Kind, tuple[str, str]] = {
    "gauge": ("strain", "1"),
    "marker": ("displacement", "mm"),
    "taxel": ("pressure", "MPa"),
}
"""What a reading of each kind is, and its unit."""

NOISE = 1.5e-4
"""Largest standard deviation of a strain in Maeno 2004, Sec. IV."""

MARKER_NOISE_MM, TAXEL_NOISE_MPA = 0.02, 1e-3
"""Assumed standard deviations: of the place of a dot that a camera tracks, and of a pressure cell."""

NOISES: dict[Kind, float] = {"gauge": NOISE, "marker": MARKER_NOISE_MM, "taxel": TAXEL_NOISE_MPA}

RESOLUTION = 0.1
"""The paper's error of mu, and the limit beyond which a gauge is called blind here."""

LARGEST_STRAIN, LARGEST_SD = 1e3, 1e6
"""Largest magnitude of a reading (its standard deviation too), and of any other standard deviation."""

FEWEST = 4  # points: three make the second-order fit, one more its residual

_CUTS = 32  # grid points between two calibrated mu

_SHARPER = 4.0  # ratio of interpolation errors for half the spacing at second order, the order of PCHIP at extrema


@dataclass(frozen=True)
class Fit:
    """Second-order fit as in the paper's Fig. 14: strain = c0 + c1 mu + c2 mu^2, and its residual (strain)."""

    coefficients: tuple[float, float, float]
    rms: float
    largest: float


@dataclass(frozen=True)
class Range:
    """Interval of mu in which the curve is monotone and the resolution is within the limit.

    `elsewhere` are the intervals outside it in which the same readings occur, so that they are ambiguous.
    """

    low: float
    high: float
    elsewhere: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Tolerance:
    """Quantity with a tolerance: its standard deviation and its effect on a reading.

    Attributes
    ----------
    sd : in `unit`
    slope : (n,) reading per unit at the calibration's mu
    spread : (n,) error of the reading, the root mean square of the effects of plus and minus one standard deviation
    """

    name: str
    unit: str
    sd: float
    slope: Float
    spread: Float


@dataclass(frozen=True, repr=False)
class Calibration:
    """Reading (n,) of a gauge, marker or taxel at ascending mu (n,), of the points that converged.

    Attributes
    ----------
    name : of the gauge, or as ``m1.x`` of a marker
    noise : standard deviation of a reading
    limit : resolution of mu beyond which the gauge is called blind
    failed : (mu, why) of the points that did not converge
    scene, hash : what was pressed, and 16 digits that identify the scene
    about : domain, effects, dofs, seconds, versions
    """

    name: str
    mu: Float
    reading: Float
    noise: float
    limit: float
    tolerances: tuple[Tolerance, ...] = ()
    failed: tuple[tuple[float, str], ...] = ()
    scene: TreeView = field(default_factory=dict)
    hash: str = ""
    about: TreeView = field(default_factory=dict)
    kind: Kind = "gauge"

    def __post_init__(self) -> None:
        """Raise an error if there are too few points."""
        if len(self.mu) < FEWEST:
            raise MissingError(
                f"calibrate: only {len(self.mu)} of {len(self.mu) + len(self.failed)} values of mu converged, {FEWEST} "
                f"are needed; first failure: {self.failed[0][1] if self.failed else 'none'}"
            )

    def __repr__(self) -> str:
        """Return one line: gauge, range of mu, number of points."""
        return (
            f"<Calibration of {self.kind} {self.name}: {len(self.mu)} values of mu, {self.mu[0]:g} to {self.mu[-1]:g}>"
        )

    def _repr_html_(self) -> str:
        from finger3d._notebook import card
        from finger3d.sensor.curve import summary

        rows = [(name.strip(), str(said)) for name, said in summary(self)]
        return card(f"Gauge {self.name}", f"{len(self.mu)} values of mu", rows, [self.verdict()])

    @cached_property
    def fit(self) -> Fit:
        """Least squares of second order."""
        c2, c1, c0 = np.polyfit(self.mu, self.reading, 2)
        left = self.reading - np.polyval([c2, c1, c0], self.mu)
        return Fit((float(c0), float(c1), float(c2)), float(np.sqrt(np.mean(left**2))), float(np.abs(left).max()))

    @cached_property
    def _pchip(self) -> MonotoneCubic:
        return MonotoneCubic.of(self.mu, self.reading)

    def at(self, mu: ArrayLike, shape: Shape = "interpolation") -> Float:
        """Return the reading at mu in the calibrated range, by monotone cubic interpolation (PCHIP) or by the fit."""
        if shape == "fit":
            c0, c1, c2 = self.fit.coefficients
            return np.asarray(c0 + c1 * np.asarray(mu) + c2 * np.asarray(mu) ** 2)
        return np.asarray(self._pchip(mu))

    def slope(self, mu: ArrayLike, shape: Shape = "interpolation") -> Float:
        """Return d reading / d mu."""
        if shape == "fit":
            _, c1, c2 = self.fit.coefficients
            return np.asarray(c1 + 2.0 * c2 * np.asarray(mu))
        return np.asarray(self._pchip(mu, 1))

    def resolution(self, mu: ArrayLike, shape: Shape = "interpolation") -> Float:
        """Return the standard deviation of mu due to the noise alone, noise / |d reading / d mu|."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.noise / np.abs(self.slope(mu, shape)))

    @cached_property
    def interpolation_error(self) -> float:
        """Strain error of the interpolation, rms over mu: see :meth:`curve_error`."""
        return float(np.sqrt(np.mean(self._missed[1:-1] ** 2)))

    @cached_property
    def _missed(self) -> Float:
        """Strain error (n,) of the interpolation near every mu."""
        found = np.zeros(len(self.mu))
        every = np.arange(len(self.mu))
        for first in (1, 2):
            out = every[first:-1:2]
            kept = np.setdiff1d(every, out)
            left = self.reading[out] - MonotoneCubic.of(self.mu[kept], self.reading[kept])(self.mu[out])
            found[out] = np.abs(left) / _SHARPER
        found[[0, -1]] = found[[1, -2]]
        # a kink between two of the points is seen from either of them, or from the next
        return np.asarray(np.max([found, np.append(found[1:], 0.0), np.append(0.0, found[:-1])], axis=0))

    def curve_error(self, mu: ArrayLike, shape: Shape = "interpolation") -> Float:
        """Return the error (m,) of the curve at mu (m,).

        For the fit it is the rms residual; for the interpolation a quarter of the change at points that are left out,
        every second one.
        """
        at = np.asarray(mu, dtype=float)
        return np.full(at.shape, self.fit.rms) if shape == "fit" else np.interp(at, self.mu, self._missed)

    @cached_property
    def grid(self) -> Float:
        """Mu (m,) on which the curve is inverted: the calibrated ones and 31 between any two."""
        share = np.arange(_CUTS) / _CUTS
        inner = self.mu[:-1, None] + np.diff(self.mu)[:, None] * share
        return np.append(inner.ravel(), self.mu[-1])

    def tolerance_sd(self, mu: ArrayLike) -> Float:
        """Return the error (k, m) of the reading due to every tolerance at mu (m,)."""
        at = np.atleast_1d(np.asarray(mu, dtype=float))
        rows = [np.interp(at, self.mu, t.spread) for t in self.tolerances]
        return np.array(rows).reshape(len(rows), len(at))

    def mu_sd(self, mu: ArrayLike, reading_sd: ArrayLike | None = None) -> Float:
        """Return the standard deviation of mu at mu (m,), from that of the reading; infinite on a flat curve."""
        whole = self.reading_sd(mu) if reading_sd is None else np.asarray(reading_sd)
        slope = np.abs(self.slope(mu))
        return np.where(slope > 0.0, whole / np.where(slope > 0.0, slope, 1.0), np.inf)

    def reading_sd(self, mu: ArrayLike, std: ArrayLike | None = None, shape: Shape = "interpolation") -> Float:
        """Return the standard deviation of a reading: noise (or `std`), error of the curve, and tolerances."""
        noise = np.asarray(self.noise if std is None else std, dtype=float)
        squares = noise**2 + self.curve_error(mu, shape) ** 2 + np.sum(self.tolerance_sd(mu) ** 2, axis=0)
        return np.asarray(np.sqrt(squares))

    def shares(self, mu: float) -> dict[str, float]:
        """Share of every cause in the variance of mu at one mu: noise, curve, and each tolerance; they sum to 1."""
        squares = {"noise": self.noise**2, "curve": float(self.curve_error(mu)) ** 2}
        squares |= {t.name: float(s) ** 2 for t, s in zip(self.tolerances, self.tolerance_sd(mu)[:, 0], strict=True)}
        total = sum(squares.values())
        return {name: value / total if total else 0.0 for name, value in squares.items()}

    @cached_property
    def usable(self) -> tuple[Range, ...]:
        """Stretches where the curve is monotone and the resolution within the limit, the widest first."""
        return self._stretches(np.full(len(self.grid), self.noise))

    @cached_property
    def trusted(self) -> tuple[Range, ...]:
        """The same with all tolerances: stretches where mu is found within the limit."""
        return self._stretches(self.reading_sd(self.grid))

    def _stretches(self, reading_sd: Float) -> tuple[Range, ...]:
        slope = self.slope(self.grid)
        seen = np.where(np.abs(slope) * self.limit >= reading_sd, np.sign(slope), 0.0)
        cuts = np.flatnonzero(np.diff(seen)) + 1
        found = []
        for first, last in zip([0, *cuts], [*cuts, len(seen)], strict=True):
            if seen[first] and last - first > 1:
                low, high = float(self.grid[first]), float(self.grid[last - 1])
                found.append(Range(low, high, self._elsewhere(first, last)))
        return tuple(sorted(found, key=lambda r: r.low - r.high))

    def _elsewhere(self, first: int, last: int) -> tuple[tuple[float, float], ...]:
        """Return intervals outside grid[first:last] whose strain also occurs inside, by more than the noise."""
        strain = self.at(self.grid)
        low, high = strain[first:last].min() + self.noise, strain[first:last].max() - self.noise
        same = (strain > low) & (strain < high)
        same[first:last] = False
        edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(int), [0]])))
        return tuple((float(self.grid[a]), float(self.grid[b - 1])) for a, b in edges.reshape(-1, 2))

    def verdict(self) -> str:
        """Return in one or two sentences where the gauge resolves mu."""
        ends = f"{self.mu[0]:g} to {self.mu[-1]:g}"
        if not self.usable:
            return (
                f"gauge {self.name}: no usable range: nowhere from mu = {ends} does a strain noise of {self.noise:g} "
                f"leave a resolution of {self.limit:g} or better; best {self.resolution(self.grid).min():.3g}"
            )
        best = self.usable[0]
        sign = "rises" if self.slope(0.5 * (best.low + best.high)) > 0.0 else "falls"
        text = (
            f"gauge {self.name}: usable from mu = {best.low:.3g} to {best.high:.3g}: there the strain {sign} with mu "
            f"and a noise of {self.noise:g} leaves a resolution of {self.limit:g} or better"
        )
        if best.elsewhere:
            places = ", ".join(f"{a:.3g} to {b:.3g}" for a, b in best.elsewhere)
            text += f"; but the same strains occur at mu = {places}"
        return text + self._with_tolerances(best)

    def _with_tolerances(self, best: Range) -> str:
        if not self.tolerances:
            return ""
        inside = self.grid[(self.grid >= best.low) & (self.grid <= best.high)]
        spread = self.mu_sd(inside)
        at = float(inside[np.argmin(spread)])
        name, share = max(self.shares(at).items(), key=lambda item: item[1])
        where = ", ".join(f"{r.low:.2g} to {r.high:.2g}" for r in self.trusted)
        within = f"from mu = {where}" if where else "nowhere"
        return (
            f". With all that is not known exactly mu is found to {self.limit:g} or better {within}; to +- "
            f"{spread.min():.2g} at best (mu = {at:.2g}; {100.0 * share:.0f} % of the variance from {name})"
        )


def ranges_text(intervals: Sequence[tuple[float, float]]) -> str:
    """Return intervals of mu in words."""
    return ", ".join(f"mu = {low:.3g} to {high:.3g}" for low, high in intervals) or "nowhere"


def summary(calibration: Calibration) -> list[tuple[str, str]]:
    """Return the table that concludes a calibration."""
    c = calibration
    at = typical(c.mu)
    shares = sorted(c.shares(at).items(), key=lambda item: -item[1])
    sd = float(c.mu_sd([at])[0])
    rows = [
        ("strain", f"{c.reading[0]:.4g} at mu = {c.mu[0]:g} to {c.reading[-1]:.4g} at mu = {c.mu[-1]:g}"),
        (
            f"mu within {c.limit:g}",
            f"{_ends(c.trusted)}, with all tolerances; {_ends(c.usable)} from strain noise alone",
        ),
        (f"resolution at mu = {at:.3g}", f"{float(c.resolution(at)):.2g} from a strain noise of {c.noise:g}"),
        ("second-order fit", f"residual {c.fit.rms:.2g} rms, {c.fit.largest:.2g} at most"),
        (f"mu +- at mu = {at:.3g}", f"{sd:.2g} with all tolerances; shares of the variance below"),
        *((f"  {name}", f"{100.0 * share:.1f} %") for name, share in shares),
    ]
    left = next((t for t in c.tolerances if t.name == "increments"), None)
    if left is not None:
        steps = ", ".join(str(n) for n in c.about.get("increments", {}).get("steps", ()))
        said = f"leave an error of up to {left.spread.max():.2g} in the strain"
        rows.insert(1, (f"increments {steps}".strip(), said))
    rows[1:1] = mesh_rows(c.about)
    return rows + failed_rows(c.failed)


def _ends(stretches: Sequence[Range]) -> str:
    return ranges_text([(r.low, r.high) for r in stretches])


def typical(mu: Float) -> float:
    """Return the calibrated mu nearest to 0.5, or the middle one where 0.5 is not calibrated."""
    return float(mu[np.argmin(np.abs(mu - 0.5))] if mu[0] <= 0.5 <= mu[-1] else mu[len(mu) // 2])


def mesh_rows(about: TreeView) -> list[tuple[str, str]]:
    """Return the row of the mesh for the table that concludes a calibration, if the mesh is known."""
    if not (mesh := about.get("mesh")):
        return []
    note = f"; {mesh['note']}" if mesh["note"] else ""
    return [("mesh", f"edges of {mesh['size_mm']:.3g} and {mesh['base_size_mm']:.3g} mm{note}")]


def failed_rows(failed: Sequence[tuple[float, str]]) -> list[tuple[str, str]]:
    """Return the row of the values of mu that failed, if any did."""
    return [("failed", ", ".join(f"mu = {mu:.4g}" for mu, _ in failed))] if failed else []
