"""The two fingers of Maeno, Kawamura and Cheng 2004, strains along a line inside them, and the paper's statements.

What the text leaves open is set here and swept in the studies: Poisson's ratio is not given; the line of nodes below
the surface is drawn in Figs. 1 and 9 but not described, and is taken a tenth of the radius below the surface of the
half cylinder, and so deep under Fig. 9's that it passes (36, 40) mm.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from finger3d._types import Float
from finger3d.contact.friction import OPEN, STICK, Coulomb
from finger3d.fem.laws.material import Isotropic
from finger3d.fem.recovery import displacement
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, contact_table
from finger3d.mechanics.model import Gauge, Leg, MeshOptions, Model

from ._press import fig9_finger, under
from ._rows import listed

MUS = (0.06, 0.125, 0.25, 0.5, 1.0)
STRESS, STRAIN = "plane stress", "plane strain"
CASES = ((STRESS, 0.0), (STRESS, 0.3), (STRESS, 0.45), (STRESS, 0.49), (STRAIN, 0.3), (STRAIN, 0.45), (STRAIN, 0.49))
"""Plane states and Poisson's ratios of the half cylinder."""
SHOWN = ((STRESS, 0.3), (STRESS, 0.49), (STRAIN, 0.49))
"""Those that the figures show."""
BELOW_R5, BELOW_FIG9 = 0.5, 3.29  # mm under the surface, see above


def half_cylinder(nu: float, plane: str = STRESS, size: float = 0.1, gauges: Sequence[Gauge] = ()) -> Problem:
    """Section II: R = 5 mm, E = 1 MPa, pressed 1 mm in 10 increments; plane stress in the paper; 1 mm wide."""
    design = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    return _built(design, nu, plane, MeshOptions(size, max(0.5, size), "swept"), gauges, 1.0)


def fig9(
    nu: float, plane: str = STRAIN, size: float = 1.0, gauges: Sequence[Gauge] = (), radius: float = 100.0,
    edge: float = 36.6,
) -> Problem:  # fmt: skip
    """Section III: R = 100 mm, H = 36.6 mm, 100 mm long, pressed 10 mm; plane strain in the paper.

    A section is 1 mm wide, a solid 20 mm as the finger that was built.
    """
    design = fig9_finger(20.0 if plane == "solid" else 1.0, radius, edge)
    return _built(design, nu, plane, MeshOptions(size, 4.0 * size, "swept"), gauges, 10.0)


def _built(design: Any, nu: float, plane: str, mesh: MeshOptions, gauges: Sequence[Gauge], depth_mm: float) -> Problem:
    domain: Any = plane.replace(" ", "-")
    legs, law = (Leg(depth_mm, steps=10),), Coulomb(0.25)
    return build(Model(design, Isotropic(1.0, nu), mesh, legs, friction=law, gauges=tuple(gauges), domain=domain))


INCREMENTS = 320
"""Increments of a press of a section. In ten, the friction sum of plane stress is 4 % off, and the stick zone a quarter
too narrow."""


def pressed(problem: Problem, mu: float, count: int = 1) -> list[StepResult]:
    """Return `count` states of a press, evenly spaced, the last at full depth."""
    every = INCREMENTS // count
    return under(problem, mu, INCREMENTS)[every - 1 :: every]


@dataclass(frozen=True)
class Profile:
    """Tractions (MPa) on the finger along x (mm), ascending, in a section or at z = 0 of a solid; friction along +x.

    `area` (mm2) is that of the points of a section 1 mm wide; of a solid, that of a strip 1 mm wide about z = 0.
    """

    x: Float
    area: Float
    p: Float
    q: Float
    status: NDArray[np.int8]
    moved: Float

    @classmethod
    def of(cls, problem: Problem, frame: StepResult) -> Profile:
        """From a frame; `moved` is the displacement along x."""
        points = problem.points
        table = contact_table(points, frame)
        on = np.flatnonzero(np.abs(points.points[:, 2]) <= 1e-9)
        on = on[np.argsort(table["x_mm"][on])]
        along = np.zeros((len(points.points), points.dim))
        along[:, 1:] = frame.state.tangential_displacement
        columns = [np.asarray(table[k])[on] for k in ("x_mm", "area_mm2", "pressure_MPa", "shear_x_MPa")]
        if points.dim == 3:
            columns[1] = np.gradient(columns[0])
        return cls(*columns, frame.state.status[on], points.to_global(along)[on, 0])  # type: ignore[call-arg]

    @property
    def force(self) -> float:
        """Normal force (N) of a section, or of the strip about z = 0 of a solid."""
        return float(self.p @ self.area)

    @property
    def friction(self) -> float:
        """Sum of the friction forces (N), likewise."""
        return float(np.abs(self.q) @ self.area)

    @property
    def a(self) -> float:
        """Half-width of the contact at rest (mm): half way between the last point that touches and the next."""
        return self._edge(self.status != OPEN)

    @property
    def c(self) -> float:
        """Half-width of the stick zone (mm), likewise; 0 if the middle slips."""
        return self._edge(self.status == STICK)

    @property
    def deformed(self) -> float:
        """Half-width of the contact after the deformation, mm."""
        return self.a + float(np.interp(self.a, self.x, self.moved))

    @property
    def slips_at_edges_only(self) -> bool:
        """Whether one stick zone lies between two slip zones."""
        inside = self.status[self.status != OPEN]
        change = np.flatnonzero(np.diff((inside == STICK).astype(int)))
        return len(change) == 2 and inside[0] != STICK and inside[-1] != STICK

    def _edge(self, held: NDArray[np.bool_]) -> float:
        right = self.x >= 0.0
        if not (held & right).any():
            return 0.0
        last = np.flatnonzero(held & right).max()
        return float(0.5 * (self.x[last] + self.x[min(last + 1, len(self.x) - 1)]))

    def edge_error(self) -> float:
        """Half the distance of the points at the edge of the contact, mm."""
        return float(0.5 * np.median(np.diff(self.x[self.status != OPEN])))


