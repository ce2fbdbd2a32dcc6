"""Do the forces of presses agree with those of CalculiX, an independent code, on the same meshes?

Source: CalculiX 2.20 (Debian: calculix-ccx; validation/REFERENCES.md, 6.5).  First decks that are exported, then
presses at large deformation with all free faces in contact, then the finger of Fig. 9 as half a section.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import finger3d
from finger3d._types import Tree
from finger3d.analyses.calculix import Contact
from finger3d.contact.friction import Coulomb
from finger3d.effects.large_deformation import Effect
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.model import Leg, MeshOptions, Model
from finger3d.scene import Scene, scene_of

from ._ccx import INSTALL, program
from ._ccx import run as run_calculix
from ._press import converged, fig9_model
from ._rows import Result, Row, exact_columns, given, grouped, listed, together

judged = listed(__file__)

TOLERANCE = 0.01
LIMIT_S_DECKS = 1200.0
DECKS = given(__file__)
"""Tables that all scenes have, those of both fingers, and cases: keys, and the force (N) along -y of CalculiX 2.20."""


def deck_scene(case: Tree) -> Scene:
    """Return the scene of a case."""
    return scene_of(DECKS["all"] | DECKS[case.get("finger", "block")], case["keys"])


def _decks(quick: bool) -> Result:
    """Does CalculiX find the forces of a press in the deck that `finger3d export --solver calculix` writes of it?

    Sections and solids on a cylinder, a ball, a rounded wedge, a wave and a plane are pressed, slid and released,
    in small strain and at large deformation with every law, with one material and with two. The deck has the mesh,
    the materials, the object and the path of the scene; the contact is CalculiX's surface to surface penalty,
    finger3d's multipliers. CalculiX (calculix-ccx 2.20) runs only where it is installed; otherwise, and in the
    quick version, the forces are compared with those that it gave for this study; the quick version has the first
    three.

    Every case by this code, and by CalculiX where it is installed; quick: against the numbers kept.
    """
    runs = not quick and program() is not None
    if not quick and not runs:
        print(f"calculix_forces: ccx is not installed ({INSTALL}); the numbers kept stay", file=sys.stderr)
    source = "run for this" if runs else "2.20, number kept"
    lines = []
    for case in DECKS["case"][:3] if quick else DECKS["case"]:
        scene = deck_scene(case)
        ours = finger3d.press(scene.with_effects(scene.fixed_effects), error=False).last.normal_force_N
        theirs = run_calculix(scene.model(), LIMIT_S_DECKS).force if runs else case["kept_N"]
        lines.append((case["name"], theirs, ours))
    rows = [judged("force-by-deck", ours, theirs, TOLERANCE, name=name, source=source) for name, theirs, ours in lines]
    table = exact_columns("case calculix_N finger3d_N", lines)
    return Result(tuple(rows), table, lambda figure: _draw_decks(figure, table))


def _draw_decks(figure: Any, table: dict[str, list[Any]]) -> None:
    """Differences of the forces."""
    axes = figure.subplots()
    off = [100.0 * (o / t - 1.0) for o, t in zip(table["finger3d_N"], table["calculix_N"], strict=True)]
    axes.axvspan(-100.0 * TOLERANCE, 100.0 * TOLERANCE, color="0.92", label="tolerance: 1 %")
    axes.axvline(0.0, color="k", lw=0.6)
    axes.plot(off, range(len(off)), "o")
    axes.set_yticks(range(len(off)), table["case"], fontsize=8)
    axes.invert_yaxis()
    axes.set(xlabel="force, finger3d over CalculiX - 1, %", xlim=(-1.5, 1.5))


LABELS = {2: ("contact", "walls"), 3: ("contact", "walls", "ends")}
PENALTY_FACES, STICK_FACES = 100.0, 40.0
LIMIT_S_FACES = 900.0


class Press(NamedTuple):
    """A press: its body, domain, depth and edge length (mm), constants, and the force (N) that CalculiX 2.20 gave."""

    given: Tree
    nu: float
    mu: float
    kept: float

    @property
    def what(self) -> str:
        """The case in words."""
        given = self.given
        return f"{given['name']}, {given['domain']}, nu = {self.nu:g}, mu = {self.mu:g}, {given['depth_mm']:g} mm"

    def model(self) -> Model:
        """The model of this program."""
        given, size = self.given, self.given["size_mm"]
        body = designs()[given["geometry"]](**given["finger"])
        mesh, legs = MeshOptions(size, 2.0 * size, "swept"), (Leg(given["depth_mm"], steps=10),)
        material, friction = Isotropic(1.0, self.nu), Coulomb(self.mu)
        return Effect().apply(Model(body, material, mesh, legs, friction=friction, domain=given["domain"]))


def cases(quick: bool) -> list[Press]:
    """Sections, then solids; quick: one section."""
    found = [Press(body, *case) for body in DECKS["press"] for case in body["cases"]]
    return [found[4]] if quick else found


def _faces(quick: bool) -> Result:
    """Do presses at large deformation with all free faces in contact agree with CalculiX, and how much faster are
    they?

    Blocks, a half cylinder and the Fig. 9 finger are pressed by a flat plate, in plane strain and as solids, for
    three nu and three mu. Walls and ends belong to the contact in both programs, and roll onto the plate where they
    do. Both use the same quadratic mesh and the law W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2. CalculiX
    (calculix-ccx 2.20) has a surface-to-surface penalty, 100 MPa/mm and 40 MPa/mm of friction, finger3d multipliers
    at the vertices. The time is that of meshing and pressing here, and that of the whole program there, on one
    thread of the same machine. Where CalculiX is not installed, and in the quick version, the forces are compared
    with those that it gave for this study.

    Every case by both programs.
    """
    lines: list[tuple[Any, ...]] = []
    rows = [row for case in cases(quick) for row in _compared(case, quick, lines)]
    names = "name domain nu mu depth_mm dofs calculix_N finger3d_N points_on_walls calculix_s ours_s"
    table = exact_columns(names, lines)
    return Result(tuple(rows), table, lambda figure: _draw_faces(figure, table))


def _compared(case: Press, quick: bool, lines: list[tuple[Any, ...]]) -> Iterator[Row]:
    begin = time.perf_counter()
    problem = build(case.model())
    end = converged(problem)[-1]
    ours_s = time.perf_counter() - begin
    force = measure(problem.points, end)["normal_force_N"]
    theirs, source = None, "CalculiX 2.20, same mesh and law, number kept"
    if not quick and program():
        contact = Contact(PENALTY_FACES, STICK_FACES, case.mu, LABELS[problem.mesh.dim])
        theirs = run_calculix(case.model(), LIMIT_S_FACES, contact)
        source = "CalculiX, same mesh and law, run for this"
    wanted = case.kept if theirs is None else theirs.force
    on_walls = np.count_nonzero(end.state.force[problem.points.face > 0, 0] > 0.0)
    name, domain, depth = (case.given[key] for key in ("name", "domain", "depth_mm"))
    unknowns = problem.mesh.points.size
    lines.append(
        (
            name,
            domain,
            case.nu,
            case.mu,
            depth,
            unknowns,
            wanted,
            force,
            on_walls,
            theirs.wall if theirs else np.nan,
            ours_s,
        )
    )
    yield judged("force-on-all-faces", force, wanted, what=case.what, source=source)
    if "is_timed" in case.given and theirs:
        yield judged("time-of-calculix", theirs.wall / ours_s, what=case.what, unknowns=unknowns)


def _draw_faces(figure: Any, table: dict[str, list[Any]]) -> None:
    left, right = figure.subplots(1, 2)
    for k, ((name, domain), t) in enumerate(grouped(table, "name", "domain")):
        error = 100.0 * (t["finger3d_N"] / t["calculix_N"] - 1.0)
        for axes, key in ((left, "nu"), (right, "mu")):
            axes.plot(t[key], error, f"C{k}o", mfc="none", label=f"{name}, {domain.replace('-', ' ')}")
    for axes, key in ((left, "nu"), (right, "mu")):
        axes.axhspan(-1.0, 1.0, color="0.92", label="1 %")
        axes.axhline(0.0, color="k", lw=0.6)
        axes.set(xlabel=key, ylabel="force of finger3d over CalculiX's - 1, %", ylim=(-2.0, 2.0))


WIDTH = 20.0
DEPTHS = (5.0, 10.0)
KEPT = {4.0: (8.81694, 28.5524), 2.0: (8.80263, 28.4931)}
"""N per mm at DEPTHS by mesh, CalculiX 2.20: this study in full."""

PENALTY_SECTION = 100.0  # MPa/mm: under 1 MPa the surfaces overlap by 0.01 mm, 1e-3 of the depth
STICK_SECTION = 10.0  # MPa/mm: friction of 0.1 MPa takes 0.01 mm; ten times as stiff, CalculiX does not settle


def _section(quick: bool) -> Result:
    """Does a press at large deformation agree with CalculiX, an independent code?

    The Fig. 9 finger in plane strain, nu = 0.45, mu = 0.25, is pressed 10 mm by a flat plate. Both codes use the
    same mesh of quadratic triangles and the same law, W = G/2 (J^(-2/3) I1 - 3) + K/2 (J - 1)^2 (*HYPERELASTIC, NEO
    HOOKE with D1 = 2/K; *STATIC with NLGEOM), and each its own contact: CalculiX a face-to-face penalty with
    friction (100 and 10 MPa/mm), finger3d multipliers at the vertices. CalculiX runs only where it is installed
    (Debian: calculix-ccx). Otherwise, and in the quick version, the force is compared with the one that CalculiX
    2.20 gave for this study (validation/REFERENCES.md, 6.5), and the rows say so.

    Meshes of 4 and 2 mm; quick: of 4 mm, against the number kept.
    """
    rows, lines, curves = [], [], {}
    for size in list(KEPT)[:1] if quick else KEPT:
        legs = (Leg(DEPTHS[-1], steps=10),)
        model = Effect().apply(fig9_model(0.45, size, 4.0 * size, "plane-strain", legs=legs, friction=Coulomb(0.25)))
        body = build(model)
        frames = [(f.target.depth_mm, measure(body.points, f)["normal_force_N"] / WIDTH) for f in converged(body)]
        curves[size] = np.array(frames)
        other, source = np.array(KEPT[size]), "CalculiX 2.20, same mesh and law, numbers kept"
        if not quick and program():
            slow = replace(model, legs=tuple(Leg(depth, steps=4) for depth in DEPTHS))
            answer = run_calculix(slow, LIMIT_S_FACES, Contact(PENALTY_SECTION, STICK_SECTION, 0.25))
            other, source = answer.forces[:, 1] / WIDTH, "CalculiX, same mesh and law, run for this"
        for depth, theirs in zip(DEPTHS, other, strict=True):
            ours = float(np.interp(depth, *curves[size].T))
            lines.append((size, depth, float(theirs), ours))
            rows.append(judged("force-of-section", ours, theirs, depth=depth, size=size, source=source))
    table = exact_columns("size_mm depth_mm calculix finger3d", lines)
    return Result(tuple(rows), table, lambda figure: _draw_section(figure, curves, table))


def _draw_section(figure: Any, curves: dict[float, np.ndarray], table: dict[str, list[Any]]) -> None:
    left, right = figure.subplots(1, 2)
    for k, (size, t) in enumerate(grouped(table, "size_mm")):
        left.plot(*curves[size].T, f"C{k}-", label=f"finger3d, mesh of {size:g} mm")
        left.plot(t["depth_mm"], t["calculix"], f"C{k}o", mfc="none", label=f"CalculiX, mesh of {size:g} mm")
        right.plot(
            t["depth_mm"], 100.0 * (t["finger3d"] / t["calculix"] - 1.0), f"C{k}o-", label=f"mesh of {size:g} mm"
        )
    left.set(xlabel="depth, mm", ylabel="force, N per mm width")
    right.set(xlabel="depth, mm", ylabel="finger3d over CalculiX - 1, %", ylim=(-2.5, 2.5))
    right.axhspan(-2.0, 2.0, color="0.92", label="tolerance: 2 %")
    right.axhline(0.0, color="k", lw=0.6)


def run(quick: bool) -> Result:
    """Exported decks, all faces in contact, and half a section."""
    return together((10.0, 13.5), decks=_decks(quick), faces=_faces(quick), section=_section(quick))
