"""Command ``identify``: values of free keys of a scene from a measured press and material tests."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import app, job
from finger3d.cli.options import Continued, Json, Paths, Set, Texts
from finger3d.cli.printing import print_json, print_page


@app.command
def identify(
    scene: Path,
    /,
    *,
    measured: Paths,
    free: Texts,
    out: Continued,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Find the values of free keys with which the scene reproduces measurements, with standard deviations.

    Example: finger3d identify scene.toml --measured bench.csv --free material.E_MPa=0.05:5 --free friction.mu=0.1:1
    --out fit

    Parameters
    ----------
    scene
        The scene file (TOML).
    measured
        CSV file of a press: step, time_s, depth_mm or a slide, and columns named as in history.csv, such as
        normal_force_N; optionally their standard deviations, such as normal_force_N_std. Or of material tests:
        stretch, stress_MPa (nominal) and mode (tension, compression, shear or equibiaxial), optionally
        stress_MPa_std. May be repeated: one press at most, and any material tests.
    free
        A free key and its bounds, for instance material.E_MPa=0.05:5; or depth_offset_mm=-1:1, which is added
        to the measured depth; may be repeated.
    """
    from finger3d.analyses.identify.run import identify as run
    from finger3d.io import check_writable
    from finger3d.report.analyses import identify_page

    check_writable(out, scene)
    kept = f"every press is kept in {out}; the same command continues"
    with job(json_, lambda _: kept) as report:
        result = run(scene, measured, free, out, set_ or (), report)
    if json_:
        print_json(result.as_dict())
    else:
        print_page(identify_page(out), (out / name for name in ("identified.toml", "report.html")))
