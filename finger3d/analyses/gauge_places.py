"""Optimal places of several gauges: the strain at any place of a body, the search, and the files of its result.

The displacement of each press gives the strain of a gauge at any place along any direction, so that all candidates
share the presses.  The tolerances are those of a calibration, each a finite difference over one standard deviation.

The gauges are found one after another, each the best beside those before it (greedy), and then exchanged one at a time
as long as that helps: first on a grid over the whole region, then on finer and finer ones around each gauge.  Their
middles keep a distance: two gauges of that length then overlap in no direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from finger3d._ranges import FARTHEST_MM
from finger3d._types import Float, Tree, TreeView
from finger3d.accuracy.error_bars import gain
from finger3d.analyses.calibrate.tolerances import deeper, poisson_steps, tilted_mesh, with_defaults, with_modulus
from finger3d.analyses.free_keys import Bounds, FreeKey, free_keys, settled_tables
from finger3d.analyses.optimise import MUS, check_readings
from finger3d.analyses.pressed_body import PressedBody, presses, under
from finger3d.errors import Finger3dError
from finger3d.fem.recovery import StrainReader, displacement
from finger3d.io import claimed, write_csv, write_json, write_text
from finger3d.mechanics.discretise.companions import built_like, companion, edge_ratio
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult
from finger3d.mechanics.march.step_halving import with_steps
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import Kind
from finger3d.objects import Plane
from finger3d.plotting.analyses import GaugeMap, draw_places
from finger3d.progress import Progress
from finger3d.report.analyses import gauge_places_page
from finger3d.scene import Scene, Source, parse, tree
from finger3d.scene.material import largest_spread
from finger3d.sensor.curve import SHARED
from finger3d.sensor.likelihood import ReadingEffects, mu_sd, prior

_STEPS, _STEPS_OF_SECTION = 20, 80
"""Number of increments of a leg with automatic increments; few suffice, as places are only compared.  In a section in
small strain they cost little, and twenty lead to other places: in the finger of Fig. 9 two gauges then tell mu to 0.016
in place of 0.014."""


@dataclass(frozen=True)
class StrainField:
    """Strain of a body pressed with several mu (m).

    Attributes
    ----------
    u : (m, n, d) displacements of the meshed part, mm
    """

    problem: Problem
    u: Float

    @classmethod
    def of(cls, problem: Problem, mus: Sequence[float]) -> StrainField:
        """Press a body; a press that fails is an error."""
        found = sorted(presses(problem, list(mus)), key=lambda p: p.mu)
        return cls.of_frames(problem, [p.frame for p in found], mus)

    @classmethod
    def of_frames(cls, problem: Problem, frames: Sequence[StepResult], mus: Sequence[float]) -> StrainField:
        """Return the field of the last increments of presses."""
        for mu, frame in zip(mus, frames, strict=True):
            frame.check(f"optimise: mu = {mu:g}")
        unknowns = formulation_of(problem.model).unknowns(problem, [f.meshed_state for f in frames])
        return cls(problem, np.array([displacement(problem.mesh, x) for x in unknowns]))

    def strain(self, points: Float, angles: Float) -> Float:
        """Return the strain (p, a, m) at points (p, 3) along directions (a,), rad; NaN outside the body."""
        d, finite = self.problem.dim, self.problem.model.finite_strain
        reader = StrainReader.at(self.problem.mesh, points[:, :d], self.problem.axes)
        every = np.stack([reader.green_lagrange(u) if finite else reader.strain(u) for u in self.u], axis=-1)
        c, s = np.cos(angles), np.sin(angles)
        along = np.einsum("pkm,ka->pam", every, np.stack([c * c, s * s, 2.0 * s * c]))
        return np.asarray(np.sqrt(1.0 + 2.0 * along) - 1.0 if finite else along)


@dataclass(frozen=True)
class GaugeFields:
    """Strain fields of a body and of those that its tolerances make of it.

    Attributes
    ----------
    mus : (m,) ascending
    noise : standard deviation of a strain reading
    tolerances : standard deviation by name
    shared : for each tolerance that changes all gauges together, its effect (p, a, m) at given points and angles
    coarse, gain : field on the companion mesh, and its change over the error of the mesh
    """

    nominal: StrainField
    mus: tuple[float, ...]
    noise: float
    tolerances: Mapping[str, float]
    shared: Mapping[str, Callable[[Float, Float], Float]]
    coarse: StrainField | None = None
    gain: float = 1.0

    @classmethod
    def of(
        cls, model: Model, mus: Sequence[float], noise: float, tolerances: Mapping[str, float], report: Progress
    ) -> GaugeFields:
        """Press the body of a model, and those that its tolerances make of it."""
        model = replace(model, gauges=(), markers=(), taxels=())
        report.stage("pressing the body")
        body = PressedBody(model, report)
        is_quick = body.problem.dim == 2 and not model.finite_strain
        legs = with_steps(body.problem, _STEPS_OF_SECTION if is_quick else _STEPS).model.legs
        ends = body.ends(list(mus), legs)
        nominal = StrainField.of_frames(under(body.problem, legs=legs), ends, mus)
        problem, shared = nominal.problem, {}
        for name in SHARED:
            if name in tolerances:
                report.stage(f"tolerance {name}")
                if (found := _effect(nominal, name, mus, tolerances[name])) is not None:
                    shared[name] = found
        coarse, ratio = None, 1.0
        if "mesh" in tolerances:
            report.stage("tolerance mesh")
            beside = companion(problem)
            coarse, ratio = StrainField.of(beside, mus), gain(edge_ratio(problem, beside), Kind.STRAIN.order)
        return cls(nominal, tuple(mus), noise, tolerances, shared, coarse, ratio)

    def effects(self, points: Float, angles: Float) -> ReadingEffects:
        """Return slopes, effects and variances of gauges at points (p, 3) along angles (a,), a candidate for each pair.

        Values are NaN for a candidate outside the body, or displaced out of it by a tolerance.
        """
        strain = self.nominal.strain(points, angles)
        slope = np.gradient(strain, np.array(self.mus), axis=-1)
        effects = [slope, *(effect(points, angles) for effect in self.shared.values())]
        variance = np.full(strain.shape, self.noise**2)
        for axis, name in enumerate(("gauge_x_mm", "gauge_y_mm")):
            if name in self.tolerances:
                variance = variance + self._displaced(points, angles, axis, self.tolerances[name]) ** 2
        if "gauge_angle_deg" in self.tolerances:
            turn = math.radians(self.tolerances["gauge_angle_deg"])
            turned = self.nominal.strain(points, angles + turn) - self.nominal.strain(points, angles - turn)
            variance = variance + (0.5 * turned) ** 2
        if self.coarse is not None:
            variance = variance + self.tolerances["mesh"] ** 2 * self._mesh_error(points, angles) ** 2
        return ReadingEffects(
            np.stack(effects, axis=-1).reshape(-1, len(self.mus), len(effects)), variance.reshape(-1, len(self.mus))
        )

    def _mesh_error(self, points: Float, angles: Float) -> Float:
        """Return the error (p, a, m) of the strain due to the mesh, the root mean square around each point.

        The strains of two meshes agree by chance at some points, as they do at some mu, so that the error is also
        nowhere below its root mean square over mu, as in a calibration.
        """
        assert self.coarse is not None
        radius = 0.5 * self.nominal.problem.model.mesh.base_size_mm
        squares = []
        for step in radius * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]]):
            change = self.coarse.strain(points + step, angles) - self.nominal.strain(points + step, angles)
            squares.append((change / self.gain) ** 2)
        with np.errstate(invalid="ignore"):
            known = np.isfinite(squares)
            square = np.where(known, squares, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        return np.asarray(np.sqrt(np.maximum(square, square.mean(axis=-1, keepdims=True))))

    def _displaced(self, points: Float, angles: Float, axis: int, sd: float) -> Float:
        step = sd * np.eye(3)[axis]
        return 0.5 * (self.nominal.strain(points + step, angles) - self.nominal.strain(points - step, angles))


Effect = Callable[[Float, Float], Float]


def _effect(nominal: StrainField, name: str, mus: Sequence[float], sd: float) -> Effect | None:
    """Return the effect of a tolerance that all gauges share, None if it has none.

    The press goes deeper, and the modulus or Poisson's ratio is raised; where all forces are proportional to the
    modulus, no strain depends on it.
    """
    problem, model, sign = nominal.problem, nominal.problem.model, 1.0
    if name == "tilt_deg":
        return _tilt(nominal, mus, sd)
    if name == "depth_mm":
        changed = under(problem, legs=deeper(model.legs, sd))
    elif name == "nu":
        material = model.material
        step, _ = poisson_steps(material.nu, sd)
        changed = built_like(problem, replace(model, material=replace(material, nu=material.nu + step)))
        sign = math.copysign(1.0, step)
    elif model.forces_scale_with_modulus:
        return None
    else:
        changed = with_modulus(problem, 1.0 + 0.01 * sd)
    other = StrainField.of(changed, mus)
    return lambda points, angles: sign * (other.strain(points, angles) - nominal.strain(points, angles))


def _tilt(nominal: StrainField, mus: Sequence[float], sd: float) -> Effect | None:
    """Tilt a plane by plus and minus one standard deviation; by symmetry, a mirrored gauge replaces the second tilt."""
    problem = nominal.problem
    plane = problem.model.object
    if not isinstance(plane, Plane):
        return None

    def tilted(sign: float) -> StrainField:
        changed = replace(plane, tilt=plane.tilt + sign * math.radians(sd))
        model = replace(problem.model, mesh=tilted_mesh(problem), object=changed, symmetry=None)
        return StrainField.of(built_like(problem, model), mus)

    plus = tilted(1.0)
    if "x" in problem.axes:
        mirror = np.array([-1.0, 1.0, 1.0])
        return lambda points, angles: (
            0.5 * (plus.strain(points, angles) - plus.strain(points * mirror, math.pi - angles))
        )
    minus = tilted(-1.0)
    return lambda points, angles: 0.5 * (plus.strain(points, angles) - minus.strain(points, angles))


NOWHERE = "no gauge within these bounds lies in the finger"

SPACING_MM = 3.0
"""Least distance between the middles of two gauges: the length of the measuring grid of a common foil gauge (HBM offers
1.5, 3 and 6 mm, and recommends 3 to 6 mm)."""

_PLACES = 1200
"""Places of the grid over the whole region, about."""

_ANGLES = np.radians(np.arange(0.0, 180.0, 7.5))
"""Directions that are compared on the grid."""

_LARGEST_SWEEPS = 5
"""Rounds of exchange on a grid."""

_REFINEMENTS, _PATCH = 3, np.linspace(-1.0, 1.0, 5)
"""Finer grids around each gauge, each of half the spacing, and their places and directions in spacings."""

_GAIN = 1e-3
"""Decrease of the standard deviation of mu, relative, below which a gauge is not exchanged."""


@dataclass(frozen=True)
class Region:
    """Region of gauge places: bounds of x, y, z (mm) and of the angle (rad)."""

    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]
    angle: tuple[float, float]

    @classmethod
    def of(cls, model: Model) -> Region:
        """Return the whole body at z = 0, in all directions."""
        half, top = model.design.half_length_mm, model.design.height_mm
        return cls((-half, half), (0.0, top), (0.0, 0.0), (0.0, math.pi))

    def grid(self) -> tuple[Float, float]:
        """Return places (p, 3) of a grid with equal spacing along x and y, and the spacing."""
        wide, high = self.x[1] - self.x[0], self.y[1] - self.y[0]
        layers = 1 if self.z[0] == self.z[1] else 3
        spacing = math.sqrt(max(wide * high, 1e-6) * layers / _PLACES)
        x, y = (_cell_middles(low, high, spacing) for low, high in (self.x, self.y))
        z = np.linspace(*self.z, layers)
        return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3), spacing

    def angles(self) -> Float:
        """Return the directions that are compared, rad."""
        low, high = self.angle
        inside = _ANGLES[(_ANGLES >= low - 1e-9) & (_ANGLES <= high + 1e-9)]
        return inside if len(inside) else np.array([0.5 * (low + high)])

    def around(self, place: Float, angle: float, spacing: float, turn: float) -> tuple[Float, Float]:
        """Return places (p, 3) and angles (a,) around a gauge, inside the region."""
        x = np.clip(place[0] + spacing * _PATCH, *self.x)
        y = np.clip(place[1] + spacing * _PATCH, *self.y)
        z = np.unique(np.clip(place[2] + spacing * np.array([-1.0, 0.0, 1.0]), *self.z))
        places = np.stack(np.meshgrid(np.unique(x), np.unique(y), z, indexing="ij"), axis=-1).reshape(-1, 3)
        return places, np.unique(np.clip(angle + turn * _PATCH, *self.angle))


def _cell_middles(low: float, high: float, spacing: float) -> Float:
    count = max(1, round((high - low) / spacing))
    return low + (high - low) * (np.arange(count) + 0.5) / count


@dataclass(frozen=True)
class Candidates:
    """Candidates for a gauge: places (c, 3), angles (c,), and what changes their readings."""

    places: Float
    angles: Float
    effects: ReadingEffects

    @classmethod
    def of(cls, fields: GaugeFields, points: Float, angles: Float) -> Candidates:
        """Return a candidate for every pair of a place and an angle that lies inside the body."""
        effects = fields.effects(points, angles)
        good = np.isfinite(effects.effects).all(axis=(1, 2)) & np.isfinite(effects.variance).all(axis=1)
        places, turned = np.repeat(points, len(angles), axis=0), np.tile(angles, len(points))
        return cls(places[good], turned[good], ReadingEffects(effects.effects[good], effects.variance[good]))


@dataclass(frozen=True)
class PlacedGauge:
    """A place (3,) mm, a direction (rad), and what the gauge there adds to the Fisher matrix (m, 1 + q, 1 + q)."""

    place: Float
    angle: float
    fisher: Float


@dataclass(frozen=True)
class GaugeSet:
    """Gauges that are chosen together.

    Attributes
    ----------
    gauges : in the order in which they were found
    prior : (1 + q, 1 + q) Fisher matrix without them
    spacing_mm : least distance between the middles of two
    """

    gauges: tuple[PlacedGauge, ...]
    prior: Float
    spacing_mm: float

    def objectives(self, candidates: Candidates, instead: int | None = None) -> Float:
        """Return the mean standard deviation (c,) of mu with each candidate more, or instead of a gauge.

        It is infinite for a candidate too near to another gauge.
        """
        values = objectives(self.fisher(without=instead), candidates)
        for i, gauge in enumerate(self.gauges):
            near = np.linalg.norm(candidates.places - gauge.place, axis=1) < self.spacing_mm * (1.0 - 1e-9)
            values[near & (i != instead)] = np.inf
        return values

    def fisher(self, without: int | None = None) -> Float:
        """Return the Fisher matrices (m, 1 + q, 1 + q) of all gauges but one."""
        return self.prior + sum(
            (g.fisher for i, g in enumerate(self.gauges) if i != without), start=np.zeros_like(self.prior)
        )

    @property
    def mu_sd(self) -> Float:
        """Standard deviation (m,) of mu."""
        return mu_sd(self.fisher())

    @property
    def objective(self) -> float:
        """Mean standard deviation of mu."""
        return float(self.mu_sd.mean())

    @property
    def alone(self) -> list[Float]:
        """Standard deviation (m,) of mu by each gauge alone."""
        return [mu_sd(self.prior + gauge.fisher) for gauge in self.gauges]

    def placed(self, gauge: PlacedGauge, instead: int | None = None) -> GaugeSet:
        """Return the set with a gauge more, or with one exchanged."""
        if instead is None:
            return replace(self, gauges=(*self.gauges, gauge))
        return replace(self, gauges=tuple(gauge if i == instead else g for i, g in enumerate(self.gauges)))


def objectives(fixed: Float, candidates: Candidates) -> Float:
    """Return the mean standard deviation (c,) of mu with each candidate beside gauges of Fisher matrices `fixed`."""
    return np.asarray(mu_sd(fixed + candidates.effects.fisher).mean(axis=-1))


def search(
    fields: GaugeFields, region: Region, count: int, report: Progress, spacing_mm: float = SPACING_MM
) -> tuple[GaugeSet, Candidates]:
    """Return the best `count` gauges at a distance `spacing_mm` or more, and the candidates of the whole region.

    The prior standard deviation of mu is that of a uniform distribution over the range of the pressed values.
    """
    report.stage("comparing places")
    spread = (fields.mus[-1] - fields.mus[0]) / math.sqrt(12.0)
    found = GaugeSet((), prior(len(fields.shared), spread), spacing_mm)
    points, spacing = region.grid()
    everywhere = Candidates.of(fields, points, region.angles())
    if not len(everywhere.angles):
        raise Finger3dError(f"optimise --gauges: {NOWHERE}; widen the bounds")
    for number in range(count):
        best, value = _best(found, everywhere)
        if not math.isfinite(value):
            raise Finger3dError(
                f"optimise --gauges {count}: only {number} have room {spacing_mm:g} mm apart within these bounds; "
                "lower --spacing, or widen the bounds"
            )
        found = found.placed(best)
        report.stage(f"{number + 1} gauge{'s' if number else ''}: mu +- {found.objective:.3g} in the mean")
    found = _exchanged(found, lambda _: everywhere)
    turn = math.radians(7.5)
    for _ in range(_REFINEMENTS):
        spacing, turn = 0.5 * spacing, 0.5 * turn
        found = _exchanged(
            found,
            lambda g, s=spacing, t=turn: Candidates.of(fields, *region.around(g.place, g.angle, s, t)),  # type: ignore[misc]
        )
    report.stage(f"polished: mu +- {found.objective:.3g} in the mean")
    return found, everywhere


def _best(found: GaugeSet, candidates: Candidates, instead: int | None = None) -> tuple[PlacedGauge, float]:
    """Return the best candidate beside gauges, or instead of one of them, and its objective."""
    values = found.objectives(candidates, instead)
    i = int(np.argmin(values))
    effects, variance = candidates.effects.effects[i], candidates.effects.variance[i]
    chosen = PlacedGauge(candidates.places[i], float(candidates.angles[i]), ReadingEffects(effects, variance).fisher)
    return chosen, float(values[i])


def _exchanged(found: GaugeSet, candidates: Callable[[PlacedGauge], Candidates]) -> GaugeSet:
    """Exchange one gauge at a time for a better one, until none helps."""
    for _ in range(_LARGEST_SWEEPS):
        before = found.objective
        for i, gauge in enumerate(found.gauges):
            other, value = _best(found, candidates(gauge), instead=i)
            if value < found.objective * (1.0 - _GAIN):
                found = found.placed(other, instead=i)
        if found.objective >= before * (1.0 - _GAIN):
            break
    return found


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
        tables = _gauge_tables(self.found)
        for count, (table, own) in enumerate(zip(tables, self.found.alone, strict=True), start=1):
            table["mean_mu_sd_alone"] = float(own.mean())
            table["mean_mu_sd_with_those_before"] = replace(self.found, gauges=self.found.gauges[:count]).objective
            table["mu_sd_alone"] = own
        return {
            "scene": self.scene.as_dict(),
            "mu": list(self.mus),
            "mu_sd": self.found.mu_sd,
            "mean_mu_sd": self.found.objective,
            "spacing_mm": self.found.spacing_mm,
            "gauges": tables,
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
    keys = "name", "x_mm", "y_mm", "z_mm", "angle_deg"
    rows = ((f"g{i}", *g.place.tolist(), math.degrees(g.angle)) for i, g in enumerate(found.gauges, start=1))
    return [dict(zip(keys, row, strict=True)) for row in rows]


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
