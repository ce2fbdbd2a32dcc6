"""Does finger3d reproduce a measured press, of a ball on a GelSight Mini gel, and what does that tell of the gel?

Source: Helmut et al. 2024, validation/REFERENCES.md, 9.1: a steel ball of 15 mm diameter pressed 0.5, 1, 1.5 and 2 mm
into the gel.  Neither errors of the forces nor friction are published; the gel is taken as a block of 20.75 x 25.25 x 4
mm, without its rounded rim, on a rigid back, at large deformation.  `finger3d identify` finds Young's modulus and the
depth at which the bench has its zero, with a standard deviation of 3 % of every force, for two laws, four
coefficients of friction and three Poisson's ratios; then from the first three depths alone, which predicts the fourth.
Its bands are those of the forces' errors alone; what the mesh leaves, a finer one tells.
Helmut et al. fit a neo-Hookean law with C10 = 0.0725 MPa to the same forces, with tied contact; they give no constant
of volume, for which CalculiX takes nu = 0.475.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.analyses.identify.run import identify
from finger3d.analyses.press import press
from finger3d.io import write_csv

from ._press import block_tables
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

DEPTHS, FORCES = np.array([0.5, 1.0, 1.5, 2.0]), np.array([1.6503, 5.9641, 13.5257, 23.2532])
SHARE = 0.03
"""Standard deviation of a force over the force; the publication has none."""
FITS = 0.05
"""Largest distance from a force, relative, of a model that is said to fit."""
C10, CCX_NU = 0.0725, 0.475
LAWS: dict[str, dict[str, Any]] = {"neo-Hookean": {}, "Yeoh": {"law": "yeoh", "c2_over_c1": -0.1, "c3_over_c1": 0.02}}
MUS, NUS = (0.02, 0.1, 0.3, 1.0), (0.45, 0.47, 0.49)
E, ZERO = "material.E_MPa", "depth_offset_mm"
FREE = {E: (0.05, 3.0), ZERO: (-0.3, 0.3)}


@dataclass(frozen=True)
class Model:
    """What is assumed, and the values and forces that are found with it.

    Attributes
    ----------
    E, E_sd, zero : Young's modulus and its standard deviation by the forces' errors, MPa; zero of the depth, mm
    forces : (4,) N at the measured depths
    predicted, predicted_sd : force at the fourth depth from the first three, N
    curve : depth, mm, and force, N, of the simulated press
    """

    law: str
    mu: float
    nu: float
    E: float
    E_sd: float
    zero: float
    forces: Float
    predicted: float
    predicted_sd: float
    curve: tuple[Float, Float]

    @property
    def misfit(self) -> float:
        """Largest distance from a measured force, relative."""
        return float(np.abs(self.forces / FORCES - 1.0).max())


def scene(law: str, mu: float, nu: float, size: float, E_MPa: float = 0.4) -> dict[str, Any]:
    """The ball on the block."""
    return block_tables(
        (10.375, 4.0, 25.25), E_MPa, nu, (size, min(2.0 * size, 4.0)), friction={"mu": mu},
        object={"shape": "sphere", "radius_mm": 7.5}, press={"depth_mm": 2.4, "steps": 12},
        effects={"large_deformation": LAWS[law]},
    )  # fmt: skip


def run(quick: bool) -> Result:
    """Quick: one model on a coarse mesh."""
    size = 2.5 if quick else 1.2
    laws, mus, nus = (list(LAWS)[:1], MUS[:1], NUS[1:2]) if quick else (list(LAWS), MUS, NUS)
    with tempfile.TemporaryDirectory() as folder:
        models = [_identified(law, mu, nu, size, Path(folder)) for law in laws for mu in mus for nu in nus]
        best = min(models, key=lambda m: m.misfit)
        finer = _identified(best.law, best.mu, best.nu, 0.7 * size, Path(folder) / "finer")
    lines = [(m.law, m.mu, m.nu, m.E, m.E_sd, m.zero, m.misfit, m.predicted, m.predicted_sd, *m.forces) for m in models]
    names = "law mu nu E_MPa E_sd_MPa zero_mm misfit predicted_N predicted_sd_N F0_N F1_N F2_N F3_N"
    rows = (*_rows(models, best), *_checks(best, finer, size))
    return Result(rows, columns(names, lines), lambda figure: _draw(figure, models, best))


def _identified(law: str, mu: float, nu: float, size: float, folder: Path) -> Model:
    """Identify from all forces and from the first three."""
    found = {}
    for count in (4, 3):
        out = folder / f"{law} {mu} {nu} {count}"
        out.mkdir(parents=True)
        table = {"depth_mm": DEPTHS, "normal_force_N": FORCES, "normal_force_N_std": SHARE * FORCES}
        write_csv(out / "bench.csv", {name: values[:count] for name, values in table.items()})
        found[count] = identify(scene(law, mu, nu, size), out / "bench.csv", FREE, out)
    modulus, zero = found[4].fitted.values
    curve, values = found[3].curve, found[3].fitted.values
    slopes = _slopes(curve, values, DEPTHS)
    sd = float(np.sqrt(slopes[3] @ _covariance(slopes[:3]) @ slopes[3]))
    sds = np.sqrt(np.diag(_covariance(_slopes(found[4].curve, found[4].fitted.values, DEPTHS))))
    at, depth, force = DEPTHS[3] + values[1], np.asarray(curve["depth_mm"]), np.asarray(curve["normal_force_N"])
    whole = found[4].curve
    return Model(
        law, mu, nu, float(modulus), float(sds[0]), float(zero), np.asarray(found[4].simulated["normal_force_N"]),
        float(np.interp(at, depth, force)), sd,
        (np.asarray(whole["depth_mm"]) - zero, np.asarray(whole["normal_force_N"])),
    )  # fmt: skip


def _slopes(curve: Any, values: Float, depths: Float) -> Float:
    """Return the derivatives (n, 2) of the forces by modulus and zero: a force is proportional to the modulus."""
    depth, force = np.asarray(curve["depth_mm"]), np.asarray(curve["normal_force_N"])
    at = depths + values[1]
    return np.column_stack([np.interp(at, depth, force) / values[0], np.interp(at, depth, np.gradient(force, depth))])


def _covariance(slopes: Float) -> Float:
    """Return the covariance (2, 2) that errors of 3 % of the first forces leave in modulus and zero."""
    scaled = slopes / (SHARE * FORCES[: len(slopes), None])
    return np.linalg.inv(scaled.T @ scaled)


def _rows(models: list[Model], best: Model) -> Iterator[Row]:
    """What fits, what the forces tell, and the prediction."""
    fitting = [m for m in models if m.misfit <= FITS]
    told = f"{best.law}, mu = {best.mu:g}, nu = {best.nu:g}, E = {best.E:.3f} MPa"
    yield judged("largest-distance-from-the-four-forces", best.misfit, FITS, count=len(models), told=told)
    yield judged("models-that-fit-within-5-over", len(fitting) / len(models))
    for name, values in {"friction coefficient": [m.mu for m in fitting], "Young's modulus": [m.E for m in fitting],
                         "Poisson's ratio": [m.nu for m in fitting]}.items():  # fmt: skip
        ratio = max(values, default=np.nan) / min(values, default=np.nan)
        yield judged("the-forces-tell-the-within-10", ratio, name=name)
    # of all models: which of them fit is known only with the fourth force
    band = [m.predicted + sign * 2.0 * m.predicted_sd for m in models for sign in (-1.0, 1.0)]
    outside = max(min(band) - FORCES[3], FORCES[3] - max(band), 0.0)
    yield judged("distance", outside, value=min(band), other_value=max(band))


def _checks(best: Model, finer: Model, size: float) -> list[Row]:
    """The error of the mesh, and the publication's own constants in tied contact."""
    tied = press(scene("neo-Hookean", 10.0, CCX_NU, size, 4.0 * C10 * (1.0 + CCX_NU)), error=False)
    depth, force = ([0.0, *(getattr(s, key) for s in tied.steps)] for key in ("depth_mm", "normal_force_N"))
    theirs = np.interp(DEPTHS, depth, force) / FORCES
    return [
        judged("young-s-modulus-on-edges-of", finer.E, best.E, value=0.7 * size, size=size),
        judged("published-constant-at-2-mm", float(theirs[3])),
        judged("published-constant-at-half-mm", float(theirs[0])),
    ]


