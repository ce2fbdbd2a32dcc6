"""Error against time: what accuracy costs for one scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from finger3d.plotting.layout import finish, sheet


def draw(
    path: Path, title: str, seconds: Sequence[float], errors: Mapping[str, Sequence[float]], own_s: float | None
) -> None:
    """Draw the expected error of each number against the seconds of a press, and write the picture.

    Parameters
    ----------
    path : PNG file to write
    title : of the scene
    seconds : (n,) of a press on each mesh
    errors : relative errors (n,) by name
    own_s : seconds on the mesh of the scene, if they are known
    """
    made = sheet(1, 1, (7.2, 4.4), (0.75, 2.2, 0.6, 0.1), title)
    (axes,) = made.axes
    order = sorted(range(len(seconds)), key=lambda k: seconds[k])
    for name, values in errors.items():
        axes.loglog([seconds[k] for k in order], [100.0 * values[k] for k in order], "o-", ms=4, lw=1.3, label=name)
    if own_s is not None:
        axes.axvline(own_s, color="0.4", lw=0.9, ls=":", label="this mesh")
    finish(axes, y="expected error, %", fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0))
    axes.set_xlabel("seconds of a press")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    made.save(path)
