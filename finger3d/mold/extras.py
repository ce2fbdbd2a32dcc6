"""Files beside the mold: a fit coupon, a test button with its scene, and a finger on its carrier."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from finger3d._types import Tree, TreeView
from finger3d.io import atomic
from finger3d.mold.button import button_for, button_parts, button_scene, button_solid, identify_command
from finger3d.mold.carrier import LABEL as CARRIER
from finger3d.mold.carrier import finger_on_carrier, key_solids
from finger3d.mold.parts import Mold
from finger3d.mold.pegs import coupon, coupon_clearances
from finger3d.mold.ports import openings
from finger3d.mold.shell import Shell, shell, write_step
from finger3d.mold.solids import cylinder
from finger3d.scene import tree

if TYPE_CHECKING:
    from build123d import Solid

    from finger3d.scene import Scene

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
    for label, one in solids.items():
        one.label = label or "SOLID"  # which names nothing: the main body
        children.append(one)
    return Compound(label="finger on carrier", children=children)


def _silicone_in_carrier(mold: Mold) -> Sequence[Solid]:
    """Return the silicone in the keyed holes and in the pour hole; the riser is cut off."""
    assert mold.keys is not None
    keyed = key_solids(mold.keys, 0.0, mold.options)
    if mold.ports.riser is None:
        return [*keyed, *openings(mold.ports, 0.0, mold.options)]
    x, z = mold.ports.pour
    return [*keyed, cylinder((x, -mold.options.carrier_mm, z), mold.ports.pour_mm, mold.options.carrier_mm, "y")]
