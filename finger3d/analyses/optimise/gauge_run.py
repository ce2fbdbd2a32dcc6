"""Optimisation of the places of several gauges: presses, search, and the files of the result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from finger3d._ranges import FARTHEST_MM
from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.calibrate.tolerances import with_defaults
from finger3d.analyses.effects_by_need import settled_tables
from finger3d.analyses.free_keys import Bounds, FreeKey, free_keys
from finger3d.analyses.optimise.gauge_fields import GaugeFields
from finger3d.analyses.optimise.gauge_search import NOWHERE, SPACING_MM, Candidates, GaugeSet, Region, search
from finger3d.analyses.optimise.task import MUS, check_readings
from finger3d.errors import Finger3dError
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.mechanics.model import Model
from finger3d.plotting.optimise import GaugeMap, draw_places
from finger3d.progress import Progress
from finger3d.report.gauge_places import gauge_places_page
from finger3d.scene import Scene, Source, parse, tree
from finger3d.scene.derived import largest_spread

MOST = 8
"""Gauges that are placed together at most."""

_BOUNDS = {"gauge.x_mm": "x", "gauge.y_mm": "y", "gauge.z_mm": "z", "gauge.angle_deg": "angle"}
"""Free keys that bound the region, and the bounds of `Region` that they set."""


@dataclass(frozen=True)
class GaugePlaces:
    """Gauges that together determine mu best.

    Attributes
    ----------
    mus : (m,) coefficients of friction at which they are judged
    found : the gauges and their Fisher matrices
    maps : for each gauge, places (c, 3) and the mean standard deviation (c,) of mu if the gauge is moved there, in the
        best direction, while the others stay; infinite near these
    scene : with these gauges instead of its own
    """

    mus: tuple[float, ...]
    found: GaugeSet
    maps: tuple[tuple[Float, Float], ...]
    scene: Scene

    def as_dict(self) -> Tree:
        """Return the content of gauges.json."""
        sd, each = self.found.mu_sd, self.found.alone
        gauges = self.found.gauges
        first = [replace(self.found, gauges=gauges[: i + 1]).objective for i in range(len(gauges))]
        return {
            "scene": self.scene.as_dict(),
            "mu": list(self.mus),
            "mu_sd": sd,
            "mean_mu_sd": self.found.objective,
            "spacing_mm": self.found.spacing_mm,
            "gauges": [
                {
                    **table,
                    "mean_mu_sd_alone": float(own.mean()),
                    "mean_mu_sd_with_those_before": before,
                    "mu_sd_alone": own,
                }
                for table, own, before in zip(_gauge_tables(self.found), each, first, strict=True)
            ],
        }


def place_gauges(
    scene: Source,
    count: int,
    out: str | Path,
    free: Bounds | None = None,
    mus: Sequence[float] | None = None,
    noise: float = 1.5e-4,
    tolerances: Mapping[str, float] | None = None,
    overrides: Sequence[str] = (),
    report: Progress | None = None,
    spacing_mm: float = SPACING_MM,
) -> GaugePlaces:
    """Find the places and directions of gauges that together determine mu best, as ``finger3d optimise --gauges``.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    count : number of gauges
    out : folder for gauges.json, best.toml, map.csv, map.png and report.html
    free : bounds of ``gauge.x_mm``, ``gauge.y_mm``, ``gauge.z_mm`` and ``gauge.angle_deg``; without them the whole body
        at z = 0, in all directions
    mus : friction coefficients at which the gauges are judged, ascending; None: nine from 0.05 to 1
    noise : standard deviation of a strain reading
    tolerances : standard deviations by name, in place of the defaults of `calibrate`; 0 omits one
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``
    report : told about stages
    spacing_mm : least distance between the middles of two gauges: at their length, no two overlap

    Returns
    -------
    GaugePlaces
        With the scene that has these gauges, and the standard deviation of mu.

    Raises
    ------
    Finger3dError
        For a mistake in the scene or the numbers, or if a press fails.
    """
    report = report or Progress()
    given, path = settled_tables(scene, overrides, report)
    keys, mus = free_keys(free or ()), MUS if mus is None else mus
    if not 1 <= count <= MOST:
        raise Finger3dError(f"--gauges {count}: must be from 1 to {MOST}")
    check_readings(mus, 3, noise)
    if not 0.0 <= spacing_mm <= FARTHEST_MM:
        raise Finger3dError(f"--spacing {spacing_mm:g}: must be a number from 0 to {FARTHEST_MM:g} (mm)")
    scene = parse(given, path)
    model = scene.model()
    if model.inclusions is not None:
        raise Finger3dError(
            "optimise --gauges: not with effects.embedded_gauge, whose foils change the body wherever they lie; "
            "find the places without it, or optimise one gauge with --free gauge.NAME.x_mm"
        )
    region = _region(model, keys)
    with claimed(out, "optimise") as folder:
        fields = GaugeFields.of(model, mus, noise, with_defaults(tolerances, largest_spread(scene.tables)), report)
        found, everywhere = search(fields, region, count, report, spacing_mm)
        maps = tuple(_map(found, i, everywhere) for i in range(count))
        result = GaugePlaces(tuple(mus), found, maps, _with_gauges(given, path, found))
        report.stage("writing")
        _write(folder, result, model)
    return result


def _region(model: Model, free: Sequence[FreeKey]) -> Region:
    """Return the region with the bounds of the free keys."""
    bounds = {}
    for key in free:
        if key.key not in _BOUNDS:
            raise Finger3dError(
                f"--free {key.key}: with --gauges only {', '.join(_BOUNDS)} may be bounded, for instance "
                "--free gauge.y_mm=5:40"
            )
        ends = (key.low, key.high)
        bounds[_BOUNDS[key.key]] = ends if key.key != "gauge.angle_deg" else tuple(map(math.radians, ends))
    whole = Region.of(model)
    region = Region(*(bounds.get(name, getattr(whole, name)) for name in ("x", "y", "z", "angle")))
    for key in free:
        (low, high), own = getattr(region, _BOUNDS[key.key]), getattr(whole, _BOUNDS[key.key])
        if key.key in ("gauge.x_mm", "gauge.y_mm") and (high <= own[0] or low >= own[1]):
            raise Finger3dError(
                f"--free {key.key}={key.low:g}:{key.high:g}: {NOWHERE}; it reaches from {own[0]:g} to {own[1]:g} mm"
            )
    return region


def _map(found: GaugeSet, number: int, everywhere: Candidates) -> tuple[Float, Float]:
    """Return places (c, 3), and the mean standard deviation (c,) of mu with gauge `number` there, at its best angle."""
    values = found.objectives(everywhere, instead=number)
    places, which = np.unique(everywhere.places, axis=0, return_inverse=True)
    best = np.full(len(places), np.inf)
    np.minimum.at(best, which.ravel(), values)
    return places, best


def _gauge_tables(found: GaugeSet) -> list[Tree]:
    """Return the keys of the gauges as tables of a scene have them."""
    places = [dict(zip(("x_mm", "y_mm", "z_mm"), gauge.place.tolist(), strict=True)) for gauge in found.gauges]
    return [
        {"name": f"g{i}", **place, "angle_deg": math.degrees(gauge.angle)}
        for i, (place, gauge) in enumerate(zip(places, found.gauges, strict=True), start=1)
    ]


def _with_gauges(given: TreeView, path: Path | None, found: GaugeSet) -> Scene:
    """Return the scene with the gauges that were found instead of its own."""
    digits = {"x_mm": 3, "y_mm": 3, "z_mm": 3, "angle_deg": 2}
    gauges = [table | {k: round(table[k], n) for k, n in digits.items()} for table in _gauge_tables(found)]
    return parse(tree.frozen(tree.plain(given) | {"gauge": gauges}), path)


def _write(folder: Path, result: GaugePlaces, model: Model) -> None:
    write_text(folder / "best.toml", result.scene.to_toml(defaults=False))
    places = result.maps[0][0]
    columns: Tree = {f"{axis}_mm": places[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"mean_mu_sd_g{i + 1}_here": values for i, (_, values) in enumerate(result.maps)}
    write_csv(folder / "map.csv", columns)
    shown = [
        GaugeMap(float(g.place[0]), float(g.place[1]), g.angle, own, *one)
        for g, own, one in zip(result.found.gauges, result.found.alone, result.maps, strict=True)
    ]
    draw_places(folder / "map.png", result.mus, result.found.mu_sd, shown, model.design)
    write_json(folder / "gauges.json", result.as_dict())
    gauge_places_page(folder).write(folder)
