"""How many unknowns does a mesh graded towards a number save, and is the error then as small as the tolerance says?

The Fig. 9 finger (nu = 0.49, mu = 0.25, 10 mm) as a section and as a 20 mm wide solid: meshes refined in the zone that
leaves the largest error in the goal (`mesh.tolerance` with `mesh.goal`) beside meshes whose edges are four times as
long far from the contact as at it, from the results of cost_of_accuracy.  Truth is extrapolated from the four finest of
those with the order that fits them; for the gauge of the section, whose values do not fall monotonically, it is the
finest.  For the gauge of the solid they are too coarse: there, meshes with equal edges everywhere are compared, and
truth has edges of 1.5 mm everywhere but for those of 0.375 mm around the gauge and at the contact close to it.  The
true error of one such mesh may be small by chance, so that their error bars are compared with those of the graded
meshes, too: a bar is what tells a user that a mesh is fine enough.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import curve_fit

import finger3d
from finger3d.accuracy.estimate import discretisation, press_numbers
from finger3d.accuracy.refine import GOAL, refine_mesh
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, MeshOptions, Model

from ._cost_figure import series
from ._rows import Result, Row, columns, committed, listed

judged = listed(__file__)

FIG9 = Path(__file__).parents[1] / "geometries" / "fig9.toml"
STEPS = 10
GAUGE = "gauge_g36"
TOLERANCES = {("plane-strain", GOAL): (1e-2, 3e-3, 1e-3, 3e-4), ("solid", GOAL): (5e-3, 2e-3, 1.5e-3)}
TOLERANCES |= {("plane-strain", GAUGE): (3e-2, 1e-2, 4e-3), ("solid", GAUGE): (3e-2, 1.5e-2, 1e-2)}
EQUAL_EDGES = (4.0, 3.0, 2.0, 1.5, 1.25)
FINEST = MeshOptions(1.5, 1.5, "swept", gauge_refinement=4.0)
START: dict[str, tuple[float, float]] = {"plane-strain": (2.0, 8.0), "solid": (4.0, 16.0)}
COLUMN = {GOAL: "force", GAUGE: "gauge_strain"}
WANTED = 10.0
"""Unknowns of the other meshes over those of a graded mesh: a goal of this project for the solid."""
WAYS = {
    "equal grading": ("#2c5d8f", "o-", "edges 4 times as long at the base"),
    "equal edges": ("#1a9850", "^-", "equal edges everywhere"),
    "graded": ("#c0392b", "s-", "graded towards the number"),
}


class Mesh(NamedTuple):
    """A mesh and the error that it leaves in its goal, relative to the truth; `told` is its error bar, nan without."""

    domain: str
    goal: str
    way: str
    dofs: int
    value: float
    told: float
    error: float


def run(quick: bool) -> Result:
    """All goals; quick: the force of the section."""
    wanted = {("plane-strain", GOAL): (3e-3,)} if quick else TOLERANCES
    found = [mesh for (domain, goal), tolerances in wanted.items() for mesh in _meshes(domain, goal, tolerances)]
    names = "domain goal way dofs value estimate true_error"
    return Result(tuple(_rows(found)), columns(names, found), lambda figure: _draw(figure, found))


def _meshes(domain: Domain, goal: str, tolerances: tuple[float, ...]) -> Iterator[Mesh]:
    """Yield the meshes of equal grading or edges, then those graded towards the goal."""
    keys = f"press.steps={STEPS}", f"model.domain={domain}", "mesh.mesher=swept", "friction.mu=0.25", "material.nu=0.49"
    model = replace(finger3d.load(FIG9, keys).model(), mesh=MeshOptions(*START[domain], "swept"))
    if (domain, goal) == ("solid", GAUGE):
        truth = _value(build(replace(model, mesh=FINEST)), goal)
        for size in EQUAL_EDGES:
            yield _with_equal_edges(model, size, goal, truth)
    else:
        sizes, dofs, values = _uniform(domain, goal)
        truth = _extrapolated(sizes[-4:], values[-4:]) if goal == GOAL else float(values[-1])
        for n, value in zip(dofs, values, strict=True):
            yield Mesh(domain, goal, "equal grading", int(n), float(value), float("nan"), abs(value / truth - 1.0))
    for tolerance in tolerances:
        refined = refine_mesh(model, tolerance, goal=goal)
        assert refined.problem is not None, refined.stopped
        value = _value(refined.problem, goal)
        last = refined.rounds[-1]
        yield Mesh(domain, goal, "graded", last.dofs, value, last.error, abs(value / truth - 1.0))


def _with_equal_edges(model: Model, size: float, goal: str, truth: float) -> Mesh:
    """Return the mesh of the solid with edges of one length, mm, and the error bar of the goal there."""
    problem = build(replace(model, mesh=MeshOptions(size, size, "swept")))
    steps = list(march(problem))
    value = press_numbers(problem, steps[-1])[goal]
    bar = discretisation(problem, steps, numbers=press_numbers)[0].discretisation[goal]
    told, dofs = bar / abs(value), problem.body.stiffness.upper.shape[0]
    return Mesh(model.domain, goal, "equal edges", dofs, value, told, abs(value / truth - 1.0))


def _value(problem: Problem, goal: str) -> float:
    """Return the number of the press of a problem."""
    return press_numbers(problem, list(march(problem))[-1])[goal]


def _uniform(domain: str, goal: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return edge lengths, unknowns and values of the mixed elements of cost_of_accuracy, coarse to fine."""
    runs = [line for line in committed("cost_of_accuracy") if line["kind"] == "run"]
    chosen = series(runs, "section" if domain == "plane-strain" else "solid")
    sizes, dofs, values = (np.array([run[key] for run in chosen]) for key in ("size_mm", "dofs", COLUMN[goal]))
    return sizes, dofs, values


