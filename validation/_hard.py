"""The hard cases of validation/REFERENCES.md, 8.1 and 8.2, one function each: is each handled as it should be?"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from finger3d._types import Tree
from finger3d.analyses.press import press
from finger3d.analyses.result import PressResult
from finger3d.contact.friction import OPEN, Coulomb, TwoCoefficients
from finger3d.contact.newton import uniqueness
from finger3d.contact.state import ContactState
from finger3d.errors import Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.objects import Plane
from finger3d.scene import scene_of

from ._common import free_motion, increment
from ._press import block_tables, changed
from ._rows import ROBUST, Row, at_least, at_most

POINT = "Klarbring 1990; REFERENCES.md, 8.1"
SCENE = block_tables(
    (10.0, 10.0, 10.0), 1.0, 0.3, (1.0, 3.0), friction={"mu": 0.25}, model={"domain": "plane-strain"},
    press={"depth_mm": 0.5, "steps": 2},
)  # fmt: skip


def rows(quick: bool) -> list[Row]:
    """All of them."""
    cases = (one_point, touch, corner, again, coarse_and_deep, edge, tilted)
    return [row for case in cases for row in case(quick)]


def _is(
    what: str, wanted: float, got: float, tolerance: float = 0.0, reason: str = "exactly", source: str = ROBUST
) -> Row:
    return Row(what, source, float(wanted), float(got), tolerance, reason, measure="absolute")


def _least(what: str, wanted: float, got: float, reason: str, source: str = ROBUST) -> Row:
    return at_least(what, source, float(wanted), float(got), reason)


def one_point(quick: bool) -> Iterator[Row]:
    """Coulomb at one point, K = [[1, .8], [.8, 2]] in (t, n): every admissible state by trying all of them."""
    compliance = np.linalg.inv(np.array([[2.0, 0.8], [0.8, 1.0]]))  # normal first
    loads = np.random.default_rng(0).normal(size=(150 if quick else 2000, 2))
    for mu, name in ((1.2, "below"), (2.0, "above")):
        several, unlisted = 0, 0
        for free in loads:
            answers = _admissible(compliance, free, mu)
            rest = ContactState.at_rest(np.zeros(1), 2)
            found = increment(rest, free[None], compliance.reshape(1, 2, 1, 2), mu, 1.0)
            several += len(answers) > 1
            near = [np.abs(found.state.force[0] - a).max() < 1e-8 for a in answers]
            unlisted += not (found.outcome.ok and any(near))
        what = f"one-point Coulomb, mu = {mu:g}, {name} the limit 1.25: of {len(loads)} random loads"
        yield _is(f"{what}, states returned that are not admissible", 0, unlisted, source=POINT)
        more = f"{what}, those with several answers"
        unique = _is(more, 0, several, source=POINT)
        yield unique if name == "below" else _least(more, 1, several, "some loads have several", POINT)
    at_limit = uniqueness(np.array([1.25]), compliance.reshape(1, 2, 2))
    yield _is("one-point Coulomb: mu |K_tt^-1 K_tn| at mu = 1.25", 1, at_limit, 1e-12, "round-off", POINT)


def _admissible(compliance: np.ndarray, load: np.ndarray, mu: float) -> list[np.ndarray]:
    """Forces (n, t) of all states that meet Eqs. (1)-(4) and oppose slip, by enumeration."""
    found = [np.zeros(2)] if load[0] >= 0.0 else []
    force = np.linalg.solve(compliance, -load)
    if force[0] > 0.0 and abs(force[1]) <= mu * force[0]:
        found.append(force)
    for sign in (1.0, -1.0):
        along = np.array([1.0, sign * mu])
        pull = compliance[0] @ along
        normal = -load[0] / pull if pull else -1.0
        if normal > 0.0 and sign * (load[1] + compliance[1] @ along * normal) < 0.0:
            found.append(normal * along)
    return found


def _block(nu: float, legs: tuple[Leg, ...], design: Any = None, mu: float = 0.25, **more: Any) -> Problem:
    body = design or designs()["block"](half_length_mm=10.0, height_mm=10.0, width_mm=1.0)
    mesh = MeshOptions(1.0, 3.0, "swept")
    return build(Model(body, Isotropic(1.0, nu), mesh, legs, friction=Coulomb(mu), domain="plane-strain", **more))


def touch(quick: bool) -> Iterator[Row]:
    """No point, one point, and all points at once."""
    arch = designs()["clipped_cylinder"](radius_mm=20.0, half_length_mm=10.0, edge_height_mm=5.0, width_mm=1.0)
    problem = _block(0.3, (Leg(1.0, steps=1),), arch)
    rest = ContactState.at_rest(problem.gap(problem.origin), 2)
    apart = increment(rest, free_motion(problem, problem.origin) + [1e-6, 0.0], problem.delassus, 0.25, 1.0)
    yield _is("no point touches: settled, without force", 0, np.abs(apart.state.force).max() + (not apart.outcome.ok))
    tiny = list(march(_block(0.3, (Leg(0.05, steps=40 if quick else 100), Leg(1.0, steps=2)), arch)))
    counts = [int((f.meshed_state.contact.status != OPEN).sum()) for f in tiny]
    before = sum(float(np.abs(f.meshed_state.contact.force).sum()) for f, n in zip(tiny, counts, strict=True) if not n)
    yield _is("approach in small steps: force before the first point touches, N", 0, before)
    yield _is("approach in small steps: points that touch first", 1, next(n for n in counts if n))
    yield _is("approach in small steps, then 1 mm: unsettled", 0, sum(not f.outcome.ok for f in tiny))
    for nu, mu in itertools.product(
        (0.0, 0.5) if quick else (0.0, 0.3, 0.5), (0.25, 1e6) if quick else (0.0, 0.25, 1e6)
    ):
        flat = list(march(_block(nu, (Leg(0.5, steps=2),), mu=mu)))
        opened = sum(int((f.state.status == OPEN).sum()) + (not f.outcome.ok) for f in flat)
        yield _is(f"flat on flat, nu = {nu:g}, mu = {mu:g}: points left open", 0, opened)


def corner(quick: bool) -> Iterator[Row]:
    """The contact grows to the finger's edge, and the press goes on."""
    arch = designs()["clipped_cylinder"](radius_mm=20.0, half_length_mm=10.0, edge_height_mm=10.0, width_mm=1.0)
    depths = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    for nu, mu in ((0.5, 0.25),) if quick else ((0.3, 0.25), (0.5, 0.25), (0.3, 1e6)):
        problem = _block(nu, tuple(Leg(d, steps=2) for d in depths), arch, mu)
        frames = list(march(problem))
        half = [measure(problem.points, f)["contact_half_length_mm"] for f in frames]
        last = int(np.argmax(problem.points.points[:, 0]))
        edge = [float(f.state.force[last, 0] / problem.points.area[last]) for f in frames]
        here = f"contact reaches the corner, nu = {nu:g}, mu = {mu:g}"
        yield _is(f"{here}: unsettled", 0, sum(not f.outcome.ok for f in frames))
        yield _is(f"{here}: half-length at last, mm", 10.0, min(half[-2:]), 1e-9, "the corner is at 10 mm")
        yield _least(f"{here}: growth of the edge pressure in the last increment", 0.0, edge[-1] - edge[-2], "it grows")


