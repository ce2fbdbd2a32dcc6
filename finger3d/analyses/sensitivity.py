"""Derivatives of the numbers of a press by the keys of its scene, and the effect of the uncertainty of each key."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from finger3d._types import Tree, TreeView
from finger3d.analyses.calibrate.tolerance_table import GAUGE_PLACES, TOLERANCES
from finger3d.analyses.effects_by_need import settled
from finger3d.analyses.free_keys import scene_with
from finger3d.analyses.pressed_body import PressedBody, under
from finger3d.errors import Finger3dError
from finger3d.io import claimed, write_csv, write_json
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.march.path import stations
from finger3d.mechanics.march.sensitivity import derivatives, held_normals, refusal, tangents
from finger3d.mechanics.march.step_halving import with_increments_of
from finger3d.mechanics.model import Leg, Model
from finger3d.mechanics.results.history import table_row
from finger3d.mechanics.small_strain.exact_path import has_exact_path
from finger3d.mechanics.small_strain.variations import Variation, VariedBody
from finger3d.progress import QUIET, Progress
from finger3d.scene import Source, scene_of, tree
from finger3d.scene.material import with_moduli_only

_KEYS = re.compile(
    r"friction\.mu|finger\.[a-z_]+_mm|material\.(E_MPa|nu)|parts\.[^.]+\.(E_MPa|nu)|press\.(leg\.\d+\.)?(depth_mm|force_([xz]_)?N|slide_[xz]_mm|turn_[xyz]_deg)"
    r"|object\.(x_mm|z_mm|radius_mm|tilt_deg|tip_radius_mm|wavelength_mm|amplitude_mm)"
    r"|gauge\.\d+\.(x_mm|y_mm|z_mm|angle_deg|length_mm)|marker\.\d+\.(x_mm|y_mm|z_mm)"
    r"|effects\.(elastic_object\.(E_MPa|nu|height_mm)|embedded_gauge\.(E_MPa|thickness_mm|width_mm)|kinetic_friction\.ratio)"
    r"|press\.(leg\.\d+\.)?duration_s|effects\.viscosity\.prony\.\d+\.[01]"
)
"""Keys that numbers have derivatives by; others change the mesh or the object."""

_BREAKS = {
    "slide_x_mm": "x", "slide_z_mm": "z", "force_x_N": "x", "force_z_N": "z",
    "object.x_mm": "x", "object.z_mm": "z", "tilt_deg": "x",
    "turn_x_deg": "z", "turn_y_deg": "xz", "turn_z_deg": "x",
}  # fmt: skip
"""Axes of the mirror symmetries that a key breaks, by its end."""

_IN_SOLIDS = ("z_mm", "force_z_N", "turn_x_deg", "turn_y_deg")
"""Ends of keys that sections do not have."""

_STEP, _NU_STEP, _LEAST = 1e-6, 1e-5, 0.1
"""Step of central differences over the value, or over `_LEAST` if that is larger; that of nu is larger, since the bulk
modulus is bounded at nu = 0.5."""

_SAME = 1e-6
"""Relative difference of the derivatives as a key falls and grows that is none."""

_PERCENT = 0.01
"""Relative change of a key without a tolerance that the figure shows the effect of."""


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of numbers at the end of a press.

    Attributes
    ----------
    title : of the scene
    numbers : values of the numbers by name
    keys : values of the keys
    tolerances : standard deviations of those keys that have one (`finger3d.analyses.calibrate.tolerance_table`)
    derivatives : of each number by each key, per unit of the key, as the key grows
    falling : the same as the key falls, for those that differ, since the press ends at a kink
    without : keys of the scene that have no derivative, since they change the mesh or the object
    held_normals : points in contact whose normals are held fixed at an edge of the object; derivatives are approximate
    """

    title: str
    numbers: Mapping[str, float]
    keys: Mapping[str, float]
    tolerances: Mapping[str, float]
    derivatives: Mapping[str, Mapping[str, float]]
    falling: Mapping[str, Mapping[str, float]]
    without: tuple[str, ...]
    held_normals: int = 0

    def change(self, key: str) -> float:
        """Return the change of a key that effects are shown for: its tolerance, or 1 % of its value."""
        return self.tolerances.get(key, _PERCENT * abs(self.keys[key]))

    def as_dict(self) -> Tree:
        """Return what sensitivity.json holds."""
        names = {"falling": "derivatives_falling", "without": "without_derivative"}
        return {names.get(name, name): value for name, value in asdict(self).items()}

    def rows(self) -> list[Tree]:
        """Return a row for each number and key, those first that change the number most."""
        return [
            {
                "number": name,
                "key": key,
                "value": self.keys[key],
                "derivative": slope,
                "derivative_falling": self.falling.get(name, {}).get(key, slope),
                "change": self.change(key),
                "effect": slope * self.change(key),
            }
            for name, by_key in self.derivatives.items()
            for key, slope in sorted(
                by_key.items(), key=lambda item: -abs(np.nan_to_num(item[1]) * self.change(item[0]))
            )
        ]


