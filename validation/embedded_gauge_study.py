"""How much of the strain does an embedded foil gauge read, and is that why the paper's strains are so small?

A foil of 3000 MPa, 0.02 x 3 mm, in silicone of 1 MPa is stiffer than the body it should follow: it reads its own
elongation.  First the effect is checked: in a plane without end against Prandtl's equation, in space against graded
meshes, and near a free surface, which the effect leaves out.  Then the Fig. 9 finger, nu = 0.49, pressed 10 mm, gauges
of 1 to 10 mm at x = 36 mm (and mirrored), y = 38 mm, 30 degrees, as plane strain and as a 20 mm wide solid, in 160
increments: in ten the slope in mu is not settled.

Maeno 2004, Sec. IV: the largest standard deviation of the strain, 1.5e-4, makes an error of 0.1 in mu up to mu = 0.5:
the slope of the second-order curve of Fig. 14 is about 1.5e-3 per unit of mu there.  The foil in the paper is not
described; this one is of a common kind.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from finger3d.contact.friction import Coulomb
from finger3d.effects.embedded_gauge import Effect
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.model import Domain, Foils, Leg

from ._common import ticks_at
from ._foil import alone, by_mesh, wing
from ._press import fig9_model, paper_gauges, under
from ._rows import Result, Row, exact_columns, listed

judged = listed(__file__)

FOIL = Effect(3000.0, 0.02, 3.0)
NU, SLOPE, NOISE = 0.49, 1.5e-3, 1.5e-4
MUS = (0.06, 0.125, 0.25, 0.4, 0.5, 0.6, 1.0)
LENGTHS = (1.0, 2.0, 4.0, 10.0)
DEPTHS = (1.0, 0.5, 0.25)  # of a foil under a free surface, in its lengths
COLUMNS = "model length_mm mu free read share slope_free slope_read resolution_free resolution_read"


def finger(domain: Domain, length: float, size: float, steps: int) -> Problem:
    """The finger with a pair of foils, mirror images of each other."""
    legs, gauges = (Leg(10.0, steps=steps),), paper_gauges(length, 38.0)
    return build(FOIL.apply(fig9_model(NU, size, size, domain, legs=legs, gauges=gauges, friction=Coulomb(0.25))))


def strains(problem: Problem, mus: tuple[float, ...]) -> np.ndarray:
    """Free strain and what is read (m, 2) at the end of the press for every mu."""
    presses = [under(problem, mu)[-1].gauges for mu in mus]
    return np.array([(gauges["g_free"], gauges["g"]) for gauges in presses])


def run(quick: bool) -> Result:
    """Quick: two lengths, coarse meshes, no mesh in space."""
    rows = [*_plane_rows(quick), *(() if quick else _space_rows())]
    mus = MUS[3:6] if quick else MUS
    lengths = (1.0, 4.0) if quick else LENGTHS
    sizes: dict[Domain, float] = {"plane-strain": 4.0, "solid": 5.0} if quick else {"plane-strain": 1.0, "solid": 2.5}
    steps = 10 if quick else 160
    found, table = {}, []
    for domain, size in sizes.items():
        for length in lengths:
            value = strains(finger(domain, length, size, steps), mus)
            found[domain, length] = value
            slopes = np.gradient(value, np.array(mus), axis=0)
            for mu, (free, read), slope in zip(mus, value, slopes, strict=True):
                table.append((domain, length, mu, free, read, read / free, *slope, *(NOISE / np.abs(slope))))
    rows += _finger_rows(found, mus)
    for domain, size in sizes.items():
        half = strains(finger(domain, 4.0, size, steps // 2), mus)
        rows.append(_steps_row(domain, found[domain, 4.0], half, mus, steps))
    return Result(tuple(rows), exact_columns(COLUMNS, table), lambda figure: _draw(figure, found, np.array(mus)))


def _plane_rows(quick: bool) -> Iterator[Row]:
    foil = Foils(3000.0, 0.02, 0.15)  # 3 of 20 mm, on 1 mm
    for length in (1.0, 4.0, 10.0):
        got, wanted = alone(length, foil, 1.0, NU, 2), wing(length, 9.0, 1.0, NU)
        yield judged("read-in-plane", got, wanted, length=length)
    counts, free = (4, 8) if quick else (8, 16), wing(4.0, 9.0, 1.0, NU)
    yield judged("read-by-graded-mesh", _by_meshes(4.0, foil, NU, 2, counts), free)
    for below in DEPTHS[1:] if quick else DEPTHS:
        share = _by_meshes(4.0, foil, NU, 2, counts, 4.0 * below) / free
        yield judged("free-surface-in-plane", share, below=below)


def _space_rows() -> Iterator[Row]:
    foil, counts = Foils(3000.0, 0.02, 3.0), (2, 4)
    for length in (1.0, 4.0, 10.0):
        got, wanted = alone(length, foil, 1.0, 0.3, 3), _by_meshes(length, foil, 0.3, 3, counts)
        yield judged("read-in-space", got, wanted, length=length)
    endless = _by_meshes(4.0, foil, 0.3, 3, counts)
    for below in DEPTHS:
        share = _by_meshes(4.0, foil, 0.3, 3, counts, 4.0 * below) / endless
        yield judged("free-surface-in-space", share, below=below)


def _by_meshes(length: float, foil: Foils, nu: float, dim: int, counts: tuple[int, int], *below: float) -> float:
    """What is read over the free strain by two meshes alone, extrapolated in the spacing."""
    coarse, fine = (by_mesh(length, foil, 1.0, nu, dim, count, *below) for count in counts)
    return 2.0 * fine - coarse


def _finger_rows(found: dict[tuple[str, float], np.ndarray], mus: tuple[float, ...]) -> Iterator[Row]:
    """The paper against gauges of 4 mm: size of the slope at mu = 0.5, and its sign."""
    at = mus.index(0.5)
    for domain, name in (("plane-strain", "plane strain"), ("solid", "solid")):
        slopes = np.gradient(found[domain, 4.0], np.array(mus), axis=0)[at]
        for slope, what in zip(slopes, ("free strain", "as a foil of 4 mm reads it"), strict=True):
            yield judged("slope", float(np.log10(abs(slope) / SLOPE)), what=what, name=name)
            yield judged("error-of-mu", float(np.log10(NOISE / abs(slope) / 0.1)), what=what, name=name)
        strain = found[domain, 4.0][:, 1]
        rising = np.maximum(np.diff(strain), 0.0).sum() / np.abs(np.diff(strain)).sum()
        yield judged("the-strain-read-falls-as-mu", float(rising), name=name)


def _steps_row(domain: str, value: np.ndarray, half: np.ndarray, mus: tuple[float, ...], steps: int) -> Row:
    """What half as many increments change the slope at mu = 0.5 by, which is about the error that is left."""
    slope, other = (np.gradient(v[:, 1], np.array(mus))[mus.index(0.5)] for v in (value, half))
    return judged("slope-by-half-the-increments", other, slope, domain=domain, steps=steps)


def _draw(figure: Any, found: dict[tuple[str, float], np.ndarray], mus: np.ndarray) -> None:
    left, right = figure.subplots(1, 2)
    lengths = sorted({length for _, length in found})
    fine = np.geomspace(0.5, 12.0, 25)
    at = int(np.argmin(np.abs(mus - 0.5)))
    foils = {"plane-strain": (2, Foils(3000.0, 0.02, 0.15)), "solid": (3, Foils(3000.0, 0.02, 3.0))}
    for colour, (domain, (dim, foil)) in zip(("C0", "C1"), foils.items(), strict=True):
        name = domain.replace("-", " ")
        share = [100.0 * found[domain, n][at, 1] / found[domain, n][at, 0] for n in lengths]
        left.loglog(lengths, share, colour + "o", label=f"finger, {name}")
        left.loglog(fine, [100.0 * alone(n, foil, 1.0, NU, dim) for n in fine], colour + "-", lw=0.9)
        free, read = np.transpose([np.abs(np.gradient(found[domain, n], mus, axis=0)[at]) for n in lengths])
        right.loglog(lengths, free, colour + "--", label=f"free, {name}")
        right.loglog(lengths, read, colour + "-o", ms=3, label=f"read, {name}")
    plane = [100.0 * wing(n, 9.0, 1.0, NU) for n in fine]
    left.loglog(fine, plane, "k:", lw=1.2, label="Prandtl's equation")
    left.set(xlabel="length of the foil, mm", ylabel="read over free, %", title="lines: in an endless body")
    right.axhline(SLOPE, color="k", lw=0.8, label="implied by the paper")
    right.set(xlabel="length of the foil, mm", ylabel="|d strain / d mu|", title="slope at mu = 0.5", ylim=(1e-6, 0.3))
    for axes in (left, right):
        ticks_at(axes, lengths)