def _extrapolated(sizes: np.ndarray, values: np.ndarray) -> float:
    """Return the limit x of ``x + c h^p`` fitted to values, with an order between 1 and 4."""
    scale = abs(values[-1])

    def value(size: np.ndarray, limit: float, factor: float, order: float) -> np.ndarray:
        return limit + factor * size**order

    start = [values[-1] / scale, (values[0] - values[-1]) / scale, 1.5]
    bounds = [-np.inf, -np.inf, 1.0], [np.inf, np.inf, 4.0]
    return float(curve_fit(value, sizes / sizes[0], values / scale, start, bounds=bounds)[0][0] * scale)


def _rows(found: list[Mesh]) -> Iterator[Row]:
    for domain, goal in dict.fromkeys((mesh.domain, mesh.goal) for mesh in found):
        some = [mesh for mesh in found if (mesh.domain, mesh.goal) == (domain, goal)]
        equal = [mesh for mesh in some if mesh.way != "graded"]
        for mesh in (mesh for mesh in some if mesh.way == "graded"):
            name = f"{goal}, {domain}, {mesh.dofs} unknowns"
            yield judged("true-error-over-the-estimate", mesh.error / mesh.told, name=name)
            # an error may be small by chance: the bar of the graded mesh counts, and no finer mesh may exceed it
            large = [other.dofs for other in equal if other.error > max(mesh.error, mesh.told)]
            enough = [other.dofs for other in equal if other.dofs > max(large, default=0)]
            ratio = min(enough, default=equal[-1].dofs) / mesh.dofs
            yield judged("unknowns-of-for-an-error-below", ratio, WANTED, way=equal[0].way, name=name)
            if not any(np.isnan(other.told) for other in equal):
                enough = [other.dofs for other in equal if other.told <= mesh.told]
                ratio = min(enough, default=equal[-1].dofs) / mesh.dofs
                yield judged("unknowns-of", ratio, WANTED, way=equal[0].way, name=name)


def _draw(figure: Any, found: list[Mesh]) -> None:
    pairs = list(dict.fromkeys((mesh.domain, mesh.goal) for mesh in found))
    across = min(len(pairs), 2)
    down = -(-len(pairs) // across)
    figure.set_size_inches(5.4 * across, 4.2 * down)
    panels = np.ravel(figure.subplots(down, across, squeeze=False))
    titles = {GOAL: "normal force", GAUGE: "strain of the gauge"}
    for axes, (domain, goal) in zip(panels, pairs, strict=True):
        for way, (colour, marker, label) in WAYS.items():
            some = [mesh for mesh in found if (mesh.domain, mesh.goal, mesh.way) == (domain, goal, way)]
            if not some:
                continue
            axes.loglog([m.dofs for m in some], [100.0 * m.error for m in some], marker, color=colour, label=label)
            told = [m for m in some if not np.isnan(m.told)]
            if told:
                axes.loglog([m.dofs for m in told], [100.0 * m.told for m in told], marker[0], mfc="none", color=colour,
                            label="its error bar")  # fmt: skip
        axes.set(title=f"{titles[goal]}, {'section' if domain != 'solid' else 'solid 20 mm wide'}")
        axes.set(xlabel="unknowns", ylabel="error, %", xlim=(3e2, 6e5))
