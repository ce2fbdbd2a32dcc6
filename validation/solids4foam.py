"""Do three presses settle that stop early, or do not settle, in the tutorials of solids4foam, and where do they end?

Source: the tutorials rubberSealing, compressedSpheres and twistingHemisphere of solids4foam; REFERENCES.md, 6.7.

Seal: the hollow trapezoid of the tutorial, E = 1.267 MPa, nu = .49979, neo-Hookean, in plane strain, which there stops
at half of 2.2 mm in every formulation tried.  Here it is whole, not half of it, one layer of tetrahedra 1 mm wide whose
ends may not move along the width.  Inferred: its upper face does not slide, mu = 1000, but may lift off.  Its force has
a maximum at four fifths of the way and then falls in jumps: the seal buckles.  Where it jumps, and to which of several
states, depends on mesh and increments; on cells of three quarters of the length it does so at 1.7 mm, not at 1.85.

Spheres: two hollow half spheres of 10 to 12 and 12 to 14 mm, one in the other, E = 1 MPa, nu = .3, flattened by 10 mm
between planes, which there stops at 7.5 mm and diverges at 8.6.  Two soft bodies inside each other are beyond this
program, so the outer one is pressed alone; its rim is bonded, where the tutorial has a plane without friction.  It goes
all the way here.  After 7.5 mm its flat top snaps away from the plane and the force falls by a third; to find the state
after that takes thousands of iterations, in increments that are halved.  A later snap, near 10 mm, depends on the mesh.

Twist: a hollow half ball of radius 1 mm, E = 5 MPa, is pressed 1 mm into a cube of 2 mm, E = 1 MPa, nu = .3, with
mu = .5, and turned by 180 degrees; there 20 increments from stick to slip do not converge.  Here the ball is rigid.
Its force is larger for that; torque over force is compared.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float, Int
from finger3d.fem.mesh import Mesh, boundary, quadratic, signed_volumes
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import StepResult, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.meshing.mesh_files import write_mesh_vtu
from finger3d.scene import scene_of

from ._press import block_tables
from ._rows import Result, Row, Settled, columns, given, grouped, listed, settled

judged = listed(__file__)

GIVEN = given(__file__)
"""Tables of the scenes, and the right half of the seal: its corners, mm, and its blocks with the cells along their
sides, as in the tutorial."""

CORNERS = np.array(GIVEN["half_seal"]["corners"])
WIDTH = 1.0
"""Of the seal, mm."""
STOPS = {"seal": 0.5, "spheres": 0.75, "twist": 34.0 / 180.0}
"""Share of the way at which each stops there; of the twist, whose way is the turn, that up to which increments fail."""


@dataclass(frozen=True)
class Case:
    """Increments of a case, and the share of the way after each."""

    name: str
    share: Float
    steps: list[StepResult]
    numbers: list[dict[str, Any]]

    @property
    def good(self) -> list[StepResult]:
        """Those that converge."""
        return [step for step in self.steps if step.outcome.ok]

    @property
    def settled(self) -> Settled:
        """How many of how many converge, and their largest residual."""
        return Settled(len(self.good), len(self.share), max(step.residual for step in self.good))


def seal_mesh(coarser: float) -> Mesh:
    """Return the seal, of one layer of tetrahedra, with the cells of the tutorial or coarser ones."""
    sheet = np.concatenate(
        [_triangles(CORNERS[at], n / coarser, m / coarser) for at, n, m in GIVEN["half_seal"]["blocks"]]
    )
    both = np.concatenate([sheet, sheet * [-1.0, 1.0]]).reshape(-1, 2).round(9)
    flat, index = np.unique(both, axis=0, return_inverse=True)
    low, n = np.sort(index.reshape(-1, 3), axis=1), len(flat)
    points = np.vstack([np.column_stack([flat, np.full(n, z)]) for z in (-0.5 * WIDTH, 0.5 * WIDTH)])
    high = low + n  # a prism over each triangle, cut from its lowest to its highest number
    cells: Int = np.vstack([np.hstack([low[:, : k + 1], high[:, k:]]) for k in range(3)])
    turned = signed_volumes(Mesh(points, cells, {})) < 0.0
    cells[turned] = cells[turned][:, [0, 2, 1, 3]]
    facets = boundary(cells, 3)
    middle, top = points[facets].mean(axis=1), CORNERS[:, 1].max()
    ends = np.abs(middle[:, 2]) > 0.5 * WIDTH - 1e-9
    base, contact = (~ends & (np.abs(middle[:, 1] - y) < 1e-9) for y in (0.0, top))
    labels = {"contact": contact, "base": base, "ends": ends, "walls": ~(ends | base | contact)}
    return quadratic(Mesh(points, cells, {label: facets[which] for label, which in labels.items()}))


def _triangles(corners: Float, along: float, across: float) -> Float:
    """Return triangles (t, 3, 2) that fill a quadrilateral (4, 2) in rows."""
    s, t = (np.linspace(0.0, 1.0, max(1, round(count)) + 1) for count in (along, across))
    weights = np.stack([np.outer(1 - s, 1 - t), np.outer(s, 1 - t), np.outer(s, t), np.outer(1 - s, t)], axis=-1)
    grid = weights @ corners
    a, b, c, d = (
        grid[i : len(s) - 1 + i, j : len(t) - 1 + j].reshape(-1, 2) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
    )
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def seal(coarser: float, steps: int, folder: Path) -> Model:
    """Return the seal pressed by 2.2 mm."""
    path = folder / "seal.vtu"
    write_mesh_vtu(path, seal_mesh(coarser))
    more = {"finger": {"geometry": str(path)}, "press": {"depth_mm": 2.2, "steps": steps}}
    return replace(scene_of(GIVEN["seal"] | more).model(), held_ends=True)


def spheres(size: float, steps: int, folder: Path) -> Model:
    """Return the outer half sphere pressed by 10 mm."""
    from build123d import Rot, Sphere, export_step

    path = folder / "sphere.step"
    outer, inner = (Rot(-90, 0, 0) * Sphere(r, arc_size1=0, arc_size2=90, align=None) for r in (14.0, 12.0))
    export_step(outer - inner, str(path))
    more = {"finger": {"geometry": str(path), "up": "y"}, "mesh": {"size_mm": size, "base_size_mm": size}}
    return scene_of(GIVEN["spheres"] | more | {"press": {"depth_mm": 10.0, "steps": steps}}).model()


def twist(size: float, press: int, turn: int) -> Model:
    """Return the cube with the ball, pressed and turned."""
    legs = [{"depth_mm": 1.0, "steps": press}, {"depth_mm": 1.0, "turn_y_deg": 180.0, "steps": turn}]
    tables = block_tables((1.0, 2.0, 2.0), 1.0, 0.3, (size, 2.0 * size), press={"leg": legs}, **GIVEN["twist"])
    return scene_of(tables).model()


def solved(name: str, model: Model) -> Case:
    """Return the increments of a case, the last of which may have failed."""
    problem = build(model)
    steps = list(march(problem))
    count = sum(int(leg.steps) for leg in model.legs)
    numbers = [measure(problem.points, step) for step in steps if step.outcome.ok]
    first = int(model.legs[0].steps) if len(model.legs) > 1 else 0  # the way of the twist is its turn
    return Case(name, (np.arange(1, count + 1) - first) / (count - first), steps, numbers)


def run(quick: bool) -> Result:
    """Quick: the seal to its first half on coarser cells, and the twist in few increments."""
    with tempfile.TemporaryDirectory() as folder:
        if quick:
            cases = [solved("seal", seal(3.0, 10, Path(folder))), solved("twist", twist(0.5, 5, 9))]
        else:
            cases = [
                solved("seal", seal(2.0, 40, Path(folder))),
                solved("spheres", spheres(2.0, 100, Path(folder))),
                solved("twist", twist(0.2, 20, 45)),
            ]
    rows = [row for case in cases for row in _rows(case)]
    lines = [line for case in cases for line in _lines(case)]
    table = columns("case share depth_mm turn_deg normal_force_N torque_Nmm stick_ratio iterations residual", lines)
    return Result(tuple(rows), table, lambda figure: _draw(figure, table), settled([case.settled for case in cases]))


def _rows(case: Case) -> Iterator[Row]:
    yield judged("largest-residual", case.settled.residual or 0.0, name=case.name)
    last = case.steps[-1]
    ends = "" if last.outcome.ok else f"; ends there, {last.outcome}, {last.detail}"
    share = case.share[len(case.good) - 1]
    yield judged("share-of-the-way-that-settles", share, STOPS[case.name], name=case.name, ends=ends)
    if case.name == "seal":
        most = int(np.argmax([number["normal_force_N"] for number in case.numbers]))
        yield judged("share-of-the-way-at-which-the-force-is-largest", case.share[most], STOPS["seal"])
    if case.name == "twist":
        got = abs(case.numbers[-1]["moment_y_Nmm"]) / case.numbers[-1]["normal_force_N"]
        yield judged("torque-over-normal-force", got)


def _lines(case: Case) -> Iterator[tuple[Any, ...]]:
    for share, step, number in zip(case.share.tolist(), case.good, case.numbers, strict=False):
        pose = step.target
        yield (case.name, share, pose.depth_mm, float(np.degrees(pose.turn_y)), number["normal_force_N"],
               number["moment_y_Nmm"], number["stick_ratio_area"], step.iterations, step.residual)  # fmt: skip


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    figure.set_size_inches(12.0, 4.2)
    panels = figure.subplots(1, 3)
    titles = {"seal": "seal, plane strain, 1 mm wide", "spheres": "outer half sphere", "twist": "ball turned on a cube"}
    for axes, (name, t) in zip(panels, grouped(table, "case"), strict=False):
        turned = name == "twist"
        x, y = (t["turn_deg"], np.abs(t["torque_Nmm"])) if turned else (t["depth_mm"], t["normal_force_N"])
        axes.plot(x, y, "o-", ms=3, color="#2166ac", label="finger3d")
        there = STOPS[name] * {"seal": 2.2, "spheres": 10.0, "twist": 180.0}[name]
        what = "increments fail up to here" if turned else "stops here"
        axes.axvline(there, color="#b2182b", ls="--", lw=1.0, label=f"solids4foam: {what}")
        labels = ("turn (degrees)", "torque (N mm)") if turned else ("depth (mm)", "normal force (N)")
        axes.set(xlabel=labels[0], ylabel=labels[1], ylim=(0.0, 1.3 * float(np.max(y))))
        axes.set_title(titles[name])
        axes.legend(frameon=False, loc="upper left" if name == "spheres" else "lower right")
