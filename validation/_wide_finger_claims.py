"""Which of the paper's findings are true of the finger 20 mm wide, in small strain and at large deformation?

Source: Maeno 2004, Figs. 3 to 8 and 10 to 12, which are computed in plane stress and plane strain in small strain; Sec.
IV builds the finger of Fig. 9 20 mm wide and presses it 10 mm.  The statements are those of the studies of the single
figures, judged at z = 0 (nu = 0.49, neo-Hookean at large deformation).  Figs. 3 to 8 are of a half cylinder without a
width; here they are judged in the finger that was built, along the line 3.3 mm under its surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.contact.friction import TwoCoefficients
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.laws.material import Isotropic
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.model import MeshOptions

from . import _half_cylinder_forces as forces
from . import _half_cylinder_strains as inner
from . import fig9_strains
from ._paper import BELOW_FIG9, MUS, Profile, draw_grid, fig9, line, rows_by_mu, said, strains
from ._press import fig9_finger, under
from ._rows import Result, Row, columns

NU, COUNT = 0.49, 25
ANGLES = (15, 30, 45, 60)
MODELS = {"20 mm wide": 160, "20 mm wide, large deformation": 20}
"""Increments, in small strain as many as the strain at large mu needs."""


@dataclass(frozen=True)
class Pressed:
    """Presses of one model: last frames and strains (m, 3, n) for all coefficients, and the frames at mu = 0.25."""

    problem: Problem
    last: tuple[StepResult, ...]
    strain: Float
    frames: tuple[StepResult, ...]
    early: Float
    """Strains (3, n) at a fifth of the depth, mu = 0.25."""
    halved: Float
    """gamma_xy (n,) at mu = 0.25 with a kinetic coefficient half as large."""
    ten: StepResult
    """Last frame at mu = 0.25 in the paper's ten increments."""
    soft_N: float
    """Normal force at mu = 0.25 with nu = 0.3."""

    @classmethod
    def of(cls, problem: Problem, steps: int) -> Pressed:
        """Press with all coefficients of friction."""
        presses = {mu: under(problem, mu, steps) for mu in MUS}
        kinetic = under(problem, TwoCoefficients(0.25, 0.5, "keep"), steps)[-1]
        last = tuple(frames[-1] for frames in presses.values())
        finite = problem.model.hyperelastic_law is not None
        strain = np.array([strains(frame, COUNT, finite=finite) for frame in last])
        frames = tuple(presses[0.25][steps // 5 - 1 :: steps // 5])
        ten = under(problem, 0.25, min(10, steps))[-1]
        other = build(replace(problem.model, material=Isotropic(1.0, 0.3)))
        soft = measure(other.points, under(other, 0.25, min(10, steps))[-1])["normal_force_N"]
        early = strains(frames[0], COUNT, finite=finite)
        return cls(problem, last, strain, frames, early, strains(kinetic, COUNT, finite=finite)[2], ten, soft)

    @property
    def read(self) -> dict[int, Float]:
        """Strain (m,) of the gauges by angle."""
        return {t: np.array([f.gauges[f"{BELOW_FIG9}:{t}"] for f in self.last]) for t in ANGLES}

    def profiles(self, frames: tuple[StepResult, ...]) -> list[Profile]:
        """Tractions at z = 0."""
        return [Profile.of(self.problem, frame) for frame in frames]


def run(quick: bool) -> Result:
    """Quick: a coarse mesh and few increments."""
    x = np.linspace(0.0, 48.0, COUNT)
    size = 6.0 if quick else 2.5
    gauges = [*line(x, fig9_finger(), BELOW_FIG9), *fig9_strains.gauges()]
    small = fig9(NU, "solid", size if quick else 1.5, gauges)
    mesh = MeshOptions(size, 3.0 * size, "swept")
    large = build(LargeDeformation().apply(replace(small.model, mesh=mesh)))
    found, rows, lines = {}, [], []
    for (name, steps), problem in zip(MODELS.items(), (small, large), strict=True):
        found[name] = Pressed.of(problem, 5 if quick else steps)
        rows += _statements(name, x, found[name])
        for i, mu in enumerate(MUS):
            told = measure(problem.points, found[name].last[i])
            profile = found[name].profiles(found[name].last[i : i + 1])[0]
            zones = (2.0 * profile.a, 2.0 * profile.deformed, 2.0 * profile.c)
            lines.append((name, mu, told["normal_force_N"], told["friction_sum_N"], *zones))
    names = "model mu force_N friction_sum_N width_at_rest_mm width_deformed_mm stick_width_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, x, found))


def _statements(here: str, x: Float, found: Pressed) -> list[Row]:
    """What the paper says of Figs. 3 to 8 and 10 to 12."""
    told = [measure(found.problem.points, frame) for frame in found.last]
    force, friction = ([numbers[key] for numbers in told] for key in ("normal_force_N", "friction_sum_N"))
    depths, mus = found.profiles(found.frames), found.profiles(found.last)
    middle = mus[MUS.index(0.25)]
    shear = found.strain[:, 2]
    at_36 = shear[:, np.argmin(np.abs(x - 36.0))]
    signal = float(np.ptp(shear, axis=0).max())
    kinetic = float(np.abs(found.halved - shear[MUS.index(0.25)]).max())
    whole = np.concatenate([-x[:0:-1], x])
    mirrored = np.concatenate([found.strain[:, :, :0:-1] * [[1.0], [1.0], [-1.0]], found.strain], axis=2)
    ten = measure(found.problem.points, found.ten)
    return [
        said("nu-not-told", force[MUS.index(0.25)], wanted=found.soft_N, here=here),
        said("ten-increments", abs(ten["friction_sum_N"] / friction[MUS.index(0.25)] - 1.0), here=here),
        # small contacts have few points; the mirror symmetry that is used makes the sum of f_t zero
        *(row for row in forces.statements_depths(here, depths[-1:]) if "sum of f_t" not in row.what),
        *forces.statements_zones(here, depths[0], depths[-1]),
        *inner.statements_depths(here, found.early, found.strain[MUS.index(0.25)]),
        *forces.statements_mus(here, mus, force, friction),
        *inner.statements_mus(here, whole, mirrored, middle.a),
        said("kinetic-little", kinetic / np.abs(shear[MUS.index(0.25)]).max(), here=here),
        said("kinetic-told", kinetic / signal, here=here),
        said("width-79", 2.0 * middle.deformed, tolerance=1.0 + 2.0 * middle.edge_error(), here=here),
        said("shear-at-36", abs(at_36[-1] - at_36[-2]) / np.ptp(at_36), here=here),
        said("edge-slips", (mus[-1].a - mus[-1].c) / mus[-1].a, here=here),
        *fig9_strains.statements(here, NU, np.array(MUS), found.read),
    ]


def _draw(figure: Any, x: Float, found: dict[str, Pressed]) -> None:
    figure.set_size_inches(10.0, 12.0)
    figure.suptitle(f"The finger at 10 mm, at z = 0, nu = {NU:g}")
    own = found.values()
    strains = {
        f"{name} under the surface": [one.strain[:, k] for one in own] for name, k in (("eps_x", 0), ("gamma_xy", 2))
    }
    rows = rows_by_mu(x, [one.profiles(one.last) for one in own], strains, [one.read for one in own])
    draw_grid(figure, list(found), rows)