def again(quick: bool) -> Iterator[Row]:
    """Press, release, press again; and a kinetic ratio of .1 through press, slide, release."""
    arch = designs()["clipped_cylinder"](radius_mm=20.0, half_length_mm=10.0, edge_height_mm=5.0, width_mm=1.0)
    for nu in (0.3, 0.5):
        problem = _block(nu, (Leg(1.0, steps=5), Leg(0.0, steps=5), Leg(1.0, steps=5)), arch)
        frames = list(march(problem))
        first, rest, second = (frames[k].state.force for k in (4, 9, 14))
        yield _is(f"press, release, press again, nu = {nu:g}: force at rest, N", 0, np.abs(rest).max())
        apart = np.abs(second - first).max() / np.abs(first).max()
        yield _is(f"press, release, press again, nu = {nu:g}: change of forces", 0, apart, 1e-9, "round-off")
    for branch in ("keep", "paper"):
        legs = (Leg(1.0, steps=10), Leg(1.0, 1.5, steps=10), Leg(0.0, 1.5, steps=10))
        problem = _block(0.3, legs, arch)
        law = TwoCoefficients(0.25, 0.1, branch)  # type: ignore[arg-type]
        frames = list(march(changed(problem, friction=law)))
        yield _is(f"kinetic ratio .1, branch {branch}: unsettled of 30", 0, 30 - sum(f.outcome.ok for f in frames))


