"""What a change of every key of a scene does to the numbers of its press: differences of presses, with their errors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from finger3d._types import Tree, TreeView
from finger3d.accuracy.error_bars import least_error, spacing, spread_error
from finger3d.accuracy.estimate import press_numbers
from finger3d.analyses.calibrate import GAUGE_PLACES, TOLERANCES
from finger3d.analyses.free_keys import scene_with, settled
from finger3d.analyses.pressed_body import PressedBody
from finger3d.errors import Finger3dError
from finger3d.io import claimed, write_csv, write_json
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.discretise.companions import coarse_companions, coarser, finer_companions
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import with_increments_of
from finger3d.mechanics.march.variants import press_variants
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import Column, in_space, kinds_of, quantities
from finger3d.progress import QUIET, Progress
from finger3d.scene import Scene, Source, scene_of, tree
from finger3d.scene.material import with_moduli_only

_SKIPPED = ("title", "mesh", "contact", "marker_grid", "effects.auto")
"""Tables and keys that say how a press is computed, not what is pressed."""

_PERCENT = 0.01
"""Relative change of a key without a tolerance."""

_STIFFNESS = "material.E_MPa"
"""Key that forces may be proportional to."""

_READINGS = "gauges", "markers", "taxels"

_WAYS = "falling", "growing"

_UNSYMMETRIC = math.sqrt(2.0)
"""Edge lengths of the press that keys are changed in which break its symmetry, over those of the press."""


class Effect(NamedTuple):
    """Changes of a number as a key falls and as it grows, with their errors; NaN if that press failed."""

    falling: float
    falling_error: float
    growing: float
    growing_error: float

    def value(self, change: float) -> float:
        """Return the change of the number per unit of the key, which changed by `change`."""
        if math.isnan(self.falling) or math.isnan(self.growing):
            return (self.growing if math.isnan(self.falling) else -self.falling) / change
        return (self.growing - self.falling) / (2.0 * change)


@dataclass(frozen=True)
class Sensitivity:
    """Effects of the keys of a scene on the numbers at the end of its press.

    Attributes
    ----------
    title : of the scene
    numbers : values of the numbers by name
    keys : values of the keys
    changes : of each key, by which it falls and grows
    effects : of each key, on each number
    failures : why a key has no effect as it falls or grows, in words
    """

    title: str
    numbers: Mapping[str, float]
    keys: Mapping[str, float]
    changes: Mapping[str, float]
    effects: Mapping[str, Mapping[str, Effect]]
    failures: Mapping[str, str]

    def as_dict(self) -> Tree:
        """Return what sensitivity.json holds."""
        effects = {
            name: {key: {"value": e.value(self.changes[key]), **e._asdict()} for key, e in by_key.items()}
            for name, by_key in self.effects.items()
        }
        return {**asdict(self), "effects": effects}

    def rows(self) -> list[Tree]:
        """Return a row for each number and key, those first that change the number most."""
        rows = list[Tree]()
        for name, by_key in self.effects.items():
            for key, effect in sorted(by_key.items(), key=lambda item: -largest(item[1])):
                change = {"value": self.keys[key], "change": self.changes[key]}
                rows.append({"number": name, "key": key, **change, **effect._asdict()})
        return rows


def largest(effect: Effect) -> float:
    """Return the larger magnitude of an effect, 0 if it is not known."""
    return max((abs(x) for x in (effect.falling, effect.growing) if not math.isnan(x)), default=0.0)


class KeyChange(NamedTuple):
    """A key with its value, and the models with it less and plus its change; the reason where there is none."""

    value: float
    change: float
    ends: tuple[Model | str, Model | str]


def sensitivity(
    scene: Source,
    of: Sequence[str] = (),
    out: str | Path | None = None,
    report: Progress = QUIET,
    overrides: Sequence[str] = (),
    tolerances: Mapping[str, float] | None = None,
) -> Sensitivity:
    """Change every key of a scene by its tolerance, to both sides, and press it again.

    All presses have the increments and the mesh of the scene's own press; the mesh moves with the dimensions.  A key
    that breaks the symmetry of the press is changed in a press without it, on a coarser mesh.  The errors follow from
    the same differences on companion meshes.  Keys at zero are left out unless they have a tolerance.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    of : numbers of the press, such as "gauge_g36"; default: all that have error bars
    out : folder for sensitivity.json, sensitivity.csv and sensitivity.png
    report : receives the progress
    overrides : other keys to set, such as ``"friction.mu=0.5"``
    tolerances : changes by key, such as ``{"friction.mu": 0.02}``; else that of a careful set-up where one is known
        (`finger3d.analyses.calibrate`), and 1 % of the value

    Returns
    -------
    Sensitivity

    Raises
    ------
    Finger3dError
        If the press has no number of such a name, the scene no such key, or if its press fails.
    """
    scene, _ = settled(scene_of(scene, overrides), report)
    model, names = scene.model(), scene.check_numbers(of)
    report.stage("meshing and pressing")
    body = PressedBody.with_refined_borders(model, report)
    steps = body.steps()
    steps[-1].check("sensitivity")
    legs = with_increments_of(body.problem.model.legs, len(steps))
    problem = replace(body.problem, model=replace(body.problem.model, legs=legs))
    changes = changes_of(scene, problem.model, tolerances or {})
    found, failures = effects_on(problem, changes, report)
    numbers = press_numbers(problem, steps[-1])
    of, keys = tuple(of) or names, [key for key in changes if key in found]
    result = Sensitivity(
        title=scene.title,
        numbers={name: numbers[name] for name in of},
        keys={key: changes[key].value for key in keys},
        changes={key: changes[key].change for key in keys},
        effects={name: {key: found[key][name] for key in keys} for name in of},
        failures=failures,
    )
    if out is not None:
        _write(Path(out), result)
    return result


def changes_of(scene: Scene, own: Model, tolerances: Mapping[str, float]) -> dict[str, KeyChange]:
    """Return the changes of all keys of a scene, by their names, in the mesh and the increments of a model."""
    given = with_moduli_only(scene.as_dict())
    wanted = {tree.numbered(key, given, "--tolerance"): change for key, change in tolerances.items()}
    values = {key: value for key, value in _numbers_of(given) if not key.startswith(_SKIPPED)}
    if unknown := next((key for key in wanted if key not in values), None):
        raise Finger3dError(f"--tolerance {unknown}: the scene has no such number; it has {', '.join(values)}")

    def at(key: str, value: float) -> Model | str:
        try:
            model = scene_with(given, [key], [value], scene.path).model()
        except Finger3dError as error:
            return str(error)
        count = sum(int(leg.steps) for leg in own.legs)
        return replace(model, mesh=own.mesh, legs=with_increments_of(model.legs, count), warnings=own.warnings)

    def change(key: str, value: float) -> KeyChange:
        step = wanted.get(key) or _tolerance(key, value) or _PERCENT * abs(value)
        return KeyChange(value, step, (at(key, value - step), at(key, value + step)))

    told = {key: value for key, value in values.items() if value or key in wanted}
    return {_named(key, given): change(key, value) for key, value in told.items()}


def effects_on(
    problem: Problem, changes: Mapping[str, KeyChange], report: Progress
) -> tuple[dict[str, dict[str, Effect]], dict[str, str]]:
    """Return the effects on all numbers by key, and why there are none."""
    by_axes = dict[tuple[str, ...], dict[str, KeyChange]]()
    for key, one in changes.items():
        kept = [set(symmetry(end)) for end in one.ends if isinstance(end, Model)]
        axes = tuple(axis for axis in problem.axes if all(axis in some for some in kept))
        by_axes.setdefault(axes, {})[key] = one
    found, failures = dict[str, dict[str, Effect]](), dict[str, str]()
    for axes, some in by_axes.items():
        base = problem
        if axes != problem.axes:
            report.stage(f"pressing without symmetry: {', '.join(some)}")
            mesh = coarser(problem.model, _UNSYMMETRIC).mesh
            base = build(replace(problem.model, symmetry=axes, mesh=mesh))
        report.stage(f"changing {', '.join(some)}")
        own = differences(base, some)
        beside = list(coarse_companions(base)) or list(finer_companions(base))
        others = []
        for ratio, companion in beside:
            report.stage(f"errors: the same changes on edges of {companion.model.mesh.size_mm:.3g} mm")
            others.append((ratio, differences(companion, some)))
        for key in some:
            sides = [own.changed[key, k] for k in (0, 1)]
            told = [f"{way}: {side}" for way, side in zip(_WAYS, sides, strict=True) if isinstance(side, str)]
            failures |= {key: "; ".join(told)} if told else {}
            if len(told) < len(sides):
                parts = list[dict[str, float]]()
                for k, side in enumerate(sides):
                    parts += [side if isinstance(side, dict) else {}, _errors(own, others, (key, k))]
                found[key] = {name: Effect(*(part.get(name, math.nan) for part in parts)) for name in own.numbers}
    return found, failures


Side = dict[str, float] | str
"""Changes of numbers by name, or the reason why they are not known."""


class Differences(NamedTuple):
    """Numbers of a press, its readings and spacing, and the changes of numbers as each key falls (0) and grows (1)."""

    numbers: dict[str, float]
    readings: list[Column]
    spacing: float
    changed: dict[tuple[str, int], Side]


def _errors(own: Differences, others: Sequence[tuple[float, Differences]], at: tuple[str, int]) -> dict[str, float]:
    """Return the errors of the changes by a key, from those on other meshes.

    The border of stick moves past the contact points by fits: a change of its zone that is known has the least error of
    the zone.  A change whose sign another mesh does not confirm has an error as large as itself.
    """
    side, kinds = own.changed[at], kinds_of(own.readings)
    known = [(ratio, told) for ratio, other in others if isinstance(told := other.changed[at], dict)]
    if not isinstance(side, dict) or not known:
        return {}
    found = spread_error(side, known, own.readings)
    for name, error in found.items():
        if error > 0.0 and kinds[name].is_stick:
            found[name] = max(error, least_error(own.numbers, kinds, name, own.spacing))
        if any(told[name] * side[name] <= 0.0 for _, told in known):
            found[name] = max(found[name], abs(side[name]))
    return found


def differences(problem: Problem, changes: Mapping[str, KeyChange]) -> Differences:
    """Press a problem and its variants; those that change readings only are read in the problem's own press."""
    own, mesh = problem.model, problem.model.mesh
    both = {(key, side): end for key, one in changes.items() for side, end in enumerate(one.ends)}
    told = {at: end for at, end in both.items() if isinstance(end, Model)}
    ends = {at: replace(end, mesh=mesh, symmetry=own.symmetry) for at, end in told.items()}
    scaled = {at for at in ends if at[0] == _STIFFNESS and own.forces_scale_with_modulus}
    read = {at for at, end in ends.items() if _changes_readings_only(own, end)}
    pressed = [at for at in ends if at not in read | scaled]
    base, *variants = press_variants(problem, [own, *(ends[at] for at in pressed)], _kept)
    if base.found is None:
        raise Finger3dError(f"sensitivity: {base.failure}")
    numbers, last = base.found
    sides: dict[tuple[str, int], Side] = {at: end for at, end in both.items() if isinstance(end, str)}
    for at, variant in zip(pressed, variants, strict=True):
        sides[at] = _less(variant.found[0], numbers) if variant.found else variant.failure
    for at in read:
        sides[at] = _less(_read_anew(problem, last, ends[at]), numbers)
    known = quantities(last.readings)
    for key, side in scaled:
        ratio = (2 * side - 1) * changes[key].change / changes[key].value
        sides[key, side] = {name: ratio * x if known[name].is_stress else 0.0 for name, x in numbers.items()}

    return Differences(numbers, list(in_space(last.readings)), spacing(problem, last), sides)


