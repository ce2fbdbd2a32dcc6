"""How do the two fingers of the paper deform, and how much of that hangs on the Poisson's ratio that is not given?

Source: Maeno 2004, Figs. 2 and 10: the half cylinder of R = 5 mm under 1 mm, and the finger of Fig. 9 under 10 mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from finger3d.fem.mesh import unfold
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import StepResult

from ._paper import CASES, SHOWN, STRAIN, STRESS, Profile, fig9, half_cylinder, moved, pressed, said
from ._rows import Result, Row, columns, listed, together

judged = listed(__file__)


def _r5(quick: bool) -> Result:
    """How does the half cylinder deform under 1 mm, and how much of that hangs on the Poisson's ratio that is not
    given?

    Source: Maeno 2004, Fig. 2 and Sec. II-A: R = 5 mm, E = 1 MPa, plane stress, base held, 1 mm in 10 increments,
    mu = 0.25. The text gives no number for Fig. 2 and no Poisson's ratio, which implies that it does not matter.
    How much it does is measured here, in plane stress and in plane strain.

    Every case at 1 mm; the force is judged by a mesh twice as fine.
    """
    size = 0.2 if quick else 0.05
    found, lines, rows = {}, [], []
    for plane, nu in CASES:
        problem = half_cylinder(nu, plane, size)
        frame = pressed(problem, 0.25)[-1]
        profile = Profile.of(problem, frame)
        found[plane, nu] = (problem, frame, profile)
        widest = np.abs((moved(problem, frame) + problem.mesh.points)[:, 0]).max()
        lines.append((plane, nu, profile.force, profile.a, profile.deformed, profile.c, widest))
    for plane, nu in SHOWN:
        other = half_cylinder(nu, plane, size / 2.0)
        fine = Profile.of(other, pressed(other, 0.25)[-1]).force
        allowed = 0.004 if quick else 0.002
        rows.append(judged("force-by-finer-mesh", found[plane, nu][2].force, fine, allowed, plane=plane, nu=nu))
    problem, frame, profile = found[STRESS, 0.3]
    gap = np.abs(frame.state.gap[frame.state.status != 0]).max()
    rows.append(judged("distance-from-the-plate", gap))
    for plane in (STRESS, STRAIN):
        for what, key in (("force", "force"), ("contact half-width at rest", "a"), ("stick half-width", "c")):
            low, high = (getattr(found[plane, nu][2], key) for nu in (0.3, 0.49))
            rows.append(said("nu-not-told-section", high, low, what=what, plane=plane))
    names = "plane nu force_N_per_mm a_mm a_deformed_mm c_mm widest_half_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_r5(figure, found))


def _draw_r5(figure: Any, found: dict[Any, Any]) -> None:
    panels = figure.subplots(1, 3, sharey=True)
    figure.suptitle("The half cylinder, pressed 1 mm, mu = .25; grey: at rest, red: the plate")
    for axes, (plane, nu) in zip(panels, SHOWN, strict=True):
        problem, frame, profile = found[plane, nu]
        _deformed(axes, problem, frame, 0.2)
        axes.set(xlim=(-5.8, 5.8), ylim=(-0.3, 5.3))
        told = f"{profile.force:.2f} N/mm, contact {2 * profile.deformed:.2f} mm wide"
        axes.set_title(f"{plane}, nu = {nu:g}\n{told}")
    panels[0].set_ylabel("y (mm)")


NUS = (0.0, 0.3, 0.4, 0.43, 0.45, 0.49, 0.5)
SHOWN_MU = (0.06, 0.25, 1.0)
DRAWN_FIG9 = (0.3, 0.43, 0.49)
SAID = (  # plane, nu, mu, 0: at rest, 1: as deformed
    (STRAIN, 0.3, 0.25, 1), (STRAIN, 0.43, 0.25, 1), (STRAIN, 0.45, 0.25, 1), (STRAIN, 0.49, 0.25, 1),
    (STRAIN, 0.49, 0.25, 0), (STRAIN, 0.49, 1.0, 0), (STRESS, 0.49, 0.25, 1),
)  # fmt: skip
WANTED = 79.0


def _fig9(quick: bool) -> Result:
    """Is the contact of the Fig. 9 finger about 79 mm wide at 10 mm, as the paper reads off its Fig. 10?

    Source: Maeno 2004, Fig. 10 and Sec. III-B: R = 100 mm, H = 36.6 mm, plane strain, 10 mm: "the contact width is
    approximately 79 mm". The paper gives neither nu nor mu of the figure nor the half length (50 mm here, as in
    geometries/fig9.toml). The width is measured in the undeformed and in the deformed state, for nu from 0 to 0.5
    and mu = 0.06, 0.25 and 1.

    Sections in both plane states; the width is judged by the distance of the points.
    """
    size = 3.0 if quick else 0.5
    widths, drawn, lines = {}, {}, []
    for plane in (STRAIN, STRESS):
        for nu in NUS:
            problem = fig9(nu, plane, size)
            for mu in SHOWN_MU:
                frame = pressed(problem, mu)[-1]
                profile = Profile.of(problem, frame)
                widths[plane, nu, mu] = (2.0 * profile.a, 2.0 * profile.deformed, 2.0 * profile.edge_error())
                lines.append((plane, nu, mu, profile.force, *widths[plane, nu, mu], 2.0 * profile.c))
                if plane == STRAIN and mu == 0.25 and nu in DRAWN_FIG9:
                    drawn[nu] = (problem, frame, profile)
    rows = [_said(*case, widths) for case in SAID]
    rows.append(_sensitivity(widths))
    names = "plane nu mu force_N_per_mm width_at_rest_mm width_deformed_mm error_mm stick_width_mm"
    return Result(tuple(rows), columns(names, lines), lambda figure: _draw_fig9(figure, drawn, widths))


def _said(plane: str, nu: float, mu: float, which: int, widths: dict[Any, tuple[float, ...]]) -> Row:
    where = f"{('at rest', 'as deformed')[which]}, mm, {plane}, nu = {nu:g}, mu = {mu:g}"
    got, error = widths[plane, nu, mu][which], widths[plane, nu, mu][2]
    return said("width-79-section", got, wanted=WANTED, tolerance=1.0 + error, where=where)


def _sensitivity(widths: dict[Any, tuple[float, ...]]) -> Row:
    """By how much mu moves the width, beside what nu does."""
    by_mu = np.ptp([widths[STRAIN, 0.49, mu][1] for mu in SHOWN_MU])
    by_nu = np.ptp([widths[STRAIN, nu, 0.25][1] for nu in NUS])
    return judged("width-by-mu-over-that-by-nu", by_mu / by_nu)


def _deformed(axes: Any, problem: Problem, frame: StepResult, lw: float) -> None:
    """Draw the deformed mesh and its mirror image, the outline at rest, and the plate."""
    from matplotlib.collections import PolyCollection

    mesh, parent, sign = unfold(problem.mesh, (0,))
    now = mesh.points + moved(problem, frame)[parent] * sign
    cells = list(now[mesh.cells[:, [0, 3, 1, 4, 2, 5]]])
    axes.add_collection(PolyCollection(cells, facecolor="#e9eef5", edgecolor="#8296ad", lw=lw))
    design = problem.model.design
    x = design.half_length_mm * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 201))
    axes.plot([x[0], *x, x[-1]], [0.0, *design.top(x, 0.0 * x), 0.0], color="#999999", lw=0.8)
    axes.axhline(design.height_mm - frame.target.depth_mm, color="#c0392b", lw=1.2)
    axes.set(aspect="equal", xlabel="x (mm)")


def _draw_fig9(figure: Any, drawn: dict[float, Any], widths: dict[Any, tuple[float, ...]]) -> None:
    figure.suptitle("The finger of Fig. 9, pressed 10 mm, mu = .25; grey: at rest, red: the plate")
    grid = figure.add_gridspec(2, 3, height_ratios=(1.0, 1.1))
    for column, nu in enumerate(DRAWN_FIG9):
        axes = figure.add_subplot(grid[0, column])
        problem, frame, profile = drawn[nu]
        _deformed(axes, problem, frame, 0.15)
        axes.set(xlim=(-62, 62), ylim=(-2, 54))
        told = f"{profile.force:.1f} N/mm, {2 * profile.deformed:.1f} mm"
        axes.set_title(f"plane strain, nu = {nu:g}: {told}")
    axes = figure.add_subplot(grid[1, :])
    for plane, style in ((STRAIN, "o-"), (STRESS, "s--")):
        for k, what in ((0, "at rest"), (1, "as deformed")):
            value = [widths[plane, nu, 0.25][k] for nu in NUS]
            axes.plot(NUS, value, style, ms=4, color=f"C{k}", label=f"{plane}, {what}")
    axes.axhline(WANTED, color="k", lw=0.8)
    axes.annotate("the paper: about 79 mm", (0.002, WANTED + 0.4), fontsize=9)
    axes.set(xlabel="Poisson's ratio (not given in the paper)", ylabel="contact width (mm)")
    axes.legend(frameon=False, fontsize=9)


def run(quick: bool) -> Result:
    """The half cylinder, then the finger of Fig. 9."""
    return together((13.0, 3.3, 6.2), r5=_r5(quick), fig9=_fig9(quick))
