"""Is what a press says that large deformation would change within a factor of 1.5 of the truth?

Truth is the same press on the same mesh at large deformation.  The scenes are drawn at random:
sections as in error_bars, with another seed, so that none was used to choose the factors of the estimates, and coarse
swept solids.  A press reports a change if the half-width of its interval is below a third of it, and if it is at least
1 % of a force or of the largest gauge strain.  What it reports is judged by the factor in nine cases of ten, and by the
interval in eight of ten.  Changes that are too small or too uncertain to be reported have no meaningful ratio to the
truth: they are judged by the interval alone, in statements, since nothing is claimed of them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from finger3d.accuracy.changes import Change, changing_numbers
from finger3d.accuracy.model_error import judged_large_deformation, largest_principal_strain
from finger3d.effects.large_deformation import Effect as LargeDeformation
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Model
from finger3d.objects import Cylinder, Plane, Sphere

from ._drawn import FAR, NEAR, UNDER, Shape, drawn, scene
from ._press import fig9_finger, in_edges
from ._rows import Result, Row, columns, listed

judged = listed(__file__)

SEED = 23
"""The factors of the estimates were chosen with the seed 2026."""

SECTIONS, SOLIDS = 54, 6
LEAST_STRAIN = 0.05
"""Principal strain from which a scene is judged; below, changes are too small to be reported."""
FACTOR, SHARE, COVERED = 1.5, 0.9, 0.8
KINDS = {"normal_force_N": "normal force", "friction_sum_N": "friction sum", "gauge": "gauge"}
LARGE = "large deformation"
COLUMNS = "scene by number value change error reported true_change"


@dataclass(frozen=True)
class Judged:
    """Estimated and true change of one number of one press by large deformation."""

    scene: str
    number: str
    estimate: Change
    true: float

    @property
    def kind(self) -> str:
        """Number's kind: all gauges are one."""
        return "gauge" if self.number.startswith("gauge") else self.number

    @property
    def ratio(self) -> float:
        """True change over the estimated one."""
        return self.true / self.estimate.change

    @property
    def within(self) -> bool:
        """Whether the estimate is within the factor of the truth."""
        return 1.0 / FACTOR <= self.ratio <= FACTOR

    @property
    def covered(self) -> bool:
        """Whether the true change lies in the interval, up to round-off of the number."""
        return abs(self.true - self.estimate.change) <= self.estimate.error + 1e-9 * abs(self.estimate.value)


def solids(count: int) -> Iterator[tuple[str, Model]]:
    """Names and models of coarse swept solids: three shapes in turn; width, nu, mu and depth at random."""
    random = np.random.default_rng(SEED)
    for number in range(count):
        u = random.uniform(size=4)
        fig9 = fig9_finger(12.0 + 28.0 * u[0])
        half = designs()["half_cylinder"](radius_mm=5.0, width_mm=3.0 + 5.0 * u[0])
        block = designs()["block"](half_length_mm=8.0, height_mm=8.0, width_mm=10.0 + 6.0 * u[0])
        shapes: tuple[Shape, ...] = (
            (fig9, Plane(), FAR, 10.0, 3.0),
            (half, Cylinder(radius_mm=10.0), NEAR, 1.0, 0.35),
            (block, Sphere(radius_mm=10.0), UNDER, 1.2, 0.7),
        )
        name, model = scene(shapes[number % 3], 0.3 + 0.19 * u[1], 0.03 * 40.0 ** u[2], 0.5 + 0.5 * u[3])
        yield f"solid {number}: {name}", model


def scenes(quick: bool) -> Iterator[tuple[str, Model]]:
    """Sections and solids; quick: one section on a coarser mesh."""
    if quick:
        for name, model in itertools.islice(drawn(2, SEED), 1, None):
            yield name, in_edges(model, 1.5)
        return
    yield from drawn(SECTIONS, SEED)
    yield from solids(SOLIDS)


def by_large_deformation(name: str, model: Model) -> Iterator[Judged]:
    """Yield the changes by large deformation where a press estimates them."""
    problem = build(model)
    *_, step = march(problem)
    strain = formulation_of(problem.model).fields(problem, step.meshed_state)[1]
    if largest_principal_strain(strain) < LEAST_STRAIN:
        return
    found = judged_large_deformation(model)
    estimate = found.estimate.of_press(changing_numbers(problem, step))
    truth = build(LargeDeformation().apply(model))
    *_, end = march(truth)
    if end.outcome.ok:
        numbers = changing_numbers(truth, end)
        for number, change in estimate.changes.items():
            if number in KINDS or number.startswith("gauge"):
                yield Judged(name, number, change, numbers[number] - change.value)


def run(quick: bool) -> Result:
    """Large deformation in every scene."""
    found: list[Judged] = []
    pressed = 0
    for name, model in scenes(quick):
        found += by_large_deformation(name, model)
        pressed += 1
    share = len({j.scene for j in found}) / pressed
    rows = [judged("share-of-scenes-whose-change-by", share, SHARE, pressed=pressed)]
    for kind in KINDS:
        rows += _rows([j for j in found if j.kind == kind], f"{KINDS[kind]} by {LARGE}")
    lines = [
        (j.scene, LARGE, j.number, change.value, change.change, change.error, change.significant, j.true)
        for j in found
        for change in [j.estimate]
    ]
    return Result(tuple(rows), columns(COLUMNS, lines), lambda figure: _draw(figure, found))


def _rows(found: list[Judged], what: str) -> Iterator[Row]:
    """Return the shares of one kind of number; none where nothing is reported."""
    said, silent = ([j for j in found if j.estimate.significant == significant] for significant in (True, False))
    if said:
        text = f"{what}, {len(said)} reported of {len(found)}"
        within, covered = (float(np.mean([getattr(j, key) for j in said])) for key in ("within", "covered"))
        yield judged("share-of-reported-changes-within-a", within, SHARE, text=text)
        yield judged("share-of-reported-changes-whose-interval", covered, COVERED, text=text)
    if silent:
        covered, words = float(np.mean([j.covered for j in silent])), {"count": len(silent), "other_count": len(found)}
        yield judged("share-of-changes-not-reported-whose", covered, COVERED, what=what, **words)


def _draw(figure: Any, found: list[Judged]) -> None:
    """Draw true over estimated changes, and the band of the factor."""
    figure.set_size_inches(13.5, 4.5)
    figure.suptitle("True change against the change that a press reports; the band is a factor of 1.5")
    for axes, kind in zip(figure.subplots(1, 3), KINDS, strict=True):
        for said, colour, label in ((False, "#b0b0b0", "not reported"), (True, "#2c5d8f", "reported")):
            some = [j for j in found if j.kind == kind and j.estimate.significant == said]
            axes.loglog(*np.abs([(j.estimate.change, j.true) for j in some]).reshape(-1, 2).T, "o", ms=3.5,
                        color=colour, label=label)  # fmt: skip
        ends = np.array(axes.get_xlim())
        axes.fill_between(ends, ends / FACTOR, ends * FACTOR, color="#2c5d8f", alpha=0.12, lw=0.0)
        unit = "strain" if kind == "gauge" else "N"
        axes.set(title=f"{KINDS[kind]}, {LARGE}", xlabel=f"|estimated change|, {unit}", ylabel=f"|true change|, {unit}")