def coarse_and_deep(quick: bool) -> Iterator[Row]:
    """A mesh of a hundred tets, a press of most of the height, cells that are flat: a warning or a refusal."""
    deep = _pressed("press.depth_mm=8.0", "press.steps=4")
    yield _is("depth of 80 % of the height: settled", 1, deep.outcome.ok)
    yield _is("depth of 80 % of the height: told by its strains", 1, _warned(deep, "large for linear elasticity"))
    tets = _pressed('model.domain="solid"', "mesh.size_mm=3.0", "mesh.base_size_mm=5.0")
    cells = tets.summary()["mesh"]["cells"]
    yield at_most("coarse solid: tets", ROBUST, 150, cells, "about a hundred")
    yield _is(f"solid of {cells} tets: settled", 1, tets.outcome.ok)
    yield _is(f"solid of {cells} tets: warned of", 1, _warned(tets, "too few"))
    fine = _pressed('model.domain="solid"', "mesh.size_mm=1.5", "mesh.base_size_mm=3.0")
    ratio = tets.last.normal_force_N / fine.last.normal_force_N
    what = f"solid of {cells} tets: force over that of {fine.summary()['mesh']['cells']}"
    yield Row(what, ROBUST, 1, ratio, 0.1, "no garbage")
    refused = _refused("press.depth_mm=10.0")
    yield _is("depth of the whole height: refused in one line that names the key", 1, "press.depth_mm" in refused)
    thin = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=0.01, width_mm=20.0)
    try:
        _block(0.3, (Leg(1.0, steps=1),), thin)
        message = ""
    except Finger3dError as error:
        message = str(error)
    yield _is("sliver cells: refused, with what to choose", 1, "flatter" in message and "choose" in message)


def _pressed(*changes: str, **tables: Tree) -> PressResult:
    return press(scene_of(SCENE | tables, ["effects.auto=false", *changes]), error=False)


def _warned(result: PressResult, words: str) -> bool:
    summary = result.summary()
    return any(words in text for text in summary["warnings"] + summary["advice"])


def _refused(*changes: str, **tables: Tree) -> str:
    """The one line that a scene is refused with; empty if it is not, or in more lines."""
    try:
        scene_of(SCENE | tables, changes).model()
    except Finger3dError as error:
        return str(error) if "\n" not in str(error) else ""
    return ""


# a prism with its edge down: 45 degrees on either side of the line x = 0, y = 0
_PRISM = np.array([[0, 0, -9], [6, 6, -9], [-6, 6, -9], [0, 0, 9], [6, 6, 9], [-6, 6, 9]], dtype=float)
_FACES = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]


def edge(quick: bool) -> Iterator[Row]:
    """An STL object that touches at an edge, beside the wedge of the same surface."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "object.stl")
        trimesh.Trimesh(_PRISM, _FACES, process=False).export(file)
        # the edge is averaged over a hat, which must be low beside the depth of 0.5 mm
        objects = {"shape": "wedge", "angle_deg": 45.0}, {"shape": "mesh", "path": str(file)}
        both = [_pressed("mesh.size_mm=0.25", object=one) for one in objects]
    forces = [found.last.normal_force_N if found.outcome.ok else np.nan for found in both]
    yield Row("STL prism touching at its edge: force over that of the wedge", ROBUST, 1, forces[1] / forces[0], 1e-9,
              "the same surface")  # fmt: skip


def tilted(quick: bool) -> Iterator[Row]:
    """A plane tilted by 30 degrees."""
    steps = list(march(_block(0.3, (Leg(2.0, steps=4),), object=Plane(tilt=np.pi / 6.0))))
    touching = min(int((f.state.status != OPEN).sum()) for f in steps)
    yield _is("plane tilted by 30 degrees on a block's edge: unsettled", 0, sum(not f.outcome.ok for f in steps))
    yield _least("plane tilted by 30 degrees on a block's edge: points that touch", 1, touching, "found")
