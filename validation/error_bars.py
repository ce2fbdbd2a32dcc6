"""Does the true error of a press lie within twice its error bar in nine cases of ten, and is the bar of the right size?

Source: Becker and Rannacher 2001 for small strain; else Richardson 1911, with the order of Williams 1952.  Truth is the
finest mesh, or, for a cylinder on a half-plane, Hertz' length under the force found (Johnson 1985, sec. 4.2).  Two
meshes are so coarse that their companion would be the finer one; a ball on a block is meshed by pytetwild; of two soft
balls, both are meshed anew, and the truth, by pytetwild too, has edges no less than half as long.  nu = .45 was not
among the cases that the shares of finger3d.accuracy.adjoint_bars were chosen by.  The share is judged for every number
in each kind of mesh: sections in plane stress and plane strain, swept solids, and solids by pytetwild; apart at large
deformation.

Each full run draws other sections and solids, with a seed that its rows state, and judges them apart, since the factors
of the bars were chosen on the scenes that stay.  Increments are judged on drawn sections only, against 1280.  All bars
are those of finger3d.accuracy.estimate.estimate, as a press has them; a number without a bar counts as outside of it.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from finger3d.accuracy.estimate import estimate, press_numbers
from finger3d.analyses.study_rows import Result, Row
from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import SoftObject
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.fem.material import Isotropic
from finger3d.geometry.design import Design
from finger3d.geometry.registry import designs
from finger3d.io import AREAS, MAIN
from finger3d.mechanics.build import build
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model
from finger3d.mechanics.problem import Problem
from finger3d.mechanics.readings import Marker, Taxel
from finger3d.mechanics.solve import march
from finger3d.mechanics.step_halving import DISSIPATION_TOLERANCE, TOLERANCE, march_automatic
from finger3d.objects import Cylinder, Plane, Sphere

from ._drawn import drawn, drawn_solids
from ._paper import columns

MUS, DEPTHS = (0.125, 0.5), (1.0, 0.6)
SWEPT_MUS = (0.1, 0.125, 0.25, 0.5, 1.0)
"""Of swept solids: where stick ends along the width, and with it the error of friction, depends on it."""

ENERGIES, READINGS = ("external_work_mJ", "dissipation_mJ"), ("gauge", "marker", "taxel")
RESULTANTS = ("force", "moment", "tangential", "outward")
KINDS = (*MAIN, *AREAS, "contact_half_length_end_mm", *ENERGIES, *RESULTANTS, *READINGS)
CLAIM = "claim of finger3d for its error bars"
COLUMNS = "scene part dofs mu depth_mm number value estimate true_error"
NARROW = 2.5
"""Median of bar over true error that is aimed at: a wide bar asks for meshes that nobody needs."""
ROUND_OFF = 1e-9  # of the normal force: a number that is zero by symmetry
SEED = 2026
"""Of the quick form, whose scenes stay."""

ROUND = 1e-4  # of a number: a point that changes its state only in the truth
STEPS, TRUE_STEPS = (5, 10, 20, 40, 80), 1280
STEP_KINDS = ("normal_force_N", "friction_sum_N", "stick_half_length_mm", "gauge", "external_work_mJ", "dissipation_mJ")
MET = {
    "normal_force_N": TOLERANCE, "friction_sum_N": TOLERANCE, "gauge": TOLERANCE,
    "dissipation_mJ": DISSIPATION_TOLERANCE,
}  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A scene at some edge lengths (mm), and at the finest, which is its truth."""

    name: str
    model: Model
    sizes: tuple[float, ...]
    truth: float
    grading: float
    mus: tuple[float, ...] = MUS

    @property
    def meshes(self) -> str:
        """The kind of mesh, for each of which the share is judged."""
        domain, mesher = self.model.domain, self.model.mesh.mesher
        large = ", large deformation" if self.model.formulation.finite_strain else ""
        if domain != "solid":
            return f"section in {domain.replace('-', ' ')}{large}"
        return ("solid swept" if mesher == "swept" else "solid pytetwild") + large

    def at(self, size: float) -> Model:
        """The model at an edge length."""
        options = replace(self.model.mesh, size_mm=size, base_size_mm=self.grading * size)
        # the truth is structured where it can be, so that it is the same on every run
        structured = size == self.truth and self.model.design.section() is not None
        return replace(self.model, mesh=replace(options, mesher="swept") if structured else options)


