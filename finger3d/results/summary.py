"""Files in a folder of results: JSON and CSV, and title, gauges and steps of a summary."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from finger3d._types import Tree, TreeView
from finger3d.errors import Finger3dError, Outcome
from finger3d.mechanics.discretise.companions import FACTOR
from finger3d.mechanics.readings import Column, Gauge, displacement_columns, named, pressure_column, strain_columns
from finger3d.scene.tables import GaugeTable, record_of

ROUND_OFF = 1e-9
"""Motion (mm, degrees) that is round-off, and force over the friction sum."""

_KINDS = dict.fromkeys(("finger", "marker", "face", "status", "method", "outcome"), object) | dict.fromkeys(
    ("step", "iterations"), int
)
"""Types of the columns of a press's tables that are no floating-point numbers."""


@dataclass(frozen=True)
class PressStep:
    """Numbers of one increment, as in the entries of ``steps`` in summary.json.

    Attributes
    ----------
    depth_mm : press depth, the displacement of the object along -y since first touch
    slide_x_mm, slide_z_mm : displacement of the object along x and z since first touch
    turn_x_deg, turn_y_deg, turn_z_deg : turns of the object from where it touched first
    time_s : time at the end of the increment
    normal_force_N : sum of the contact forces along -y on the finger
    tangential_force_x_N, tangential_force_z_N : sum of the friction on the finger, without the pressure
    friction_sum_N : sum of |friction| over the contact points
    force_x_N, force_y_N, force_z_N : sum of pressure and friction on the finger, which a load cell reads
    moment_x_Nmm, moment_y_Nmm, moment_z_Nmm : its moment about the middle of the base
    outward_friction_x_N, outward_friction_z_N : sum of the friction away from the object's lowest point
    contact_area_mm2, stick_area_mm2 : area at rest of the zones of contact and of stick, which end between the points
    stick_ratio_area, stick_ratio_force : share of the contact area, and of the normal force, that sticks
    slip_margin : 1 less the tangential load over the largest that can be held in its direction; 0: slips as a whole
    largest_penetration_mm : how deep any place of the finger's free surface is inside the object; of its contact points
        where the object is elastic, and while the press runs
    contact_half_length_mm, stick_half_length_mm : half the extent along x, at rest, of contact and stick zone at z = 0
    contact_half_length_end_mm : half the extent of the contact zone at z = width/2; None for a section
    external_work_mJ, dissipation_mJ : work done on the finger, and work lost to friction, since the start
    gauges : strain by the name of the gauge, dimensionless; None if it is unknown
    markers : displacement along x, y and z by the name of the marker, mm
    taxels : pressure by the name of the taxel, MPa
    other_readings : numbers of readings of other kinds by their columns; absent without any
    iterations : of the contact solver
    residual : largest violation of the contact conditions, dimensionless; None if it is not finite
    method : the algorithm that solved the increment
    outcome : "converged", or what failed
    """

    depth_mm: float
    slide_x_mm: float
    slide_z_mm: float
    turn_x_deg: float
    turn_y_deg: float
    turn_z_deg: float
    time_s: float
    normal_force_N: float
    tangential_force_x_N: float
    tangential_force_z_N: float
    friction_sum_N: float
    force_x_N: float
    force_y_N: float
    force_z_N: float
    moment_x_Nmm: float
    moment_y_Nmm: float
    moment_z_Nmm: float
    outward_friction_x_N: float
    outward_friction_z_N: float
    contact_area_mm2: float
    stick_area_mm2: float
    stick_ratio_area: float
    stick_ratio_force: float
    slip_margin: float
    contact_half_length_mm: float
    stick_half_length_mm: float
    largest_penetration_mm: float
    external_work_mJ: float
    dissipation_mJ: float
    gauges: Mapping[str, float | None]
    iterations: int
    residual: float | None
    method: str
    outcome: str
    contact_half_length_end_mm: float | None = None
    markers: Mapping[str, Sequence[float]] = field(default_factory=dict)
    taxels: Mapping[str, float] = field(default_factory=dict)
    other_readings: Mapping[str, float] = field(default_factory=dict)

    @property
    def readings(self) -> dict[Column, float | None]:
        """Readings of gauges, markers and taxels by column."""
        return readings_of(self.gauges, self.markers, self.taxels)


def readings_of(
    gauges: Mapping[str, float | None], markers: Mapping[str, Sequence[float]], taxels: Mapping[str, float]
) -> dict[Column, float | None]:
    """Return readings by column from those of an entry of ``steps``, which are sorted by the kind of their sensors."""
    strains = {strain_columns(name)[0]: strain for name, strain in gauges.items()}
    displacements = {
        column: component
        for name, displacement in markers.items()
        for column, component in zip(displacement_columns(name), displacement, strict=True)
    }
    return {**strains, **displacements, **{pressure_column(name): pressure for name, pressure in taxels.items()}}


def steps_of(summary: TreeView) -> tuple[PressStep, ...]:
    """Return the steps of a summary.

    Raises
    ------
    TypeError
        If they are not as a press writes them.
    """
    return tuple(PressStep(**step) for step in summary["steps"])


def without_round_off(value: float) -> float:
    """Return a motion, mm or degrees, as 0 if it is round-off."""
    return 0.0 if abs(value) < ROUND_OFF else value


