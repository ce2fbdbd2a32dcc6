"""Command ``press``: the solution of a scene."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from finger3d.cli.common import app, job, load
from finger3d.cli.options import Flag, Json, Out, Set
from finger3d.cli.printing import print_json, print_rows
from finger3d.errors import MissingError


@dataclass(frozen=True, kw_only=True)
class PressOptions:
    """What a press does besides.

    Parameters
    ----------
    figures
        Draw the pictures.
    error
        Estimate the errors due to the mesh and the increments.
    least_grip
        Find the smallest grip that holds, of a scene with two fingers.
    """

    figures: bool = True
    error: bool = True
    least_grip: Flag = False


@app.command
def press(
    scene: Path,
    /,
    *,
    out: Out,
    set_: Set = None,
    options: Annotated[PressOptions, Parameter(name="*")] = PressOptions(),
    json_: Json = False,
) -> None:
    """Solve a scene: geometry, mesh, frictional contact, results.

    Example: finger3d press scene.toml --out out --set friction.mu=0.5

    Parameters
    ----------
    scene
        The scene file (TOML); `finger3d new` writes one.
    """
    begin = time.perf_counter()
    loaded = load(scene, set_, out)
    from finger3d.analyses.press import press as run
    from finger3d.report.press import increments_kept, press_rows
    from finger3d.scene.material import moduli

    with job(json_, lambda report: increments_kept(out, report)) as report:
        result = run(loaded, out, report, **asdict(options))
    summary = result.summary()
    if json_:
        print_json(summary)
    else:
        files = sorted(path.name for path in out.iterdir() if path.is_file() and not path.name.startswith("."))
        rows = [*moduli(loaded.tables).items(), *press_rows(summary)]
        rows.append(("time", f"{time.perf_counter() - begin:.1f} s, with imports, pictures and page"))
        print_rows(loaded.title, [*rows, ("results", str(out)), *(("", name) for name in files)])
    for kind in ("warnings", "advice"):
        for text in summary.get(kind, ()):
            print(f"{kind.removesuffix('s')}: {text}", file=sys.stderr if json_ else sys.stdout)
    if not result.outcome.ok:
        raise MissingError(f"{scene}: {summary['outcome']} ({increments_kept(out, report)})")