@dataclass(frozen=True)
class Judged:
    """One number of one press: its estimate beside its true error."""

    scene: str
    part: str
    dofs: int
    mu: float
    depth_mm: float
    number: str
    value: float
    estimate: float
    error: float

    @property
    def kind(self) -> str:
        """Number's kind: all gauges are one, and so are markers, taxels and the components of a force."""
        first = self.number.partition("_")[0]
        return first if first in READINGS + RESULTANTS else self.number


def _model(
    design: Design, nu: float, domain: Domain, depth: float, gauges: tuple[Gauge, ...], rigid: Any = None,
    mesher: Any = "swept",
) -> Model:  # fmt: skip
    model = Model(
        design, Isotropic(1.0, nu), MeshOptions(1.0, 1.0, mesher), (Leg(depth, steps=10),),
        object=rigid or Plane(), gauges=gauges, domain=domain,
    )  # fmt: skip
    return _with_readings(model) if gauges else model


def _with_readings(model: Model) -> Model:
    """The model with two markers and two taxels beside its gauges."""
    high, wide = model.design.height_mm, model.design.width_mm
    markers = (Marker("m", 0.3 * high, 0.8 * high), Marker("n", 0.0, 0.5 * high))
    taxels = (Taxel("t", 0.0, 0.0, 0.2 * high, 0.5 * wide), Taxel("s", 0.4 * high, 0.0, 0.2 * high, 0.5 * wide))
    return replace(model, markers=markers, taxels=taxels)


def cases(quick: bool) -> list[Case]:
    """Sections and solids; quick: one of each, coarse."""
    near = (Gauge("a", 1.5, 4.0, angle=0.5), Gauge("b", 3.0, 3.0, angle=0.7), Gauge("c", 0.0, 3.5))
    far = (Gauge("a", 36.0, 40.0, angle=0.5), Gauge("b", 20.0, 44.0, angle=0.2), Gauge("c", 5.0, 40.0))
    half = designs()["half_cylinder"](radius_mm=5.0, width_mm=1.0)
    fig9 = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    if quick:
        return [
            Case("half cylinder", _model(half, 0.4, "plane-strain", 1.0, near), (0.4, 0.2), 0.1, 5.0),
            _coarsest(half, "plane-strain", near),
            Case("Fig. 9 solid", _model(fig9, 0.4, "solid", 10.0, far), (5.0,), 3.4, 4.0),
        ]
    out = []
    planes: tuple[Domain, ...] = ("plane-stress", "plane-strain")
    for nu in (0.3, 0.4, 0.49):
        for plane in planes:
            model = _model(half, nu, plane, 1.0, near)
            out.append(
                Case(f"half cylinder, {plane}, nu = {nu:g}", model, (0.56, 0.4, 0.28, 0.2, 0.14, 0.1), 0.025, 5.0)
            )
            model = _model(fig9, nu, plane, 10.0, far)
            out.append(Case(f"Fig. 9, {plane}, nu = {nu:g}", model, (5.6, 4.0, 2.8, 2.0, 1.4, 1.0), 0.3, 4.0))
    model = _model(half, 0.45, "plane-strain", 1.0, near)
    out.append(Case("half cylinder, plane-strain, nu = 0.45", model, (0.4, 0.2, 0.1), 0.025, 5.0))
    for nu in (0.3, 0.4, 0.49):
        model = _model(fig9, nu, "solid", 10.0, far)
        out.append(Case(f"Fig. 9, solid swept, nu = {nu:g}", model, (4.0, 2.8, 2.0), 1.0, 4.0, SWEPT_MUS))
    for nu in (0.4, 0.49):
        model = _model(fig9, nu, "solid", 10.0, far)
        wild = replace(model, mesh=replace(model.mesh, mesher="ftetwild"))
        out.append(Case(f"Fig. 9, solid pytetwild, nu = {nu:g}", wild, (4.0, 2.8), 1.1, 4.0))
    for nu in (0.4, 0.49):
        for plane in planes:
            model = LargeDeformation().apply(_model(half, nu, plane, 1.0, near))
            name = f"half cylinder, {plane}, large deformation, nu = {nu:g}"
            out.append(Case(name, model, (0.56, 0.4, 0.28, 0.2), 0.07, 5.0))
            model = LargeDeformation().apply(_model(fig9, nu, plane, 10.0, far))
            out.append(Case(f"Fig. 9, {plane}, large deformation, nu = {nu:g}", model, (5.6, 4.0, 2.8, 2.0), 0.7, 4.0))
    model = LargeDeformation().apply(_model(fig9, 0.4, "solid", 10.0, far))
    out.append(Case("Fig. 9, solid swept, large deformation, nu = 0.4", model, (4.0, 2.8), 1.7, 4.0))
    under = (Gauge("a", 0.5, 7.5, angle=0.5), Gauge("b", 0.0, 7.0))
    block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=16.0)
    model = _model(block, 0.4, "solid", 0.5, under, Sphere(radius_mm=10.0))
    wild = replace(model, mesh=replace(model.mesh, mesher="ftetwild"))
    out += [_coarsest(half, plane, near) for plane in planes]
    return [
        *out, Case("sphere on a block", model, (1.0, 0.7, 0.5), 0.3, 4.0), _line(block),
        *_round_objects(half, fig9, near, far),
        Case("sphere on a block, solid pytetwild", wild, (0.7, 0.5), 0.3, 10.0), _soft(),
    ]  # fmt: skip


