"""Beside the mold: a fit coupon, a finger on its carrier, and a test button with the scene of its press.

The press of a button of the same batch of silicone determines Young's modulus. The button is a cylinder of the standard
sizes of compression tests, ISO 815-1: 29 mm in diameter and 12.5 mm high (type A), or 13 mm and 6.3 mm (type B). It is
cast in a ring on a floor, levelled with a straight edge, glued to a plate with its lower face, and pressed by a greased
plate. The scene models just that: the base is fixed, and the plate has no friction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._types import Tree, TreeView
from finger3d.io import atomic
from finger3d.mold.body import Shell, shell, write_step
from finger3d.mold.cover import LABEL as CARRIER
from finger3d.mold.cover import finger_on_carrier, key_solids, openings
from finger3d.mold.fasteners import coupon, coupon_clearances
from finger3d.mold.options import MoldOptions
from finger3d.mold.parts import Mold
from finger3d.mold.solids import cylinder, one
from finger3d.scene import tree

if TYPE_CHECKING:
    from build123d import Solid

    from finger3d.scene import Scene


SIZES = ((29.0, 12.5), (13.0, 6.3))
"""Diameters and heights, mm, of the types A and B."""

_COMPRESSION = 0.1  # depth of the press over the height, where rubbers are still nearly linear
_STEPS = 5
_RANGE = 5.0  # bounds of the search: Young's modulus over and times this factor
_RECESS_MM = 1.5  # of the floor, in which the ring stands
_EDGE = 0.1  # edge length of the mesh over the diameter
_RING_RIMS = 2.5  # wall of the ring over the least rim


@dataclass(frozen=True)
class Button:
    """Diameter and height of a button, mm."""

    diameter_mm: float
    height_mm: float

    @property
    def volume_mm3(self) -> float:
        """Volume."""
        return math.pi * self.diameter_mm**2 / 4.0 * self.height_mm


def button_for(silicone_mm3: float) -> Button:
    """Return type A if it needs no more silicone than the fingers, else type B."""
    large, small = (Button(*size) for size in SIZES)
    return large if large.volume_mm3 <= silicone_mm3 else small


def button_parts(button: Button, options: MoldOptions) -> dict[str, Solid]:
    """Return the ring in which the button is cast and the floor on which it stands, as they lie on the bed (z up)."""
    d, h = button.diameter_mm * options.scale, button.height_mm * options.scale
    rim = options.rim_mm
    outer = d + 2.0 * _RING_RIMS * rim
    ring = cylinder((0.0, 0.0, 0.0), outer, h + _RECESS_MM, "z") - cylinder((0.0, 0.0, 0.0), d, h + _RECESS_MM, "z")
    recess, plate = outer + 2.0 * options.gap_mm, 2.0 * rim
    # A step in the floor fills the ring as far as the recess is deep, so that the button is as high as it should be.
    floor = cylinder((0.0, 0.0, 0.0), recess + 4.0 * rim, plate + _RECESS_MM, "z")
    floor -= cylinder((0.0, 0.0, plate), recess, _RECESS_MM, "z")
    floor += cylinder((0.0, 0.0, plate), d - 2.0 * options.gap_mm, _RECESS_MM, "z")
    return {"button_ring": one(ring, "button_ring"), "button_floor": one(floor, "button_floor")}


def button_solid(button: Button) -> Solid:
    """Return the button on y = 0, y up."""
    return cylinder((0.0, 0.0, 0.0), button.diameter_mm, button.height_mm, "y")


def button_scene(button: Button, title: str, E_MPa: float, nu: float) -> Tree:
    """Return the scene of the button's press; the measured curve goes down to a tenth of the height."""
    return {
        "title": f"Test button {button.diameter_mm:g} x {button.height_mm:g} mm: {title}"[:200],
        "finger": {"geometry": "button.step"},
        "material": {"E_MPa": E_MPa, "nu": nu},
        "object": {"shape": "plane"},
        "press": {"depth_mm": round(_COMPRESSION * button.height_mm, 3), "steps": _STEPS},
        "mesh": {"size_mm": round(_EDGE * button.diameter_mm, 3), "base_size_mm": round(_EDGE * button.diameter_mm, 3)},
    }


def identify_command(folder: str, E_MPa: float) -> str:
    """Return the command that turns the measured press, button.csv, into Young's modulus of the batch."""
    return (
        f"finger3d identify {folder}/button.toml --measured {folder}/button.csv "
        f"--free material.E_MPa={E_MPa / _RANGE:.3g}:{E_MPa * _RANGE:.3g} --out {folder}/button"
    )


EXTRA_FILES = ("button.step", "button.toml", "finger_on_carrier.step", "finger_on_carrier.toml")
"""Files that may lie beside those of a mold."""

