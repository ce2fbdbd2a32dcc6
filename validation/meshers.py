"""At equal edge lengths, which of fTetWild and netgen meshes faster and better, and which leaves the smaller error?

Every body is meshed anew three times by each mesher, and pressed. Errors of force and gauge are those of the first mesh
against a structured mesh of the same body with half the edge lengths, and for the hemisphere, which has none, against
netgen's with half of them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import finger3d
from finger3d.accuracy.estimate import press_numbers
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.scene import parse

from ._press import empty_mesh_cache
from ._rows import Result, Row, at_least, at_most, columns, zero

MESHERS = ("ftetwild", "netgen")
COMMON = {"material": {"E_MPa": 1.0, "nu": 0.45}, "friction": {"mu": 0.25}, "object": {"shape": "plane"}}
FINGERTIP = {
    "geometry": "fingertip", "radius_mm": 10.0, "half_length_mm": 8.0, "edge_height_mm": 8.0, "width_mm": 16.0,
    "skin_mm": 1.0, "core_half_length_mm": 3.0, "core_height_mm": 6.0,
}  # fmt: skip
SMALL = {
    "geometry": "clipped_cylinder", "radius_mm": 20.0, "half_length_mm": 10.0, "edge_height_mm": 5.0, "width_mm": 8.0,
}  # fmt: skip
FIG9 = {
    "geometry": "clipped_cylinder", "radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6,
    "width_mm": 20.0,
}  # fmt: skip


@dataclass(frozen=True)
class Body:
    """A pressed body: its table, depth (mm), edge lengths (mm), place and angle of a gauge, and other tables."""

    finger: dict[str, Any]
    depth: float
    sizes: tuple[float, float]
    gauge: tuple[float, float, float]
    more: dict[str, Any]

    def scene(self, mesher: str, share: float = 1.0) -> Any:
        """Return the scene with a mesher, and edge lengths times `share`."""
        size, base = self.sizes
        x, y, angle = self.gauge
        tree = {
            **COMMON,
            "finger": self.finger,
            "press": {"depth_mm": self.depth, "steps": 4},
            "mesh": {"size_mm": share * size, "base_size_mm": share * base, "mesher": mesher},
            "gauge": ({"name": "g", "x_mm": x, "y_mm": y, "angle_deg": angle},),
            **self.more,
        }
        return parse(tree)


@dataclass(frozen=True)
class Meshed:
    """A body as a mesher left it; errors are relative."""

    body: str
    mesher: str
    cells: int
    seconds: float
    different_meshes: int
    min_dihedral_deg: float
    volume_error: float
    force_error: float
    gauge_error: float


def bodies(folder: Path) -> dict[str, Body]:
    """Return the bodies by name; a STEP file is written to the folder."""
    from build123d import export_step

    export_step(finger3d.designs()["clipped_cylinder"](20.0, 10.0, 5.0, 8.0).solid(), folder / "finger.step")
    parts = {"parts": {"skin": {"E_MPa": 3.0, "nu": 0.45}, "core": {"E_MPa": 100.0, "nu": 0.3}}}
    return {
        "Fig. 9": Body(FIG9, 5.0, (4.0, 12.0), (20.0, 40.0, 30.0), {}),
        "fingertip": Body(FINGERTIP, 0.6, (1.2, 3.0), (4.5, 6.0, 30.0), parts),
        "STEP": Body({"geometry": str(folder / "finger.step")}, 0.6, (1.0, 2.5), (4.0, 4.0, 30.0), {}),
        "hemisphere": Body({"geometry": "hemisphere", "radius_mm": 5.0}, 0.6, (0.6, 1.8), (1.0, 3.0, 30.0), {}),
    }


def run(quick: bool) -> Result:
    """All bodies; quick: the one from the STEP file."""
    with tempfile.TemporaryDirectory() as folder:
        every = bodies(Path(folder))
        found = []
        for name, body in every.items():
            if quick and name != "STEP":
                continue
            fine = Body(SMALL, body.depth, body.sizes, body.gauge, {}) if name == "STEP" else body
            truth = _pressed(fine.scene("netgen" if name == "hemisphere" else "swept", 0.5))[1]
            found += [_meshed(name, body, mesher, truth) for mesher in MESHERS]
    lines = [tuple(vars(m).values()) for m in found]
    names = "body mesher cells seconds different_meshes min_dihedral_deg volume_error force_error gauge_error"
    return Result(tuple(_rows(found)), columns(names, lines), lambda figure: _draw(figure, found))


def _meshed(name: str, body: Body, mesher: str, truth: dict[str, float]) -> Meshed:
    runs = [_pressed(body.scene(mesher), press=i == 0) for i in range(3)]
    report, numbers = runs[0]
    error = {key: abs(numbers[key] / truth[key] - 1.0) for key in ("normal_force_N", "gauge_g")}
    return Meshed(
        name,
        mesher,
        report.cells,
        float(np.median([made.seconds["mesh"] for made, _ in runs])),
        len({made.hash for made, _ in runs}),
        min(made.min_dihedral_deg for made, _ in runs),
        abs(report.volume_mm3 / report.cad_volume_mm3 - 1.0),
        error["normal_force_N"],
        error["gauge_g"],
    )


def _pressed(scene: Any, press: bool = True) -> tuple[Any, dict[str, float]]:
    """Return the report on the mesh, made anew, and the numbers after the press."""
    with empty_mesh_cache():
        problem = build(scene.model())
    return problem.body.report, press_numbers(problem, list(march(problem))[-1]) if press else {}


def _rows(found: list[Meshed]) -> Iterator[Row]:
    for name in dict.fromkeys(m.body for m in found):
        wild, gen = (next(m for m in found if (m.body, m.mesher) == (name, mesher)) for mesher in MESHERS)
        yield Row(f"{name}: different meshes of three by netgen", "the same program and input", 1, gen.different_meshes,
                  0.0, "a count", measure="absolute")  # fmt: skip
        for m in (wild, gen):
            yield zero(f"{name}: volume error, {m.mesher}", "CAD", m.volume_error, 1e-3,
                       "quadratic cells on the CAD faces: 1e-3 at 30 degrees an edge")  # fmt: skip
            yield zero(f"{name}: error of the force, {m.mesher}", "mesh with half the edge lengths", m.force_error,
                       0.03, "the error bar of such meshes, 1 to 3 % (error_bars)")  # fmt: skip
        yield at_most(f"{name}: seconds of netgen over those of fTetWild", "netgen is faster", 1.0,
                      gen.seconds / wild.seconds, "a statement", "statement")  # fmt: skip
        yield at_least(f"{name}: least dihedral angle of netgen over fTetWild's", "netgen's is larger", 1.0,
                       gen.min_dihedral_deg / wild.min_dihedral_deg, "a claim", "statement")  # fmt: skip
        for key, what in (("force_error", "force"), ("gauge_error", "gauge")):
            ratio = getattr(gen, key) / getattr(wild, key)
            yield at_most(f"{name}: error of the {what} of netgen over fTetWild's", "netgen's is smaller", 1.0, ratio,
                          "a statement", "statement")  # fmt: skip


def _draw(figure: Any, found: list[Meshed]) -> None:
    figure.set_size_inches(12.0, 3.6)
    names = list(dict.fromkeys(m.body for m in found))
    shown = (("seconds", 1.0, "time, s"), ("min_dihedral_deg", 1.0, "least dihedral angle, degrees"),
             ("force_error", 100.0, "error of force, %"), ("gauge_error", 100.0, "error of gauge, %"))  # fmt: skip
    for axes, (key, factor, title) in zip(figure.subplots(1, len(shown)), shown, strict=True):
        for i, (mesher, colour) in enumerate(zip(MESHERS, ("#2c5d8f", "#c0392b"), strict=True)):
            values = [factor * getattr(m, key) for m in found if m.mesher == mesher]
            axes.barh(np.arange(len(names)) + 0.4 * i - 0.2, values, 0.38, color=colour, label=mesher)
        axes.set_yticks(np.arange(len(names)), names)
        axes.set_xlabel(title)
        axes.invert_yaxis()
    figure.axes[0].legend()