def _kept(problem: Problem, steps: Sequence[StepResult]) -> tuple[dict[str, float], StepResult]:
    return press_numbers(problem, steps[-1]), steps[-1]


def _less(numbers: Mapping[str, float], own: Mapping[str, float]) -> dict[str, float]:
    return {name: numbers[name] - value for name, value in own.items() if name in numbers}


def _changes_readings_only(own: Model, other: Model) -> bool:
    kept = {name: getattr(own, name) for name in _READINGS}
    return own.inclusions is None and own.relaxation is None and replace(other, **kept) == own


def _read_anew(problem: Problem, step: StepResult, model: Model) -> dict[str, float]:
    """Return the numbers of an increment with the readings of another model."""
    other, state, formulation = replace(problem, model=model), step.meshed_state, formulation_of(model)
    if model.finite_strain:
        readings = formulation.readings(other, state)
    else:
        (unknowns,) = formulation.unknowns(problem, [state])
        rows = [reading.rows(other.meshed_body) for reading in model.readings]
        values = np.concatenate([row @ unknowns[: row.shape[1]] for row in rows])
        readings = dict(zip(model.columns, map(float, values), strict=True))
    return press_numbers(other, replace(step, readings=readings))


def _numbers_of(node: object, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield the dotted keys of a scene whose values are numbers that may change continuously."""
    if isinstance(node, float):
        yield place, node
    elif isinstance(node, list | tuple):
        node = dict(enumerate(node))
    for key, child in node.items() if isinstance(node, Mapping) else ():
        yield from _numbers_of(child, f"{place}.{key}" if place else str(key))


def _named(key: str, given: TreeView) -> str:
    """Return a key with the name of a gauge or marker in place of its number."""
    kind, number, *rest = [*key.split("."), ""]
    if kind not in ("gauge", "marker", "taxel") or not number.isdecimal():
        return key
    return ".".join([kind, str(tree.value_at(given, f"{kind}.{number}.name")), *rest]).rstrip(".")


def _tolerance(key: str, value: float) -> float | None:
    """Return the standard deviation of a key in a careful set-up; None if none is known."""
    table, last = key.split(".")[0], key.split(".")[-1]
    if last == "E_MPa":
        return TOLERANCES["E_percent"][0] / 100.0 * value
    name = GAUGE_PLACES.get(last, last) if table == "gauge" else last
    return TOLERANCES[name][0] if name in TOLERANCES and table != "marker" else None


def _write(out: Path, found: Sensitivity) -> None:
    """Write the results and the figure."""
    from finger3d.plotting.analyses import draw_sensitivity  # matplotlib is loaded for a figure only

    with claimed(out, "sensitivity") as folder:
        write_json(folder / "sensitivity.json", found.as_dict())
        rows = found.rows()
        write_csv(folder / "sensitivity.csv", {name: [row[name] for row in rows] for name in rows[0]})
        draw_sensitivity(folder / "sensitivity.png", found.title, found.numbers, rows)
