"""Command ``identify``: values of free keys of a scene from a measured press."""

from __future__ import annotations

from pathlib import Path

from finger3d.cli.common import Continued, Json, Set, Texts, app, check_writable, job, print_json, print_rows


@app.command
def identify(
    scene: Path,
    /,
    *,
    measured: Path,
    free: Texts,
    out: Continued,
    set_: Set = None,
    json_: Json = False,
) -> None:
    """Find the values of free keys with which the scene reproduces a measured press, with standard deviations.

    Example: finger3d identify scene.toml --measured bench.csv --free material.E_MPa=0.05:5 --free friction.mu=0.1:1
    --out fit

    Parameters
    ----------
    scene
        The scene file (TOML).
    measured
        CSV file: step, time_s, depth_mm or a slide, and columns named as in history.csv, such as
        normal_force_N; optionally their standard deviations, such as normal_force_N_std.
    free
        A free key and its bounds, for instance material.E_MPa=0.05:5; or depth_offset_mm=-1:1, which is added
        to the measured depth; may be repeated.
    """
    from finger3d.analyses.identify.run import DEVIATIONS
    from finger3d.analyses.identify.run import identify as run

    check_writable(out, scene)
    kept = f"every press is kept in {out}; the same command continues"
    with job(json_, lambda _: kept) as report:
        result = run(scene, measured, free, out, set_ or (), report)
    if json_:
        print_json(result.as_dict())
        return
    f = result.fitted
    fitted = zip(result.keys, f.values, f.stds, f.low, f.high, strict=True)
    print_rows(
        result.scene.title,
        [
            *(
                (key, f"{value:.4g} +- {std:.2g} (68 % interval {low:.4g} to {high:.4g})")
                for key, value, std, low, high in fitted
            ),
            ("deviations", DEVIATIONS),
            *(("note", note) for note in result.notes),
            ("presses", f"{result.presses} solved"),
            ("results", str(out / "identified.toml")),
            ("", str(out / "report.html")),
        ],
    )
