"""How does the half cylinder deform under 1 mm, and how much of that hangs on the Poisson's ratio that is not given?

Source: Maeno 2004, Fig. 2 and Sec. II-A: R = 5 mm, E = 1 MPa, plane stress, base held, 1 mm in 10 increments, mu =
0.25. The text gives no number for Fig. 2 and no Poisson's ratio, which implies that it does not matter.  How much it
does is measured here, in plane stress and in plane strain.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.fem.mesh.simplex import unfold

from ._paper import STRAIN, STRESS, Profile, half_cylinder, moved, said
from ._press import under
from ._rows import Result, Row, columns, zero

CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
DRAWN = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))


def run(quick: bool) -> Result:
    """Every case at 1 mm; the force is judged by a mesh twice as fine."""
    size = 0.2 if quick else 0.05
    found, lines, rows = {}, [], []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        frame = under(problem, 0.25)[-1]
        profile = Profile.of(problem, frame)
        found[plane, nu] = (problem, frame, profile)
        widest = np.abs((moved(problem, frame) + problem.mesh.points)[:, 0]).max()
        lines.append((plane, nu, profile.force, profile.a, profile.deformed, profile.c, widest))
    for plane, nu in DRAWN:
        other = half_cylinder(nu, plane, size / 2.0)
        fine = Profile.of(other, under(other, 0.25)[-1]).force
        rows.append(
            Row(
                f"force at 1 mm, N per mm, {plane}, nu = {nu:g}", "this code, edges half as long", fine,
                found[plane, nu][2].force, 0.004 if quick else 0.002, "mesh: the corners of the base are singular",
            )
        )  # fmt: skip
    problem, frame, profile = found[STRESS, 0.3]
    gap = np.abs(frame.state.gap[frame.state.status != 0]).max()
    what = "distance of the contact from the plate, mm"
    rows.append(zero(what, "Eq. 2", gap, 1e-8, "solver tolerance"))
    for plane in (STRESS, STRAIN):
        for what, key in (("force", "force"), ("contact half-width at rest", "a"), ("stick half-width", "c")):
            low, high = (getattr(found[plane, nu][2], key) for nu in (0.3, 0.49))
            rows.append(
                said(
                    f"nu need not be told: {what} at nu = .49 is that at .3, {plane}", "gives no nu", low, high,
                    "10 % would be read off a figure", 0.1,
                )
            )  # fmt: skip
    names = "plane nu force_N_per_mm a_mm a_deformed_mm c_mm widest_half_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw(figure, found))


def _draw(figure: Any, found: dict[Any, Any]) -> None:
    from matplotlib.collections import PolyCollection

    figure.set_size_inches(12.0, 3.4)
    panels = figure.subplots(1, 3, sharey=True)
    figure.suptitle("Pressed 1 mm, mu = .25; grey: at rest, red: the plate")
    for axes, (plane, nu) in zip(panels, DRAWN, strict=True):
        problem, frame, profile = found[plane, nu]
        mesh, parent, sign = unfold(problem.mesh, (0,))
        now = mesh.points + moved(problem, frame)[parent] * sign
        cells = list(now[mesh.cells[:, [0, 3, 1, 4, 2, 5]]])
        axes.add_collection(PolyCollection(cells, facecolor="#e9eef5", edgecolor="#8296ad", lw=0.2))
        t = np.linspace(0.0, np.pi, 200)
        axes.plot(5 * np.cos(t), 5 * np.sin(t), color="#999999", lw=0.8)
        axes.axhline(4.0, color="#c0392b", lw=1.2)
        axes.set(xlim=(-5.8, 5.8), ylim=(-0.3, 5.3), aspect="equal", xlabel="x (mm)")
        told = f"{profile.force:.2f} N/mm, contact {2 * profile.deformed:.2f} mm wide"
        axes.set_title(f"{plane}, nu = {nu:g}\n{told}")
    panels[0].set_ylabel("y (mm)")