def _draw(figure: Any, models: list[Model], best: Model) -> None:
    left, right = figure.subplots(1, 2)
    fitting = [m for m in models if m.misfit <= FITS]
    for m in fitting:
        left.plot(*m.curve, color="#9ecae1", lw=0.8)
    left.plot(*best.curve, color="#2166ac", lw=1.6, label=f"{best.law}, mu = {best.mu:g}, nu = {best.nu:g}")
    left.errorbar(DEPTHS, FORCES, SHARE * FORCES, fmt="ko", ms=5, capsize=3, label="measured, 3 %")
    left.set(xlabel="depth (mm)", ylabel="normal force (N)", xlim=(0.0, 2.2), ylim=(0.0, 30.0))
    left.set_title("models that fit within 5 %")
    left.legend(frameon=False)
    for i, law in enumerate(dict.fromkeys(m.law for m in models)):
        for j, nu in enumerate(dict.fromkeys(m.nu for m in models)):
            own = [m for m in models if m.law == law and m.nu == nu]
            style = ("-", "--", ":")[i]
            label = f"{law}, nu = {nu:g}"
            right.plot(
                [m.mu for m in own], [100.0 * m.misfit for m in own], style, marker="o", color=f"C{j}", label=label
            )
    right.axhline(100.0 * FITS, color="#222222", lw=0.8)
    right.set(xscale="log", xlabel="mu that is assumed", ylabel="largest distance from a force (%)", ylim=(0.0, None))
    right.legend(fontsize=7.5, frameon=False, ncols=2, handlelength=4.0)
