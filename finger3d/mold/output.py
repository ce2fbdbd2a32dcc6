"""Files of a mold: parts as STL and 3MF, the assembly as STEP, instructions and a picture."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from finger3d._types import Float
from finger3d.io import atomic
from finger3d.materials.silicones import Silicone
from finger3d.mold.parts import Mold, strips
from finger3d.mold.sheet import oversize, sheet
from finger3d.mold.shell import Shell, shell, write_3mf, write_step, write_stl
from finger3d.plotting.mold import picture
from finger3d.progress import Progress

GAP_MM = 8.0
"""Distance between parts on the plate."""

FILES = (
    "mold_half_a.stl", "mold_half_b.stl", "mold_lid.stl", "mold.3mf", "mold.step", "sheet.txt", "mold.png",
)  # fmt: skip
"""Files of a mold."""

_LYING = {
    "half_a": np.diag([-1.0, 1.0, -1.0]),
    "half_b": np.eye(3),
    "lid": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""Rotation of each part onto the bed, its outer face down and z up."""


def as_printed(parts: dict[str, Shell]) -> dict[str, Shell]:
    """Return the parts as they lie on the bed, each with its lowest corner at the origin."""
    lying = {name: part.moved(_LYING[name], np.zeros(3)) for name, part in parts.items()}
    return {name: part.moved(np.eye(3), -part.surface.low) for name, part in lying.items()}


def plate(printed: dict[str, Shell]) -> tuple[dict[str, Shell], Float]:
    """Return the parts in a row along y, and the size (3,) of the row, mm."""
    at, placed = 0.0, {}
    for name, part in printed.items():
        placed[name] = part.moved(np.eye(3), np.array([0.0, at, 0.0]))
        at += float(part.extent[1]) + GAP_MM
    extents = np.array([part.extent for part in printed.values()])
    return placed, np.array([extents[:, 0].max(), at - GAP_MM, extents[:, 2].max()])


def write_mold(
    title: str, made: Mold, body: Shell, out: Path, text: bool, report: Progress, silicone: Silicone | None = None
) -> tuple[list[Path], list[str]]:
    """Write all files of a mold; returns them, and remarks for the user.

    Parameters
    ----------
    body : the finger's shell; the cavity is made as finely
    text : STL as text
    silicone : that the scene names, for the instructions
    """
    from build123d import Compound

    report.stage("parts and picture")
    shells = {name: shell(part, body.tolerance_mm, name, body.angle) for name, part in made.parts.items()}
    printed = as_printed(shells)
    placed, size = plate(printed)
    with ThreadPoolExecutor(1) as pool:  # PyVista renders in a process of its own for some seconds
        drawn = pool.submit(_picture, out / "mold.png", title, made, body, shells, printed)
        for name, part in printed.items():
            write_stl(out / f"mold_{name}.stl", part.surface, text)
        write_3mf(out / "mold.3mf", placed)
        write_step(out / "mold.step", Compound(label="mold", children=list(made.parts.values())))
        with atomic(out / "sheet.txt") as temporary:
            temporary.write_text(sheet(title, made, printed, size, silicone), encoding="utf-8")
        drawn.result()
    remarks = [f"mold_{n}: {why}" for n, part in printed.items() if (why := oversize(part, made.options.bed_mm))]
    return [out / name for name in FILES], remarks


def _picture(
    path: Path, title: str, made: Mold, body: Shell, shells: dict[str, Shell], printed: dict[str, Shell]
) -> None:
    parts = {name: part.surface for name, part in shells.items()}
    parts["sensor"] = shell(made.body, body.tolerance_mm, "sensor", body.angle).surface
    sizes = {name: " x ".join(f"{e:.1f}" for e in part.extent) + " mm" for name, part in printed.items()}
    sizes["sensor"] = f"{made.silicone_mm3 / 1e3:.3g} ml"
    if (laid := strips(made)) is not None:
        parts["strips"] = laid
        sizes["strips"] = "\n".join(name for foil in made.foils for name in foil.names)
    picture(path, parts, f"Mold of {title}: as it is poured, taken apart", sizes)
