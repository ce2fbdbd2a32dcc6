"""Page of a calibration."""

from __future__ import annotations

from pathlib import Path

from finger3d.report.build import Code, Figure, HeadlineRow, Page, PageSection, Table, how_modelled
from finger3d.results.summary import read_json, title_of


def calibrate_page(folder: str | Path) -> Page:
    """Return the page of a calibration, from the files in its folder.

    Raises
    ------
    Finger3dError
        If calibration.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "calibration.json")
    mu, sd, status, readings = data["mu"], data["mu_sd"], data["status"], data["readings"]
    known = [i for i, what in enumerate(status) if what in ("ok", "coarse")]
    best = min(known, key=lambda i: sd[i], default=len(mu) // 2)
    ranges = {
        key: ", ".join(f"{s['low']:.3g} to {s['high']:.3g}" for s in data[key]) or "none"
        for key in ("trusted", "usable")
    }
    shown = ["" if s is None else s for s in sd]
    headline = [
        HeadlineRow(f"mu found within {data['resolution_limit']:g}, all tolerances", ranges["trusted"]),
        HeadlineRow("the same by the noise alone", ranges["usable"]),
        HeadlineRow(f"mu \u00b1 at mu = {mu[best]:.3g}, all tolerances", f"{sd[best]:.2g}" if known else "unknown"),
    ]
    each = Table(
        ("reading", "unit", "noise", f"at mu = {mu[0]:g}", f"at mu = {mu[-1]:g}", "second-order fit, residual rms"),
        [
            (name, r["unit"], r["noise"], r["curve"][0], r["curve"][-1], r["fit"]["residual_rms"])
            for name, r in readings.items()
        ],
    )
    curve = Table(
        ("mu", *readings, "standard deviation of mu", "an estimate there is"),
        list(zip(mu, *(r["curve"] for r in readings.values()), shown, status, strict=True)),
    )
    causes = Table(
        ("uncertain quantity", f"fall of the variance of mu at {mu[best]:.3g} if it were known exactly"),
        [(name, f"{100.0 * share[best]:.1f} %") for name, share in data["variance_reductions"].items()],
    )
    given = " ".join(f"--strain {name}={r['curve'][best]:.5g}" for name, r in readings.items())
    failed = [f"mu = {f['mu']:g}: {f['why']}" for f in data["failed"]]
    note = data["about"].get("mesh", {}).get("note")
    return Page(
        f"{title_of(data['scene'])}: {', '.join(readings)} against friction",
        headline,
        [
            PageSection("Verdict", [data["verdict"]]),
            PageSection("Readings", [each, curve, causes]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d estimate {folder}/calibration.json {given}")]),
        ],
        [Figure("calibration.png", "Readings, standard deviation of mu, and what would reduce its variance")],
        command="calibrate",
        outcome="converged" if not failed else f"{len(failed)} values of mu gave no numbers",
        good=not failed,
        notes=[*failed, *([note] if note else [])],
        versions=data["about"].get("versions"),
    )
