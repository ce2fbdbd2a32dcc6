"""Command ``show``: a window, the page, or a picture of a result."""

from __future__ import annotations

import webbrowser
from pathlib import Path

from finger3d.cli.common import app
from finger3d.errors import Finger3dError


@app.command
def show(
    folder: Path,
    /,
    *,
    png: Path | None = None,
    step: int | None = None,
) -> None:
    """Show a press in a window with fields, increments and a clip plane, or without a display its page.

    Of a sweep it opens the page. --png writes a picture.

    Example: finger3d show out --png finger.png

    Parameters
    ----------
    folder
        Folder of results.
    png
        Write a picture of one increment of a press, or of the charts of a sweep.
    step
        Number of the increment in the picture; default: the last.
    """
    if step is not None and png is None:
        raise Finger3dError("show: --step goes with --png; the window and the page have a slider")
    if png is None:
        _open(folder)
        return
    if png.suffix.lower() != ".png":
        raise Finger3dError(f"show: --png {png}: must end in .png")
    from finger3d.io import check_folder

    check_folder(png.parent)
    if (folder / "sweep.json").is_file():
        if step is not None:
            raise Finger3dError(f"show: {folder} holds a sweep: give --png alone, or nothing for its page")
        from finger3d.report.analyses import picture

        picture(folder, png)
    else:
        from finger3d.plotting.show import show as draw

        draw(folder, png, step)
    print(f"{png} written")


def _open(folder: Path) -> None:
    from finger3d.plotting.show import has_window, show_window
    from finger3d.results.summary import press_summary

    is_sweep = (folder / "sweep.json").is_file()
    if has_window() and not is_sweep:
        show_window(folder)
        return

    page = folder / "report.html"
    if not page.exists():
        if is_sweep:
            raise Finger3dError(f"show: {folder}: the sweep is not finished; the same command continues")
        press_summary(folder)
        from finger3d.report.press import press_page

        press_page(folder).write(folder)
    print(f"open {page}", flush=True)
    webbrowser.open(page.resolve().as_uri())
