"""Does CalculiX find the forces of a press in the deck that `finger3d export --solver calculix` writes of it?

Sections and solids on a cylinder, a ball, a rounded wedge, a wave and a plane are pressed, slid and released, in small
strain and at large deformation with every law, with one material and with two.  The deck has the mesh, the materials,
the object and the path of the scene; the contact is CalculiX's surface to surface penalty, finger3d's multipliers.
CalculiX (calculix-ccx 2.20) runs only where it is installed; otherwise, and in the quick version, the forces are
compared with those that it gave for this study; the quick version has the first three.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import finger3d
from finger3d.analyses.calculix.press import press_deck
from finger3d.scene import Scene

from ._ccx import printed_forces, program, solve
from ._rows import Result, Row

TOLERANCE, REASON = 0.01, "wanted of the deck: 1 %; penalty and multipliers, facets and surface: 0.8 % or less measured"
LIMIT_S = 1200.0

BLOCK = """
[finger]
geometry = "block"
half_length_mm = 10.0
height_mm = 8.0
width_mm = 8.0
"""
FINGERTIP = """
[finger]
geometry = "fingertip"
radius_mm = 12.0
half_length_mm = 8.0
edge_height_mm = 4.0
width_mm = 8.0
skin_mm = 1.5
core_half_length_mm = 3.0
core_height_mm = 2.0
[parts.skin]
E_MPa = 0.5
nu = 0.4
[parts.core]
E_MPa = 20.0
nu = 0.3
"""
REST = """
[material]
E_MPa = 1.0
nu = 0.45
[friction]
mu = 0.25
[mesh]
mesher = "swept"
size_mm = 1.5
base_size_mm = 2.0
"""
SECTION = ('model.domain="plane-strain"', "mesh.size_mm=0.4", "mesh.base_size_mm=1.0")
CYLINDER = 'object={shape="cylinder",radius_mm=10.0}'
BALL = 'object={shape="sphere",radius_mm=10.0}'
SLIDE = (
    "press={leg=[{depth_mm=1.0,steps=4},{depth_mm=1.0,slide_x_mm=0.5,steps=5},{depth_mm=0.5,slide_x_mm=0.5,steps=3}]}"
)
PRESS = "press={depth_mm=1.0,steps=5}"


@dataclass(frozen=True)
class Case:
    """A press: its name, the finger, keys, and the force (N) along -y that CalculiX 2.20 gave."""

    name: str
    keys: tuple[str, ...]
    kept_N: float
    finger: str = BLOCK

    def scene(self) -> Scene:
        """The scene."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "scene.toml")
            path.write_text(self.finger + REST + "[press]\ndepth_mm = 1.0\n", encoding="utf-8")
            return finger3d.load(path, self.keys)


CASES = (
    Case("plane strain, cylinder, pressed, slid and half released", (*SECTION, CYLINDER, SLIDE), 4.450849),
    Case(
        "plane strain, rounded wedge",
        (*SECTION, PRESS, 'object={shape="wedge",angle_deg=20.0,tip_radius_mm=1.0}'),
        6.737336,
    ),
    Case("plane strain, wave", (*SECTION, PRESS, 'object={shape="wave",wavelength_mm=6.0,amplitude_mm=0.5}'), 20.8933),
    Case("plane strain, tilted plane", (*SECTION, PRESS, 'object={shape="plane",tilt_deg=3.0}'), 17.88315),
    Case("plane stress, cylinder", ('model.domain="plane-stress"', *SECTION[1:], CYLINDER, PRESS), 8.039136),
    Case(
        "plane strain, cylinder, Mooney-Rivlin",
        (*SECTION, CYLINDER, PRESS, 'effects.large_deformation={law="mooney-rivlin",c01_share=0.3}'),
        13.058834,
    ),
    Case(
        "plane strain, cylinder, Yeoh",
        (*SECTION, CYLINDER, PRESS, 'effects.large_deformation={law="yeoh",c2_over_c1=0.2,c3_over_c1=0.1}'),
        13.151518,
    ),
    Case(
        "plane strain, cylinder, Ogden",
        (*SECTION, CYLINDER, PRESS, 'effects.large_deformation={law="ogden",terms=[[0.7,2.0],[0.3,-3.0]]}'),
        13.111784,
    ),
    Case("solid, cylinder", (CYLINDER, PRESS), 8.812384),
    Case(
        "solid, ball, neo-Hookean",
        (
            PRESS,
            'object={shape="sphere",radius_mm=10.0}',
            "effects.large_deformation={}",
            "mesh.size_mm=1.0",
            "mesh.base_size_mm=3.0",
        ),
        6.556044,
    ),
    Case(
        "solid with a skin and a core, plane, neo-Hookean",
        (PRESS, "effects.large_deformation={}"),
        12.693952,
        FINGERTIP,
    ),
)


def run(quick: bool) -> Result:
    """Every case by this code, and by CalculiX where it is installed; quick: against the numbers kept."""
    runs = not quick and program() is not None
    if not quick and not runs:
        print(
            "calculix_export: ccx is not installed (apt install calculix-ccx); the numbers kept stay", file=sys.stderr
        )
    source = f"CalculiX, deck of the scene, {'run for this' if runs else '2.20, number kept'}"
    rows: list[Row] = []
    table: dict[str, list[Any]] = {"case": [], "calculix_N": [], "finger3d_N": []}
    for case in CASES[:3] if quick else CASES:
        scene = case.scene()
        ours = finger3d.press(scene.with_effects(scene.fixed_effects), error=False).last.normal_force_N
        theirs = calculix(scene) if runs else case.kept_N
        for key, value in zip(table, (case.name, theirs, ours), strict=True):
            table[key].append(value)
        rows.append(Row(f"force (N): {case.name}", source, theirs, ours, TOLERANCE, REASON, "validation"))
    return Result(tuple(rows), table, lambda figure: _draw(figure, table))


def calculix(scene: Scene) -> float:
    """Force (N) along -y on the whole finger at the end, by CalculiX."""
    made = press_deck(scene.model(), scene.title)
    with tempfile.TemporaryDirectory(prefix="finger3d_ccx_") as folder:
        path = Path(folder, "press.inp")
        path.write_text(made.deck.text(), encoding="ascii")
        solve(path, LIMIT_S)
        return -made.multiple * float(printed_forces(path.with_suffix(".dat"))[1][-1, 1])


def _draw(figure: Any, table: dict[str, list[Any]]) -> None:
    """Differences of the forces."""
    axes = figure.subplots()
    off = [100.0 * (o / t - 1.0) for o, t in zip(table["finger3d_N"], table["calculix_N"], strict=True)]
    axes.axvspan(-100.0 * TOLERANCE, 100.0 * TOLERANCE, color="0.92", label="tolerance: 1 %")
    axes.axvline(0.0, color="k", lw=0.6)
    axes.plot(off, range(len(off)), "o")
    axes.set_yticks(range(len(off)), table["case"], fontsize=8)
    axes.invert_yaxis()
    axes.set(xlabel="force, finger3d over CalculiX - 1, %", xlim=(-1.5, 1.5))
