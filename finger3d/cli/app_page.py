"""Command ``app``: a local page that answers while its sliders move."""

from __future__ import annotations

import webbrowser
from pathlib import Path

from finger3d._extras import require
from finger3d.cli.common import Interrupted, app, job, load
from finger3d.cli.options import Set


@app.command(name="app")
def app_(
    scene: Path,
    /,
    *,
    port: int = 0,
    browser: bool = True,
    set_: Set = None,
) -> None:
    """Open a local page with sliders for friction, depth and a gauge, which shows presses of the condensed finger.

    The page opens with the numbers that `finger3d press` gives for the scene in small strain, and with the scene's
    first gauge, and says what large deformation would change. The finger is pressed straight down, to at most the depth
    of the scene. Ctrl-C ends the page.

    Example: finger3d app scene.toml --set model.domain=plane-strain

    Parameters
    ----------
    scene
        The scene file (TOML).
    port
        Port on 127.0.0.1; default: a free one.
    browser
        Open the page in the browser.
    """
    require("app", "dash")
    loaded = load(scene, set_)
    from finger3d.app import LiveBody, local_server, page

    with job(False, lambda report: "nothing was to be written") as report:
        report.stage("condensing")
        body = LiveBody.of(loaded, report)
    url, server = local_server(page(body, loaded.tables.friction.mu), port)
    print(body.remark)
    print(f"open {url}", flush=True)
    if browser:
        webbrowser.open(url)
    server.serve_forever()  # until Ctrl-C, which it takes for its end
    raise Interrupted("interrupted; the page is closed")