def _coarsest(half: Any, plane: Domain, near: tuple[Gauge, ...]) -> Case:
    """Edges at the base as long as the finger is high: no mesh is coarser."""
    model = _model(half, 0.4, plane, 1.0, near)
    return Case(f"half cylinder, {plane}, coarsest", model, (3.0, 2.5), 0.1, 5.0 / 3.0)


def _soft() -> Case:
    """Two soft balls, that of the finger held on its cut; the coarser mesh is too small for a coarser companion."""
    ball = designs()["hemisphere"](radius_mm=8.0)
    model = _model(ball, 0.45, "solid", 1.0, (), Sphere(radius_mm=10.0), "ftetwild")
    model = replace(model, object_compliance=SoftObject(1.0, 0.45))
    return Case("two soft balls, solid pytetwild", model, (0.7, 0.5), 0.25, 8.0)


def _line(block: Any) -> Case:
    """A cylinder on a half-plane, as Hertz has it: far smaller a contact than the block."""
    wide = replace(block, half_length_mm=40.0, height_mm=40.0, width_mm=1.0)
    model = _model(wide, 0.4, "plane-strain", 0.2, (), Cylinder(radius_mm=10.0, axis="z"))
    return Case("Hertz, a line", model, (0.2, 0.14, 0.1, 0.07), 0.02, 100.0)


def _round_objects(half: Any, fig9: Any, near: tuple[Gauge, ...], far: tuple[Gauge, ...]) -> list[Case]:
    """Fingers on round bars and on a ball."""
    bar, small, large = (Cylinder(radius_mm=radius, axis="z") for radius in (40.0, 3.0, 8.0))
    return [
        Case("Fig. 9 on a bar", _model(fig9, 0.49, "plane-strain", 8.0, far, bar), (2.8, 2.0, 1.4, 1.0), 0.3, 4.0),
        Case(
            "half cylinder on a bar", _model(half, 0.4, "plane-strain", 0.8, near, small), (0.4, 0.28, 0.2), 0.025, 5.0
        ),
        Case(
            "half cylinder, wide bar", _model(half, 0.3, "plane-stress", 0.8, near, large), (0.4, 0.28, 0.2), 0.025, 5.0
        ),
        Case("Fig. 9 on a ball", _model(fig9, 0.4, "solid", 6.0, far, Sphere(radius_mm=40.0)), (2.8, 2.0), 1.1, 4.0),
    ]