def grip_rows(summary: TreeView) -> Iterator[tuple[str, str]]:
    """Yield what two fingers have besides: whether they hold the object, where it is, how near each is to slipping."""
    if "fingers" not in summary:
        return
    held, pose = summary["held"], summary["object_pose"]
    yield "held", "yes" if held is True else f"no: {held}"
    if least := summary["least_grip_N"]:
        yield "least grip", f"{least:.4g} N, within 1 %"
    if pose:
        keys = [f"{axis}_mm" for axis in "xyz"], [f"turn_{axis}_deg" for axis in "xyz"]
        moved, turns = (", ".join(f"{without_round_off(pose[key]):.4g}" for key in names) for names in keys)
        yield "object", f"moved by {moved} mm, turned by {turns} deg; each finger closed by {pose['closing_mm']:.4g} mm"
    for finger in summary["fingers"]:
        last = finger["steps"][-1]
        text = f"normal force {last['normal_force_N']:.5g} N, slip margin {last['slip_margin']:.3g}"
        yield f"{finger['finger']} finger", text


def read_json(path: Path) -> Tree:
    """Read a result.

    Raises
    ------
    Finger3dError
        If it is not there, or is no JSON object.
    """
    try:
        found: object = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise Finger3dError(f"{path.parent}: holds no {path.name}; give a folder of results") from None
    except (OSError, ValueError, RecursionError) as error:
        raise Finger3dError(f"{path}: cannot be read ({error}); make the results again") from None
    if not isinstance(found, dict):
        raise Finger3dError(f"{path}: holds no JSON object; make the results again")
    return found


def press_summary(folder: Path) -> Tree:
    """Read summary.json in the folder of a press.

    Raises
    ------
    Finger3dError
        If the folder holds no results of a press, or the summary is not as a press writes it.
    """
    if not folder.is_dir():
        raise Finger3dError(f"{folder}: there is no such folder; give the --out of a press")
    if not (folder / "summary.json").exists():
        raise Finger3dError(f"{folder}: holds no results of a press (no summary.json); give the --out of a press")
    summary = read_json(folder / "summary.json")
    try:
        title_of(summary["scene"]), gauges_of(summary["scene"])
        texts = [summary["outcome"], *summary["warnings"], *summary["advice"], summary["scene"].get("title") or ""]
        if not all(isinstance(text, str) for text in texts):
            raise TypeError(texts)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        raise Finger3dError(f"{folder / 'summary.json'}: is damaged; press {folder}/scene.toml again") from None
    return summary


def read_columns(path: Path) -> Tree:
    """Return the columns of a table of a press, (n,) numbers or texts; none if the file does not exist.

    Raises
    ------
    Finger3dError
        If it cannot be read.
    """
    rows = read_rows(path)
    try:
        if any(None in (*row, *row.values()) for row in rows):
            raise ValueError("rows of different lengths")
        return {
            name: np.array([row[name] for row in rows], dtype=_KINDS.get(name, float)) for name in (rows or [{}])[0]
        }
    except ValueError as error:
        raise Finger3dError(f"{path}: is damaged ({error}); make the results again") from None


def read_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file by column; none if the file does not exist.

    Raises
    ------
    Finger3dError
        If it cannot be read.
    """
    if not path.is_file():
        return []
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise Finger3dError(f"{path}: cannot be read ({error}); make the results again") from None


def title_of(scene: TreeView) -> str:
    """Return the title of the scene, or the names of finger and object."""
    object_ = (scene.get("object") or {}).get("shape", "plane")
    return scene.get("title") or f"{scene['finger']['geometry']} on a {object_}"


def gauges_of(scene: TreeView) -> list[Gauge]:
    """Return the gauges of a scene, as in summary.json.

    Raises
    ------
    ValueError, TypeError
        If they are not as a press writes them.
    """
    return [record_of(Gauge, GaugeTable.model_validate(gauge)) for gauge in scene.get("gauge") or ()]


def strains_of(scene: TreeView) -> list[Column]:
    """Return the columns of the strains of a scene's gauges, then those of the strains without foils."""
    columns = [strain_columns(gauge["name"]) for gauge in scene.get("gauge") or ()]
    return [own for own, _ in columns] + [free for _, free in columns]


FORCE = "force_N_per_mm"

SHOWN = named(
    FORCE,
    "contact_length_mm",
    "stick_length_mm",
    "friction_sum_N_per_mm",
    "friction_along_x_N_per_mm",
    "friction_along_z_N_per_mm",
    "peak_pressure_MPa",
)
"""Quantities that tables and figures of a comparison show."""


@dataclass(frozen=True)
class Case:
    """Result of one model of the scene at the end of the path.

    Attributes
    ----------
    model : plane stress, plane strain, or solid
    size_mm : edge length at the contact
    numbers : quantity -> value, forces per width; see `finger3d.analyses.compare.quantities`
    strains : columns of the strains among the numbers
    errors : quantity -> error bar of mesh and increments; empty if it was not estimated
    lines : line along x ("z = 0", "end") -> columns x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa, status
    outcome : `numbers` is empty unless it is CONVERGED
    companion : quantities on the companion mesh
    ratio : edge length of the companion mesh relative to this one's
    method : method of the error estimate, or why there is none
    """

    model: str
    width_mm: float
    size_mm: float
    mesher: str
    outcome: Outcome
    numbers: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)
    lines: Mapping[str, TreeView] = field(default_factory=dict)
    seconds: float = 0.0
    companion: Mapping[str, float] = field(default_factory=dict)
    ratio: float = FACTOR
    method: str = ""
    strains: Sequence[Column] = ()

    @property
    def ok(self) -> bool:
        """Whether the path converged."""
        return self.outcome.ok

    def as_dict(self) -> Tree:
        """Return the entry of compare.json."""
        kept = ("model", "width_mm", "size_mm", "mesher", "outcome", "numbers", "errors", "lines", "seconds")
        return {name: getattr(self, name) for name in kept} | {
            "outcome": str(self.outcome),
            "error_method": self.method,
        }
