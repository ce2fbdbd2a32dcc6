"""Command ``show``: a window, a picture or an animation of a result."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import app
from finger3d.cli.folders import check_folder
from finger3d.errors import Finger3dError


@app.command
def show(
    folder: Path,
    /,
    *,
    png: Path | None = None,
    gif: Path | None = None,
    step: int | None = None,
) -> None:
    """Show a result in a window with fields, increments and a clip plane; --png and --gif need no display.

    Example: finger3d show out --png finger.png --gif press.gif

    Parameters
    ----------
    folder
        Results of `finger3d press`; or of `finger3d sweep`, whose charts --png draws.
    png
        Write a picture of one increment instead of opening a window.
    gif
        Write an animation of the increments instead of opening a window.
    step
        Number of the increment in the picture; default: the last.
    """
    if (folder / "sweep.json").is_file():
        _show_sweep(folder, png, gif, step)
        return
    from finger3d.plotting import show as run

    if png is None and gif is None:
        if step is not None:
            raise Finger3dError("show: --step goes with --png; the window has a slider")
        run.show_window(folder)
        return
    run.found(folder)
    _check(png, ".png")
    _check(gif, ".gif")
    run.show(folder, png, gif, step)
    for path in (png, gif):
        if path is not None:
            print(f"{path} written")


def _show_sweep(folder: Path, png: Path | None, gif: Path | None, step: int | None) -> None:
    if png is None or gif is not None or step is not None:
        page = folder / "report.html"
        advice = f"open {page}" if page.exists() else "it is not finished; the same command continues"
        raise Finger3dError(f"show: {folder} holds a sweep: {advice}, or give --png alone")
    _check(png, ".png")
    from finger3d.report.sweep_figure import picture

    picture(folder, png)
    print(f"{png} written")


def _check(path: Path | None, ending: str) -> None:
    if path is None:
        return
    if path.suffix.lower() != ending:
        raise Finger3dError(f"show: --{ending[1:]} {path}: must end in {ending}")
    check_folder(path.parent)