_ANGLE = 0.2  # radians between facets of round parts


@dataclass(frozen=True)
class Extras:
    """Parts beside a mold, as they lie on the bed, and remarks about them."""

    parts: dict[str, Shell]
    remarks: tuple[str, ...]


def extra_parts(scene: Scene, mold: Mold, out: Path) -> Extras:
    """Return the coupon and the mold of the button, if the options ask for them."""
    o, remarks = mold.options, []
    solids: dict[str, Solid] = {}
    if o.coupon:
        solids |= coupon(o)
        gaps = ", ".join(f"{gap:g}" for gap in coupon_clearances(o))
        remarks.append(
            f"coupon: holes with 1, 2, ... notches have gaps of {gaps} mm; give the least that fits as --clearance-mm"
        )
    if o.button:
        button = button_for(mold.silicone_mm3)
        solids |= button_parts(button, o)
        E = scene.constants.E_MPa
        remarks.append(
            f"button: {button.diameter_mm:g} x {button.height_mm:g} mm, {button.volume_mm3 / 1e3:.2f} ml more; press "
            f"it, write depth_mm and normal_force_N to button.csv, and run: {identify_command(str(out), E)}"
        )
    tolerance = o.machine.tolerance_mm
    return Extras({name: shell(solid, tolerance, name, _ANGLE) for name, solid in solids.items()}, tuple(remarks))


def write_extras(scene: Scene, mold: Mold, solid: Solid | None, out: Path) -> tuple[list[Path], list[str]]:
    """Write the button's STEP file and scene, and the finger on its carrier; returns files and remarks.

    Parameters
    ----------
    solid : the finger by CAD; None for a finger of triangles
    """
    files, remarks = [], []
    if mold.options.button:
        button, material = button_for(mold.silicone_mm3), scene.constants
        write_step(out / "button.step", button_solid(button))
        with atomic(out / "button.toml") as temporary:
            text = tree.written(button_scene(button, scene.title, material.E_MPa, material.nu))
            temporary.write_text(text, encoding="utf-8")
        files += [out / "button.step", out / "button.toml"]
    if mold.options.carrier and solid is not None:
        path = out / "finger_on_carrier.step"
        write_step(path, _labelled(mold, solid))
        with atomic(out / "finger_on_carrier.toml") as temporary:
            text = tree.written(carrier_scene(scene.given, mold.options.carrier_mm))
            temporary.write_text(text, encoding="utf-8")
        files += [path, out / "finger_on_carrier.toml"]
        remarks.append(
            "finger_on_carrier.toml: the scene with the finger on its carrier, which is rigid; y of gauges and markers "
            f"is {mold.options.carrier_mm:g} mm larger there"
        )
    return files, remarks


def carrier_scene(tables: TreeView, cover_mm: float) -> Tree:
    """Return a scene whose finger stands on its rigid carrier, readings moved up with the silicone.

    Parameters
    ----------
    tables : the scene, as the user wrote it
    cover_mm : thickness of the carrier
    """
    scene = tree.plain(tables)
    scene["finger"] = {"geometry": "finger_on_carrier.step"}
    for kind in ("gauge", "marker"):
        scene[kind] = [{**one, "y_mm": one["y_mm"] + cover_mm} for one in scene.get(kind, [])]
        if not scene[kind]:
            del scene[kind]
    scene["parts"] = {**scene.get("parts", {}), CARRIER: {"rigid": True}}
    if "mesh" in scene:  # a STEP file has no structured mesh
        scene["mesh"] = {key: value for key, value in scene["mesh"].items() if key != "mesher"}
    return scene


def _labelled(mold: Mold, solid: Solid):  # type: ignore[no-untyped-def]  # a build123d compound
    """Return silicone and carrier as one labelled compound, in the axes of the finger."""
    from build123d import Compound, Rot

    back = Rot(0, 90 if mold.options.split == "x" else 0, 0)
    rods = [back * rod for rod in _silicone_in_carrier(mold)]
    solids = finger_on_carrier(solid, back * mold.parts["carrier"], rods, mold.options.carrier_mm)
    children = []
    for label, part in solids.items():
        part.label = label or "SOLID"  # which names nothing: the main body
        children.append(part)
    return Compound(label="finger on carrier", children=children)


def _silicone_in_carrier(mold: Mold) -> Sequence[Solid]:
    """Return the silicone in the keyed holes and in the pour hole; the riser is cut off."""
    assert mold.keys is not None
    keyed = key_solids(mold.keys, 0.0, mold.options)
    if mold.ports.riser is None:
        return [*keyed, *openings(mold.ports, 0.0, mold.options)]
    x, z = mold.ports.pour
    return [*keyed, cylinder((x, -mold.options.carrier_mm, z), mold.ports.pour_mm, mold.options.carrier_mm, "y")]
