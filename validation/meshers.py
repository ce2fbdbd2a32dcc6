"""At equal edge lengths, which of fTetWild and netgen meshes faster and better, and which leaves the smaller error?

Every body is meshed anew three times by each mesher, and pressed. Errors of force and gauge are those of the first mesh
against a structured mesh of the same body with half the edge lengths, and for the hemisphere, which has none, against
netgen's with half of them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from build123d import export_step

import finger3d
from finger3d._types import Tree
from finger3d.accuracy.estimate import press_numbers
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import march
from finger3d.scene import Scene, parse

from ._press import empty_mesh_cache
from ._rows import Result, Row, columns, given, listed

judged = listed(__file__)

MESHERS = ("ftetwild", "netgen")
GIVEN = given(__file__)
"""Tables that all scenes have, and those of every body."""


def scene(body: Tree, mesher: str, share: float = 1.0) -> Scene:
    """Return the scene of a body with a mesher, and edge lengths times `share`."""
    edges = {key: share * length for key, length in body["mesh"].items()}
    return parse(GIVEN["all"] | body | {"mesh": {"mesher": mesher, **edges}})


class Meshed(NamedTuple):
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


def run(quick: bool) -> Result:
    """All bodies; quick: the one from the STEP file."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        step = Path(folder, "finger.step")
        export_step(finger3d.designs()["clipped_cylinder"](20.0, 10.0, 5.0, 8.0).solid(), step)
        for name, given in GIVEN["body"].items():
            if quick and name != "STEP":
                continue
            body = given | {"finger": {"geometry": str(step)}} if name == "STEP" else given
            truth = _pressed(scene(given, "netgen" if name == "hemisphere" else "swept", 0.5))[1]
            found += [_meshed(name, body, mesher, truth) for mesher in MESHERS]
    return Result(tuple(_rows(found)), columns(" ".join(Meshed._fields), found), lambda figure: _draw(figure, found))


def _meshed(name: str, body: Tree, mesher: str, truth: dict[str, float]) -> Meshed:
    runs = [_pressed(scene(body, mesher), press=i == 0) for i in range(3)]
    report, numbers = runs[0]
    force, gauge = (abs(numbers[key] / truth[key] - 1.0) for key in ("normal_force_N", "gauge_g"))
    made = [one for one, _ in runs]
    return Meshed(
        name, mesher, report.cells, float(np.median([one.seconds["mesh"] for one in made])),
        len({one.hash for one in made}), min(one.min_dihedral_deg for one in made),
        abs(report.volume_mm3 / report.cad_volume_mm3 - 1.0), force, gauge,
    )  # fmt: skip


def _pressed(given: Scene, press: bool = True) -> tuple[Any, dict[str, float]]:
    """Return the report on the mesh, made anew, and the numbers after the press."""
    with empty_mesh_cache():
        problem = build(given.model())
    return problem.body.report, press_numbers(problem, list(march(problem))[-1]) if press else {}


def _rows(found: list[Meshed]) -> Iterator[Row]:
    for name in dict.fromkeys(m.body for m in found):
        wild, gen = (next(m for m in found if (m.body, m.mesher) == (name, mesher)) for mesher in MESHERS)
        yield judged("different-meshes", gen.different_meshes, name=name)
        for m in (wild, gen):
            yield judged("volume-error", m.volume_error, name=name, mesher=m.mesher)
            yield judged("error-of-force", m.force_error, name=name, mesher=m.mesher)
        yield judged("seconds", gen.seconds / wild.seconds, name=name)
        yield judged("dihedral-angle", gen.min_dihedral_deg / wild.min_dihedral_deg, name=name)
        for key, what in (("force_error", "force"), ("gauge_error", "gauge")):
            ratio = getattr(gen, key) / getattr(wild, key)
            yield judged("error-over-other", ratio, name=name, what=what)


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