def sensitivity(
    scene: Source,
    of: Sequence[str] = (),
    out: str | Path | None = None,
    report: Progress = QUIET,
    overrides: Sequence[str] = (),
) -> Sensitivity:
    """Differentiate numbers at the end of a press by the keys of its scene.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    of : numbers of the press, such as "gauge_g36"; default: all that have error bars
    out : folder for sensitivity.json, sensitivity.csv and sensitivity.png
    report : receives the progress
    overrides : other keys to set, such as ``"friction.mu=0.5"``

    Returns
    -------
    Sensitivity

    Raises
    ------
    Finger3dError
        If the press has no number of such a name, or its numbers have no derivatives.
    """
    scene, _ = settled(scene_of(scene, overrides), report)
    model, names = scene.model(), scene.check_numbers(of)
    if text := refusal(model):
        raise Finger3dError(f"sensitivity: {text}")
    report.stage("meshing and pressing")
    body = PressedBody.with_refined_borders(model, report)
    pressed = body.steps()
    pressed[-1].check("sensitivity")
    report.stage("differentiating")
    problem = under(body.problem, legs=with_increments_of(body.problem.model.legs, len(pressed)))
    given, varying, variations = with_moduli_only(scene.as_dict()), VariedBody(problem), dict[str, Variation]()
    all_keys = dict(_numbers_of(given))
    for key in all_keys:
        with suppress(Finger3dError):  # such as dimensions that change the cells of the mesh; named with the result
            variations[key] = varied(given, scene.path, varying, key)
    titles, ways = {key: _named(key, given) for key in all_keys}, list(variations.values())
    *_, (step, *both) = tangents(problem, ways, pressed)
    falling = growing = derivatives(step, ways, both[0])
    if both[1] is not both[0]:
        falling, growing = (derivatives(step, ways, sides, way) for sides, way in zip(both, (-1, 1), strict=True))
    of = tuple(of) or names
    slopes, others = (
        {n: {titles[key]: row.get(n, np.nan) for key, row in zip(variations, rows, strict=True)} for n in of}
        for rows in (growing, falling)
    )
    kinks = {n: {key: s for key, s in row.items() if not _is_close(s, slopes[n][key])} for n, row in others.items()}
    values, skipped = table_row(problem.points, step), ("mesh.", "contact.", "effects.")
    found = Sensitivity(
        title=scene.title,
        numbers={name: values[name] for name in of},
        keys={titles[key]: all_keys[key] for key in variations},
        tolerances={titles[key]: sd for key in variations if (sd := _tolerance(key, all_keys[key])) is not None},
        derivatives=slopes,
        falling={name: row for name, row in kinks.items() if row},
        without=tuple(t for key, t in titles.items() if key not in variations and not t.startswith(skipped)),
        held_normals=held_normals(problem, step),
    )
    if out is not None:
        _write(Path(out), found)
    return found


def varied(
    given: TreeView,
    path: Path | None,
    body: VariedBody,
    key: str,
    legs: Callable[[Model], tuple[Leg, ...]] = lambda model: model.legs,
) -> Variation:
    """Return the variation of a condensed body with a key of its scene; one-sided where a bound is nearer than a step.

    Parameters
    ----------
    given : tables of the scene, with moduli only (`finger3d.scene.material.with_moduli_only`)
    path : of its file, if any
    legs : path of a model of the scene; automatic increments are those of the body

    Raises
    ------
    Finger3dError
        If numbers have no derivative by the key.
    """
    own, value = body.problem.model, float(str(tree.value_at(given, key) or 0.0))
    if not _has_derivative(key, value, body.problem):
        raise Finger3dError(f"{key}: {refusal(own) or 'numbers have no derivative by it'}")
    step = (_NU_STEP if key.endswith(".nu") else _STEP) * max(abs(value), _LEAST)
    count, problems = len(stations(own.legs)), list[str]()
    for low in (value - step, value, value - 2.0 * step):
        try:
            models = [scene_with(given, [key], [at], path).model() for at in (low, low + 2.0 * step)]
            first, last = (replace(m, legs=with_increments_of(legs(m), count), mesh=own.mesh) for m in models)
            return body.variation(first, last, step)
        except Finger3dError as error:
            problems.append(str(error))
    raise Finger3dError(f"{key} = {value:g}: numbers have no derivative here: {problems[0]}")


def _numbers_of(node: object, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield the dotted keys of a scene whose values are numbers that may change continuously."""
    if isinstance(node, float):
        yield place, node
    elif isinstance(node, list | tuple):
        node = dict(enumerate(node))
    for key, child in node.items() if isinstance(node, Mapping) else ():
        yield from _numbers_of(child, f"{place}.{key}" if place else str(key))


def _has_derivative(key: str, value: float, problem: Problem) -> bool:
    """Whether numbers have a derivative by a key; what is zero in a mirrored press would break its symmetry."""
    model = problem.model
    flat, exact = model.object.is_flat and not key.endswith("tilt_deg"), has_exact_path(model)
    excluded = (
        problem.dim == 2 and key.endswith(_IN_SOLIDS),
        key.endswith("turn_z_deg") and exact,  # beside the path there are increments
        key.endswith("duration_s") and model.relaxation is None,
        key.startswith("object.") and (exact or flat),
        key.endswith("length_mm") and value == 0.0,
        any(key.endswith(name) and set(axes) & set(problem.axes) for name, axes in _BREAKS.items()),
    )
    return not refusal(model) and bool(_KEYS.fullmatch(key)) and not any(excluded)


def _is_close(one: float, other: float) -> bool:
    return abs(one - other) <= _SAME * max(abs(one), abs(other))


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
    from finger3d.plotting.sensitivity import draw  # matplotlib is loaded for a figure only

    with claimed(out, "sensitivity") as folder:
        write_json(folder / "sensitivity.json", found.as_dict())
        rows = found.rows()
        write_csv(folder / "sensitivity.csv", {name: [row[name] for row in rows] for name in rows[0]})
        draw(folder / "sensitivity.png", found.title, found.numbers, rows)
