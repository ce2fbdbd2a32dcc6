"""Are strips and discs bonded between plates as stiff as they should be, where rubber is stiff by its shape alone?

Source: the problem of Gent and Lindley 1959, with the values of validation/REFERENCES.md, 5.5: the apparent modulus
E_a/E = force x thickness/(area x approach x E) of a bonded strip (plane strain, half-width/thickness 1) and of a disc
(radius/(2 thickness) 1).

Expected rate: at the rim of the bond the displacement goes as r^e (Williams 1952, 90 degrees between a clamped and a
free side), so the force converges as h^(2e), 1.19 at nu = 1/2.  The value compared is extrapolated with that rate.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d._types import Float
from finger3d.fem.laws.material import Elasticity
from finger3d.fem.mesh.simplex import Mesh

from ._common import box, convergence, held_at, mapped, nodes_of, solve
from ._corner import clamped_free, extrapolated, observed
from ._rows import Result, Row, exact_columns

_WILLIAMS = "2e of the rim, Williams 1952; REFERENCES.md, 5.3"
_BOND = "Gent and Lindley 1959; REFERENCES.md, 5.5"
WANTED = {("strip", 0.5): 2.6695, ("strip", 0.49): 2.448, ("disc", 0.5): 2.955, ("disc", 0.49): 2.6337}


def strip(count: int) -> Mesh:
    """Quarter of the strip: half-width 1, half thickness 1/2, `count` square cells through that."""
    return mapped(box([np.linspace(0.0, 1.0, 2 * count + 1), np.linspace(0.0, 0.5, count + 1)]), lambda p: p)


def disc(count: int) -> Mesh:
    """Eighth of the disc: radius 1, half thickness 1/4, `count` cells (even) to half the radius."""
    side = np.linspace(0.0, 1.0, 2 * count + 1)

    def rounded(p: Float) -> Float:
        x, z = p[:, 0], p[:, 2]
        return np.stack([x * np.sqrt(1.0 - 0.5 * z**2), p[:, 1], z * np.sqrt(1.0 - 0.5 * x**2)], axis=1)

    return mapped(box([side, np.linspace(0.0, 0.25, count // 2 + 1), side]), rounded)


def apparent_modulus(mesh: Mesh, nu: float) -> float:
    """E_a / E from the force on the bonded face."""
    d = mesh.dim
    sides = {"x-": [0], "y-": [1], "y+": range(d)} | ({"z-": [2]} if d == 3 else {})
    bonded = nodes_of(mesh, "y+")
    value = np.zeros(mesh.points.shape)
    value[bonded, 1] = -1.0
    found = solve(mesh, Elasticity.of(1.0, nu), held_at(mesh, sides), value)
    area = 1.0 if d == 2 else np.pi / 4.0
    return float(-found.reaction[bonded, 1].sum() * mesh.points[:, 1].max() / area)


def run(quick: bool) -> Result:
    """Three sizes and more, uniform."""
    counts = {"strip": (8, 16, 32) if quick else (8, 16, 32, 64), "disc": (4, 6, 8) if quick else (4, 8, 12)}
    rows, table = [], []
    errors: dict[str, dict[str, list[float]]] = {"strip": {}, "disc": {}}
    for (body, nu), wanted in WANTED.items():
        if quick and (body, nu) == ("disc", 0.49):
            continue
        sizes = [1.0 / n for n in counts[body]]
        found = [apparent_modulus((strip if body == "strip" else disc)(n), nu) for n in counts[body]]
        theory = 2.0 * clamped_free(np.pi / 2, nu)
        limit = extrapolated(found[-2], found[-1], theory, sizes[-2] / sizes[-1])
        errors[body][f"nu = {nu:g}"] = [v / limit - 1.0 for v in found]
        table += [(body, nu, n, v) for n, v in zip(counts[body], found, strict=True)]
        why = (
            "the reference has four digits, and the last may be off by one"
            if body == "strip"
            else "the last digit of the reference and a coarser mesh"
        )
        rows.append(Row(f"E_a/E of a {body}, nu = {nu:g}", _BOND, wanted, limit, 5e-4, why))
        why = "on the coarsest mesh the smooth part of the error, of fourth order, still contributes"
        what, got = f"rate of E_a, {body}, nu = {nu:g}", observed(sizes, found)
        rows.append(Row(what, _WILLIAMS, theory, got, 0.05 if body == "strip" else 0.15, why, measure="absolute"))
    names = "body nu cells apparent_modulus_over_E"
    return Result(tuple(rows), exact_columns(names, table), lambda figure: draw(figure, counts, errors))


def draw(figure: Any, counts: dict[str, tuple[int, ...]], errors: dict[str, dict[str, list[float]]]) -> None:
    """Errors over the cell size."""
    for body, axes in zip(errors, figure.subplots(1, 2), strict=True):
        sizes = {"strip": 0.5, "disc": 0.5}[body] / np.array(counts[body])
        theory = 2.0 * clamped_free(np.pi / 2, 0.5)
        convergence(
            axes,
            sizes,
            errors[body],
            theory,
            "cell size / half-width (radius)",
            "E_a over its extrapolated value, less 1",
        )
        kind = "strip, plane strain, half-width/thickness 1" if body == "strip" else "disc, 3D, radius/(2 thickness) 1"
        axes.set_title(f"bonded {kind}")
