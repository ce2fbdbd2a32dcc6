"""Materials of the parts of a finger, from the tables of a scene."""

from __future__ import annotations

from finger3d.fem.material import RIGID_RATIO, Isotropic, Material
from finger3d.geometry.design import Design
from finger3d.scene.messages import dotted, shown, unknown
from finger3d.scene.tables import SceneTable

_NU_OF_RIGID = 0.3  # of a material that hardly deforms, any does


def parts_of(tables: SceneTable) -> tuple[tuple[str, Material], ...]:
    """Return label and material of every part with a table of its own.

    A rigid part is one whose Young's modulus is `RIGID_RATIO` times the largest of the others.
    """
    stiffest = max([tables.material.E_MPa, *(part.E_MPa for part in tables.parts.values() if part.E_MPa is not None)])
    found: list[tuple[str, Material]] = []
    for label, part in tables.parts.items():
        if part.rigid:
            found.append((label, Isotropic(RIGID_RATIO * stiffest, _NU_OF_RIGID)))
        elif part.E_MPa is not None and part.nu is not None:
            found.append((label, Isotropic(part.E_MPa, part.nu)))
    return tuple(found)


def check_parts(tables: SceneTable, design: Design) -> list[str]:
    """Return a line about every table of a part that the finger lacks, or that says too little or too much."""
    lines = []
    for label, part in tables.parts.items():
        place = ("parts", label)
        given = {key: value for key, value in (("E_MPa", part.E_MPa), ("nu", part.nu)) if value is not None}
        if label not in design.part_labels:
            lines.append(unknown(place, {}, design.part_labels, kind=f"part of {design.name}"))
        elif part.rigid and given:
            key, value = next(iter(given.items()))
            lines.append(f"{dotted((*place, key))} = {shown(value)}: not with rigid = true; take one of the two out")
        elif not part.rigid and len(given) < 2:
            missing = "nu" if "E_MPa" in given else "E_MPa"
            lines.append(f"{dotted((*place, missing))} is missing: a part needs E_MPa and nu, or rigid = true")
    return lines