def _runs(model: Model, mus: tuple[float, ...] = MUS) -> Iterator[tuple[float, float, Problem]]:
    for share in DEPTHS:
        legs = tuple(replace(leg, depth_mm=share * leg.depth_mm) for leg in model.legs)
        problem = build(replace(model, legs=legs))
        for mu in mus:
            yield mu, legs[0].depth_mm, replace(problem, model=replace(problem.model, friction=Coulomb(mu)))


def _end(problem: Problem) -> StepResult:
    return list(march(problem))[-1]


def _by_mesh(case: Case) -> list[Judged]:
    truth = [press_numbers(p, _end(p)) for _, _, p in _runs(case.at(case.truth), case.mus)]
    found = []
    for size in case.sizes:
        for (mu, depth, press), exact in zip(_runs(case.at(size), case.mus), truth, strict=True):
            right = {**exact, **_hertz(case, exact)}
            found += _judged(case.name, press, list(march(press)), mu, depth, right)
    return found


def _judged(
    name: str, press: Problem, frames: list[StepResult], mu: float, depth: float, right: Mapping[str, float]
) -> list[Judged]:
    """Every number of a press that is not zero by symmetry, its error bar of the mesh, and its error."""
    told, bars = press_numbers(press, frames[-1]), estimate(press, frames, numbers=press_numbers).discretisation
    dofs, least = press.body.stiffness.upper.shape[0], ROUND_OFF * abs(told["normal_force_N"])
    return [
        Judged(name, "mesh", dofs, mu, depth, k, x, bars.get(k, 0.0), abs(x - right[k]))
        for k, x in told.items()
        if max(abs(x), abs(right[k])) > least
    ]


def _by_drawn_mesh(seed: int, sections: int, solids: int) -> tuple[list[Judged], list[Judged]]:
    """Numbers of drawn sections and of drawn solids on two meshes; presses that do not converge are left out."""
    found: tuple[list[Judged], list[Judged]] = ([], [])
    scenes = [(0, *scene, (1.5, 0.8), 0.2) for scene in drawn(sections, seed)]
    scenes += [(1, *scene, (1.0, 0.7), 0.4) for scene in drawn_solids(solids, seed)]
    for kind, name, model, factors, finest in scenes:
        model = _with_readings(model)
        truth = build(_in_edges(model, finest))
        last = _end(truth)
        for factor in factors if last.outcome.ok else ():
            press = build(_in_edges(model, factor))
            frames = list(march(press))
            if frames[-1].outcome.ok:
                depth, right = model.legs[0].depth_mm, press_numbers(truth, last)
                found[kind].extend(_judged(f"seed {seed}, {name}", press, frames, model.friction.mu, depth, right))
    return found


def _in_edges(model: Model, factor: float) -> Model:
    """The model with all edge lengths times a factor."""
    own = model.mesh
    return replace(model, mesh=replace(own, size_mm=factor * own.size_mm, base_size_mm=factor * own.base_size_mm))


def _hertz(case: Case, exact: dict[str, float]) -> dict[str, float]:
    """Hertz' half-width under the force of the finest mesh, where it holds."""
    if not case.name.startswith("Hertz"):
        return {}
    radius = case.model.object.radius_mm  # type: ignore[attr-defined]
    compliance = (1.0 - case.model.material.nu**2) / case.model.material.E_MPa  # type: ignore[attr-defined]
    force = exact["normal_force_N"] / case.model.design.width_mm
    return {"contact_half_length_mm": math.sqrt(4.0 * force * radius * compliance / math.pi)}


