"""Do presses at large deformation with all free faces in contact agree with CalculiX, and how much faster are they?

Blocks, a half cylinder and the Fig. 9 finger are pressed by a flat plate, in plane strain and as solids, for three nu
and three mu.  Walls and ends belong to the contact in both programs, and roll onto the plate where they do.  Both use
the same quadratic mesh and the law W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2.  CalculiX (calculix-ccx 2.20) has
a surface-to-surface penalty, 100 MPa/mm and 40 MPa/mm of friction, finger3d multipliers at the vertices.  The time is
that of meshing and pressing here, and that of the whole program there, on one thread of the same machine.  Where
CalculiX is not installed, and in the quick version, the forces are compared with those that it gave for this study.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from finger3d.analyses.calculix.deck import Contact
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import Design
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Domain, Leg, MeshOptions, Model
from finger3d.mechanics.results.history import measure

from ._ccx import program
from ._ccx import run as run_calculix
from ._press import fig9_finger
from ._rows import Result, Row, at_least

LABELS = {2: ("contact", "walls"), 3: ("contact", "walls", "ends")}
PENALTY, STICK = 100.0, 40.0
NU, MU = (0.3, 0.4, 0.45), (0.0, 0.25, 1.0)
REASON = "two formulations of contact, penalty and multipliers; 1.1 % or less measured"
LIMIT_S = 900.0


@dataclass(frozen=True)
class Case:
    """A press: body, domain, constants, depth and edge lengths (mm), and the force (N) that CalculiX 2.20 gave."""

    name: str
    body: Design
    domain: Domain
    nu: float
    mu: float
    depth: float
    size: float
    kept: float
    is_timed: bool = False

    @property
    def what(self) -> str:
        """The case in words."""
        return f"{self.name}, {self.domain}, nu = {self.nu:g}, mu = {self.mu:g}, {self.depth:g} mm"

    def model(self) -> Model:
        """The model of this program."""
        mesh, legs = MeshOptions(self.size, 2.0 * self.size, "swept"), (Leg(self.depth, steps=10),)
        material, friction = Isotropic(1.0, self.nu), Coulomb(self.mu)
        return Effect().apply(Model(self.body, material, mesh, legs, friction=friction, domain=self.domain))


_BLOCK_N = (4.482234, 4.517796, 4.517418, 5.385558, 5.63335, 5.629454, 6.166706, 6.734432, 6.76554)
_CYLINDER_N = (6.245192, 6.48522, 6.52479, 8.715404, 8.715928, 8.702082, 11.742226, 11.934856, 12.092736)


def cases(quick: bool) -> list[Case]:
    """Sections, then solids; the last is timed."""
    block, cylinder, short = [], [], []
    finger = fig9_finger()
    found = [
        Case(name, body, "plane-strain", nu, mu, depth, 0.7, force)
        for name, body, depth, forces in (
            ("block", block, 2.5, _BLOCK_N),
            ("half cylinder", cylinder, 3.5, _CYLINDER_N),
        )
        for (nu, mu), force in zip(product(NU, MU), forces, strict=True)
    ]
    if quick:
        return [found[4]]
    solid = ((0.3, 0.25, 28.318264), (0.45, 0.25, 31.8341), (0.4, 1.0, 30.612928), (0.4, 0.0, 29.016908))
    found += [Case("block", short, "solid", nu, mu, 2.5, 1.4, force) for nu, mu, force in solid]
    return [*found, Case("Fig. 9 finger", finger, "solid", 0.45, 0.25, 10.0, 4.0, 356.31476, is_timed=True)]


def run(quick: bool) -> Result:
    """Every case by both programs."""
    rows: list[Row] = []
    table: dict[str, list[Any]] = {
        key: []
        for key in "name domain nu mu depth_mm dofs calculix_N finger3d_N points_on_walls calculix_s ours_s".split()
    }
    for case in cases(quick):
        rows += _compared(case, quick, table)
    return Result(tuple(rows), table, lambda figure: _draw(figure, table))


def _compared(case: Case, quick: bool, table: dict[str, list[Any]]) -> Iterator[Row]:
    begin = time.perf_counter()
    problem = build(case.model())
    *_, end = march(problem)
    ours_s = time.perf_counter() - begin
    if not end.outcome.ok:
        raise AssertionError(f"{case.what}: {end.outcome}")
    force = measure(problem.points, end)["normal_force_N"]
    theirs, source = None, "CalculiX 2.20, same mesh and law, number kept"
    if not quick and program():
        contact = Contact(PENALTY, STICK, case.mu, LABELS[problem.mesh.dim])
        theirs = run_calculix(case.model(), contact, LIMIT_S)
        source = "CalculiX, same mesh and law, run for this"
    wanted = case.kept if theirs is None else theirs.force
    on_walls = np.count_nonzero(end.state.force[problem.points.face > 0, 0] > 0.0)
    values = (
        case.name, case.domain, case.nu, case.mu, case.depth, problem.mesh.points.size, wanted, force, on_walls,
        theirs.wall if theirs else np.nan, ours_s,
    )  # fmt: skip
    for key, value in zip(table, values, strict=True):
        table[key].append(value)
    yield Row(f"force, {case.what}, N", source, wanted, force, 0.012, REASON, "validation")
    if case.is_timed and theirs:
        what = f"time of CalculiX over finger3d's, {case.what}, {problem.mesh.points.size} displacements"
        yield at_least(what, "goal of this project", 30.0, theirs.wall / ours_s, kind="statement")


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    left, right = figure.subplots(1, 2)
    error = 100.0 * (np.array(table["finger3d_N"]) / np.array(table["calculix_N"]) - 1.0)
    bodies = [f"{name}, {domain}" for name, domain in zip(table["name"], table["domain"], strict=True)]
    for k, body in enumerate(dict.fromkeys(bodies)):
        own = np.array([b == body for b in bodies])
        for axes, key in ((left, "nu"), (right, "mu")):
            axes.plot(np.array(table[key])[own], error[own], f"C{k}o", mfc="none", label=body)
    for axes, key in ((left, "nu"), (right, "mu")):
        axes.axhspan(-1.0, 1.0, color="0.92", label="1 %")
        axes.axhline(0.0, color="k", lw=0.6)
        axes.set(xlabel=key, ylabel="force of finger3d over CalculiX's - 1, %", ylim=(-2.0, 2.0))