def line(x: Float, design: Any, below: float) -> list[Gauge]:
    """Three gauges (0, 45, 90 degrees) at each x (n,), `below` mm under the surface."""
    y = design.top(x, np.zeros_like(x)) - below
    return _rosettes(x, y)


def line_r5(below: float = BELOW_R5, count: int = 45, reach: float = 4.4) -> tuple[Float, list[Gauge]]:
    """x (n,) and gauges along the line in the half cylinder: an arc about its centre, `below` mm under the surface."""
    t = np.linspace(-1.0, 1.0, count) * math.asin(reach / 5.0)
    radius = 5.0 - below
    x, y = radius * np.sin(t), radius * np.cos(t)
    return x, _rosettes(x, y)


def _rosettes(x: Float, y: Float) -> list[Gauge]:
    angles = (0.0, math.pi / 4, math.pi / 2)
    return [
        Gauge(f"{i}:{k}", float(a), float(b), angle=angle)
        for i, (a, b) in enumerate(zip(x, y, strict=True))
        for k, angle in enumerate(angles)
    ]


def strains(frame: StepResult, count: int, line: str = "", finite: bool = False) -> Float:
    """eps_x, eps_y, gamma_xy (3, n) of the `count` points of a line, whose gauges are named after it.

    At finite strain they are those of Green and Lagrange, as the three elongations give no shear otherwise.
    """
    read = np.array([[frame.gauges[f"{line}{i}:{k}"] for k in range(3)] for i in range(count)])
    along_x, slanted, along_y = (read + 0.5 * read**2).T if finite else read.T
    return np.array([along_x, along_y, 2.0 * slanted - along_x - along_y])


def moved(problem: Problem, frame: StepResult) -> Float:
    """Displacement (n, d) mm of the meshed part, recovered from the contact forces of a frame."""
    return displacement(problem.mesh, next(formulation_of(problem.model).unknowns(problem, [frame.meshed_state])))


said = listed(__file__)
"""Rows of the paper's statements, which _paper.toml lists."""


Drawn = tuple[str, str, str, Sequence[Mapping[str, Any]]]
"""Row of a grid of panels: its quantity, what that is drawn over, the title of its legend, and for every column the
places and values of the curves by label."""


def draw_grid(figure: Any, columns: Sequence[str], rows: Sequence[Drawn]) -> None:
    """Draw a grid of panels with titles above its columns."""
    from matplotlib import colormaps

    panels = figure.subplots(len(rows), len(columns), sharex="row", sharey="row", squeeze=False)
    explained = ""
    for line, (quantity, over, legend, cells) in zip(panels, rows, strict=True):
        for axes, curves in zip(line, cells, strict=True):
            for colour, (label, points) in zip(np.linspace(0.05, 0.85, len(curves)), curves.items(), strict=True):
                axes.plot(*points, color=colormaps["plasma"](colour), label=label)
            axes.axhline(0.0, color="#999999", lw=0.7)
            axes.set_xlabel(over)
        line[0].set_ylabel(quantity)
        if legend != explained:
            line[0].legend(title=legend, frameon=False)
        explained = legend
    for axes, title in zip(panels[0], columns, strict=True):
        axes.set_title(title)


NAMES_SHOWN = [f"{plane}, nu = {nu:g}" for plane, nu in SHOWN]


def draw_shown(figure: Any, quantities: Sequence[str], legend: str, curves: Mapping[Any, Mapping[str, Any]]) -> None:
    """Draw a column for each case of SHOWN and a row for each quantity.

    Parameters
    ----------
    quantities
        Labels of the rows.
    legend
        What the curves of a case differ by: depth or mu.
    curves
        By case and label: places x (mm) and the values of every quantity there.
    """
    cells = [
        [{label: (x, v[k]) for label, (x, *v) in curves[case].items()} for case in SHOWN]
        for k in range(len(quantities))
    ]
    draw_grid(figure, NAMES_SHOWN, [(q, "x (mm)", legend, row) for q, row in zip(quantities, cells, strict=True)])


def by_mu(values: Iterable[Any]) -> dict[str, Any]:
    """Return values for the coefficients of MUS by label."""
    return {f"{mu:g}": value for mu, value in zip(MUS, values, strict=True)}


def rows_by_mu(x: Float, profiles: Sequence[Any], strains: Mapping[str, Any], gauges: Sequence[Any]) -> list[Drawn]:
    """Return the rows of a grid whose columns are models.

    Parameters
    ----------
    profiles : for each model those of all coefficients, whose friction is drawn at x > 0
    strains : by name, for each model (mus, n) at x (n,)
    gauges : for each model strains (mus,) by angle
    """
    right = [by_mu((p.x[p.x >= 0.0], p.q[p.x >= 0.0]) for p in own) for own in profiles]
    inner = [(name, "x (mm)", "mu", [by_mu((x, v) for v in own) for own in of]) for name, of in strains.items()]
    read = [{f"{t}°": (MUS, own[t]) for t in (15, 30, 45, 60)} for own in gauges]
    rows = [("friction along x (MPa)", "x (mm)", "mu", right), *inner]
    return [*rows, ("gauge strain at x = 36 mm", "mu", "angle", read)]
