"""Points of a sweep, each a checked scene: every combination of the values, a list of points, or random samples."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Tree, TreeView
from finger3d.analyses.free_keys import FreeKey, check_distinct, settled
from finger3d.analyses.pressed_body import Variant, body_key, finest
from finger3d.csv_table import read_table
from finger3d.errors import Finger3dError
from finger3d.mechanics.model import MeshOptions
from finger3d.mechanics.postprocess.marker_grid import grid_markers
from finger3d.mechanics.readings import Marker
from finger3d.progress import QUIET, Progress
from finger3d.scene import Scene, Source, parse, tables_of, tree
from finger3d.scene.messages import shown
from finger3d.scene.tables import LabelsTable, SceneTable

MOST = 100_000
"""Points of one sweep; every one is checked before the first is pressed, which takes some 5 to 20 ms."""

_EXAMPLE = "--vary friction.mu=0.06,0.25,1"


@dataclass(frozen=True)
class Vary:
    """A key of the scene and the values it takes, as texts in TOML."""

    key: str
    texts: tuple[str, ...]

    @classmethod
    def of(cls, text: str) -> Vary:
        """From ``KEY=VALUE,VALUE``; commas within brackets and quotes belong to a value."""
        key, equals, values = text.partition("=")
        key = key.strip()
        if not equals or not key:
            raise Finger3dError(f"--vary {shown(text)}: must be KEY=VALUE,VALUE,..., for instance {_EXAMPLE}")
        texts = tuple(part.strip() for part in _split(values))
        if not all(texts):
            raise Finger3dError(f"--vary {key}: a value is empty; give values and commas, for instance {_EXAMPLE}")
        twice = next((t for i, t in enumerate(texts) if t in texts[:i]), None)
        if twice is not None:
            raise Finger3dError(f"--vary {key}: the value {shown(twice)} is given twice; leave one out")
        return cls(key, texts)

    @property
    def values(self) -> tuple[object, ...]:
        """The values as the scene reads them."""
        return tuple(tree.parsed(text) for text in self.texts)


def _split(values: str) -> list[str]:
    parts, depth, quote = [""], 0, ""
    for sign in values:
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "\"'":
            quote = sign
        else:
            depth += (sign in "[{") - (sign in "]}")
        if sign == "," and depth == 0 and not quote:
            parts.append("")
        else:
            parts[-1] += sign
    return parts


def varied(texts: Iterable[str]) -> tuple[Vary, ...]:
    """Return what the options ``--vary`` give; no key may occur twice."""
    found = tuple(Vary.of(text) for text in texts)
    if not found:
        raise Finger3dError(f"sweep: nothing varies; give at least one key, for instance {_EXAMPLE}")
    check_distinct([v.key for v in found], "--vary", "; put all its values into one list")
    return found


@dataclass(frozen=True)
class Point:
    """One combination of values.

    Attributes
    ----------
    number : from 0; the last key varies fastest
    values : by key, as the scene reads them
    body : key of its body
    variant : friction, path, contact rule and gauges
    """

    number: int
    values: Mapping[str, object]
    body: str
    variant: Variant


@dataclass(frozen=True)
class BodySpec:
    """Specification of a body that several points share.

    Attributes
    ----------
    key : hash of everything that shapes the body
    variants : of all its points, also of those that are finished: the mesh is graded for the union of their paths;
        with labels, where objects may touch anywhere, one for each set of gauges
    mesh : with the smallest sizes of the points
    given : the scene of one of the points
    grid : markers of its grid
    labels : what is asked for of every sample
    """

    key: str
    variants: tuple[Variant, ...]
    mesh: MeshOptions
    given: TreeView = field(compare=False, repr=False)
    grid: tuple[Marker, ...] = field(compare=False, repr=False)
    labels: LabelsTable | None = None


@dataclass(frozen=True)
class Sweep:
    """All points, and the bodies they share.

    Attributes
    ----------
    given : the scene that is varied, as written, overrides included, paths absolute
    vary : the varied keys; their values are combined, or, of a list of points, belong together by their place
    is_list : whether the points are a list
    """

    given: TreeView
    vary: tuple[Vary, ...]
    points: tuple[Point, ...]
    bodies: dict[str, BodySpec]
    title: str
    is_list: bool

    def identity(self) -> Tree:
        """Return what identifies the sweep; the hashes of bodies include the contents of files that vary."""
        return {
            "scene": tree.plain(self.given),
            "vary": {v.key: list(v.texts) for v in self.vary},
            **({"list": True} if self.is_list else {}),
            "points": len(self.points),
            "files": tree.contents(self.given),
            "bodies": list(self.bodies),
        }


def checked_points(
    source: Source,
    overrides: Sequence[str],
    vary: tuple[Vary, ...],
    option: str = "--vary",
    report: Progress = QUIET,
) -> Sweep:
    """Read a scene and check every point of a sweep.

    Parameters
    ----------
    overrides : as for ``--set``
    vary : the keys; with ``--vary`` every combination of their values is a point, else values at the same place are
    option : what gave them, for messages

    Raises
    ------
    Finger3dError
        For the first mistake, in one line that names the key and the value.
    """
    is_list = option != "--vary"
    count = len(vary[0].texts) if is_list else math.prod(len(v.texts) for v in vary)
    if count > MOST:
        points = "points" if is_list else "combinations"
        raise Finger3dError(f"{option}: {count} {points}; at most {MOST} in one sweep, split it")
    joined: Callable[..., Iterable[tuple[Any, ...]]] = zip if is_list else itertools.product
    base, path = tables_of(source, overrides)
    keys = [tree.numbered(v.key, base, option) for v in vary]
    check_distinct(keys, option, "; put all its values into one list")
    options = {o.partition("=")[0].strip(): "--set" for o in overrides} | dict.fromkeys(keys, option)
    scenes: list[Scene] = []
    for texts in joined(*(v.texts for v in vary)):
        changes = [f"{key}={text}" for key, text in zip(keys, texts, strict=True)]
        scene = parse(tree.override(base, changes, option), path=path, set_keys=options)
        if scene.tables.mesh.tolerance is not None:
            advice = "give a sweep mesh.size_mm, for instance what finger3d press has chosen, in its summary.json"
            raise Finger3dError(f"{path or scene.title}: mesh.tolerance chooses a mesh for one press; {advice}")
        scenes.append(scene)
    scenes = _with_effects(scenes, report)
    if any(scene.tables.labels and "elastic_object" in scene.effects for scene in scenes):
        raise Finger3dError("[labels]: only of rigid objects; leave out effects.elastic_object")
    values = joined(*(v.values for v in vary))
    checked, members = list[Point](), dict[str, list[tuple[Scene, Variant]]]()
    for number, (scene, here) in enumerate(zip(scenes, values, strict=True)):
        body, variant = body_key(scene), Variant.of(scene.model())
        members.setdefault(body, []).append((scene, variant))
        named = {v.key: value for v, value in zip(vary, here, strict=True)}
        checked.append(Point(number, named, body, variant))
    grids = _grids({key: of[0][0] for key, of in members.items()})
    shared = dict[str, BodySpec]()
    for key, of in members.items():
        first, mesh = of[0][0], finest([scene.model() for scene, _ in of])
        variants = _shaping([variant for _, variant in of], first.tables.labels)
        shared[key] = BodySpec(key, variants, mesh, first.given, grids[key], first.tables.labels)
    return Sweep(tree.absolute(base, path), vary, tuple(checked), shared, scenes[0].title, is_list)


def _shaping(variants: Sequence[Variant], labels: LabelsTable | None) -> tuple[Variant, ...]:
    """Return the variants that shape a body."""
    return tuple({variant.gauges: variant for variant in variants}.values()) if labels else tuple(variants)


def _grids(scenes: Mapping[str, Scene]) -> dict[str, tuple[Marker, ...]]:
    """Return the markers of the grid of each body; bodies of different shape have one name for one place x, z."""
    own = dict[str, tuple[Marker, ...]]()
    for key, scene in scenes.items():
        table, dim = scene.tables.marker_grid, 3 if scene.domain == "solid" else 2
        own[key] = grid_markers(scene.design, table.spacing_mm, dim) if table else ()
    places = sorted({_across(marker) for markers in own.values() for marker in markers})
    names = {place: f"grid_{k}" for k, place in enumerate(places, start=1)}
    return {key: tuple(replace(m, name=names[_across(m)]) for m in markers) for key, markers in own.items()}


def _across(marker: Marker) -> tuple[float, float]:
    return round(marker.x_mm, 9), round(marker.z_mm, 9)


def _with_effects(scenes: list[Scene], report: Progress) -> list[Scene]:
    """Return scenes with the effects that the deepest press among them calls for: no table mixes two models."""
    open_ones = [scene for scene in scenes if scene.open_effects]
    if not open_ones:
        return scenes

    def deepest(scene: Scene) -> tuple[float, float]:
        model = scene.with_effects(scene.fixed_effects).model()
        return max(leg.force_N or 0.0 for leg in model.legs), model.largest_depth_mm / model.design.height_mm

    def closed(scene: Scene) -> Scene:
        return scene.with_effects([*scene.fixed_effects, *(name for name in used if name in scene.open_effects)])

    _, need = settled(max(open_ones, key=deepest), report)
    used = need.used if need else ()
    return [closed(scene) if scene.open_effects else scene for scene in scenes]


SAMPLERS = ("lhs", "random")
"""Latin hypercube samples, of which each of n equal parts of every range holds one; and independent ones."""

_SAMPLE_EXAMPLE = "--sample lhs:200 --range friction.mu=0.05:1"


def rows_of(path: Path) -> tuple[Vary, ...]:
    """Read points from a CSV file: a column for each key, which the first line names, and a row for each point.

    Raises
    ------
    Finger3dError
        If it cannot be read, or a cell is missing.
    """
    table = read_table(Path(path), lambda cell: cell.partition(".")[0] in SceneTable.model_fields)
    if not table.names or not all(table.names):
        raise Finger3dError(f"--points {path}: its line of names must have a key in every column, such as friction.mu")
    if not table.rows:
        raise Finger3dError(f"--points {path}: has no row below its line of names")
    texts = table.texts(table.names)
    if empty := next((line for line, row in zip(table.lines, table.rows, strict=True) if not all(row)), 0):
        raise Finger3dError(f"--points {path}, line {empty}: must have a value in each of {len(table.names)} columns")
    return tuple(Vary(key, tuple(texts[key])) for key in table.names)


def drawn(sample: str, ranges: Sequence[str], seed: int) -> tuple[Vary, ...]:
    """Return samples within ranges; the same ones for the same arguments.

    Parameters
    ----------
    sample : ``lhs:NUMBER``, a Latin hypercube, or ``random:NUMBER``
    ranges : ``KEY=LOW:HIGH`` each
    seed : of the random numbers

    Raises
    ------
    Finger3dError
        If an argument is not as described.
    """
    kind, _, text = sample.partition(":")
    count = int(text) if text.isdecimal() else 0
    if kind not in SAMPLERS or not 1 <= count <= MOST:
        allowed = f"lhs:NUMBER or random:NUMBER, for instance {_SAMPLE_EXAMPLE}"
        raise Finger3dError(f"--sample {shown(sample)}: must be {allowed}")
    if not ranges:
        needed = f"give at least one range, for instance {_SAMPLE_EXAMPLE}"
        raise Finger3dError(f"--sample {sample}: nothing varies; {needed}")
    if seed < 0:
        raise Finger3dError(f"--seed {seed}: must be 0 or more")
    bounds = [FreeKey.of(text, "--range", f"as in {_SAMPLE_EXAMPLE}") for text in ranges]
    check_distinct([free.key for free in bounds], "--range")
    random = np.random.default_rng(seed)
    columns = []
    for free in bounds:
        share = random.random(count)
        if kind == "lhs":
            share = (random.permutation(count) + share) / count
        columns.append(Vary(free.key, tuple(map(repr, (free.low + (free.high - free.low) * share).tolist()))))
    return tuple(columns)