def _by_steps(name: str, model: Model, counts: tuple[int, ...], true_count: int) -> Iterator[Judged]:
    """Numbers in given counts of increments, and in automatic ones, beside those in `true_count` increments."""
    problem = build(model, margin=math.inf)
    ends: dict[int, list[StepResult]] = {}

    def in_steps(count: int) -> Problem:
        return replace(problem, model=replace(model, legs=tuple(replace(leg, steps=count) for leg in model.legs)))

    for n in (*counts, true_count):
        ends[n] = list(march(in_steps(n)))
        if not ends[n][-1].outcome.ok:
            return
    exact = press_numbers(problem, ends.pop(true_count)[-1])
    runs = [
        (f"{n} steps", press_numbers(problem, frames[-1]), estimate(in_steps(n), frames, numbers=press_numbers).steps)
        for n, frames in ends.items()
    ]
    free = replace(problem, model=replace(model, legs=tuple(replace(leg, steps="auto") for leg in model.legs)))
    found, chosen = march_automatic(free)
    if chosen:
        kind = "automatic, met" if chosen.met else "automatic, not met"
        bars = estimate(free, found, numbers=press_numbers, runs=chosen.runs).steps
        runs.append((kind, press_numbers(problem, found[-1]), bars))
        exact["floor"] = chosen.dissipation_floor_mJ
    for part, numbers, bars in runs:
        for k, value in numbers.items():
            if k == "dissipation_mJ" and exact[k] < exact.get("floor", 0.0):
                continue
            dofs = problem.body.stiffness.upper.shape[0]
            depth = model.legs[0].depth_mm
            yield Judged(
                name, part, dofs, model.friction.mu, depth, k, value, bars.get(k, 0.0), abs(value - exact[k])
            )  # fmt: skip


def run(quick: bool, seed: int | None = None) -> Result:
    """All scenes, sizes, coefficients and depths; drawn scenes; then increments on one mesh of each drawn section.

    Parameters
    ----------
    seed : of the drawn scenes; a new one on each full run unless given
    """
    if seed is None:
        seed = SEED if quick else secrets.randbits(31)
    chosen = cases(quick)
    found = [j for case in chosen for j in _by_mesh(case)]
    sections, counts, true_count = (8, STEPS[:3:2], 320) if quick else (64, STEPS, TRUE_STEPS)
    anew = _by_drawn_mesh(seed, *((8, 2) if quick else (64, 16)))
    steps = [j for name, model in drawn(sections, seed) for j in _by_steps(name, model, counts, true_count)]
    rows = [row for kind in KINDS for row in _rows(kind, found, "by mesh")]
    rows += [_narrow(kind, found, "by mesh") for kind in KINDS]
    rows += _by_kind_of_mesh(found, {case.name: case.meshes for case in chosen})
    for here, what in zip(anew, ("sections", "solids"), strict=True):
        text = f"by mesh, {what} drawn with seed {seed}"
        rows += [row for kind in KINDS for row in _rows(kind, here, text)]
        rows += [_narrow(kind, here, text) for kind in KINDS if any(j.kind == kind for j in here)]
    explicit = [j for j in steps if j.part.endswith("steps")]
    rows += [
        row for kind in STEP_KINDS for row in _rows(kind, explicit, f"by {counts[0]} to {counts[-1]} steps", ROUND)
    ]
    automatic = [j for j in steps if j.part.startswith("automatic")]
    rows += [row for kind in STEP_KINDS for row in _rows(kind, automatic, "by automatic steps", ROUND)]
    rows += [_met(kind, [j for j in automatic if j.part.endswith(" met") and "not" not in j.part]) for kind in MET]
    meshes = found + anew[0] + anew[1]
    every = [
        (j.scene, j.part, j.dofs, j.mu, j.depth_mm, j.number, j.value, j.estimate, j.error) for j in meshes + steps
    ]
    return Result(tuple(rows), columns(COLUMNS, every), lambda figure: _draw(figure, meshes, steps))


def _by_kind_of_mesh(found: list[Judged], meshes: Mapping[str, str]) -> list[Row]:
    """The share of every number in each kind of mesh, by the name of the scene; a pool of all would hide one."""
    rows = []
    for group in dict.fromkeys(meshes.values()):
        for kind in KINDS:
            here = [j for j in found if j.kind == kind and meshes[j.scene] == group]
            if here:
                rows.append(_share(here, f"{kind}, by mesh, {group}, {len(here)} cases"))
    return rows


def _share(here: list[Judged], text: str, slack: float = 1e-9) -> Row:
    inside = float(np.mean([j.error <= 2.0 * j.estimate + slack * abs(j.value) for j in here]))
    return Row(
        f"share of cases within 2 times the estimate: {text}", CLAIM, 0.9, inside, 0.0, "a bound", measure="at least"
    )


def _rows(kind: str, found: list[Judged], what: str, slack: float = 1e-9) -> list[Row]:
    here = [j for j in found if j.kind == kind]
    if not here:
        return []
    told = [j.estimate / j.error for j in here if j.error > max(1e-6, slack) * abs(j.value)] or [1.0]
    text = f"{kind}, {what}, {len(here)} cases"
    return [
        _share(here, text, slack),
        Row(
            f"estimate over true error, median: {text}", "a bar that is never wrong tells nothing", 10.0,
            float(np.median(told)), 0.0, "one decade", "sensitivity", "at most",
        ),
    ]  # fmt: skip


def _narrow(kind: str, found: list[Judged], text: str) -> Row:
    """Whether the bars of the meshes are as narrow as was aimed at."""
    here = [j for j in found if j.kind == kind]
    median = float(np.median([j.estimate / j.error for j in here if j.error > 1e-6 * abs(j.value)] or [1.0]))
    what = f"estimate over true error, median: {kind}, {text}"
    return Row(what, "goal of this project", NARROW, median, 0.0, "the goal", "statement", "at most")


def _met(kind: str, steps: list[Judged]) -> Row:
    """Whether the tolerance that is called met holds for the true error."""
    here = [j for j in steps if j.kind == kind]
    share = float(np.mean([j.error <= MET[kind] * _scale(j, here) for j in here]))
    what = f"share of automatic presses called met whose true error is below the tolerance: {kind}, {len(here)} cases"
    return Row(what, f"tolerance {MET[kind]:g}", 0.9, share, 0.0, CLAIM, measure="at least")


def _draw(figure: Any, found: list[Judged], steps: list[Judged]) -> None:
    parts = [(kind, found, "mesh") for kind in KINDS] + [("friction_sum_N", steps, "steps")]
    rows = math.ceil(len(parts) / 4)
    figure.set_size_inches(18.0, 4.2 * rows)
    panels = figure.subplots(rows, 4).ravel()
    figure.suptitle("Error bar against true error: below the upper line the true error is within 2 times the bar")
    for axes in panels[len(parts) :]:
        axes.remove()
    for axes, (kind, judged, part) in zip(panels, parts, strict=False):
        here = [j for j in judged if j.kind == kind]
        for group, colour in (("section", "#2c5d8f"), ("solid", "#c0392b")):
            some = [j for j in here if ("solid" in j.scene or "sphere" in j.scene) == (group == "solid")]
            if not some:
                continue
            scale = np.array([_scale(j, here) for j in some])
            bar = np.array([j.estimate for j in some]) / scale
            true = np.array([j.error for j in some]) / scale
            axes.loglog(np.maximum(bar, 1e-6), np.maximum(true, 1e-6), "o", ms=3, alpha=0.5, color=colour, label=group)
        line = np.array([1e-6, 10.0])
        axes.loglog(line, line, color="#222222", lw=1.0, label="true error = bar")
        axes.loglog(line, 2.0 * line, color="#222222", lw=1.0, ls="--", label="2 bars")
        axes.set(title=f"{kind.replace('_', ' ')}, {part}", xlim=(1e-5, 2.0), ylim=(1e-6, 2.0))
        axes.set(xlabel="bar, relative", ylabel="true error, relative")
    panels[0].legend(fontsize=8, loc="upper left")


def _scale(judged: Judged, group: list[Judged]) -> float:
    """What an error is told relative to: the number, for readings the largest of their kind in the press."""
    if judged.kind not in READINGS:
        return max(abs(judged.value), 1e-12)
    key = (judged.scene, judged.part, judged.dofs, judged.mu, judged.depth_mm)
    return max(abs(j.value) for j in group if (j.scene, j.part, j.dofs, j.mu, j.depth_mm) == key)
