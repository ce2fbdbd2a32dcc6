"""Page of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from finger3d._types import Tree
from finger3d.report.build import Code, Figure, HeadlineRow, PageSection, Table, write_page
from finger3d.report.scene import how_modelled
from finger3d.results.summary import read_json, title_of


def calibrate_page(folder: str | Path) -> Path:
    """Write report.html of a calibration from the files in its folder.

    Raises
    ------
    Finger3dError
        If calibration.json cannot be read or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "calibration.json")
    mu, strain, sd = data["curve"]["mu"], data["curve"]["strain"], data["mu_sd"]
    ranges = {
        key: ", ".join(f"{s['low']:.3g} to {s['high']:.3g}" for s in data[key]) or "none"
        for key in ("trusted", "usable")
    }
    known = [(i, s) for i, s in enumerate(sd) if s is not None]
    best = min(known, key=lambda pair: pair[1], default=None)
    headline = [
        HeadlineRow(f"mu known within {data['resolution_limit']:g}, all tolerances", ranges["trusted"]),
        HeadlineRow("the same from strain noise alone", ranges["usable"]),
        HeadlineRow(f"strain at mu = {mu[0]:g}", strain[0]),
        HeadlineRow(f"strain at mu = {mu[-1]:g}", strain[-1]),
        HeadlineRow("residual of the second-order fit, rms", f"{data['fit']['residual_rms']:.2g}"),
    ]
    if best:
        headline.append(HeadlineRow(f"mu \u00b1 at mu = {mu[best[0]]:.3g}, all tolerances", f"{best[1]:.2g}"))
    a, b, c = data["fit"]["coefficients"]
    curve = Table(
        ("mu", "strain", "resolution of mu", "sd of mu"), list(zip(mu, strain, data["resolution"], sd, strict=True))
    )
    causes = Table(
        ("uncertain quantity", "standard deviation", "unit", "sd of mu where mu is known best"),
        [(name, t["sd"], t["unit"], t["mu_sd"][best[0]] if best else "") for name, t in data["tolerances"].items()],
    )
    use = f"finger3d estimate {folder}/calibration.json --strain {strain[len(strain) // 2]:.4g}"
    return _write(
        folder,
        data,
        f"{title_of(data['scene'])}: gauge {data['gauge']} against friction",
        headline,
        [
            PageSection("Verdict", [data["verdict"]]),
            PageSection("Curve", [f"Second order: strain = {a:.5g} {b:+.5g} mu {c:+.5g} mu\u00b2", curve, causes]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(use)]),
        ],
        [
            Figure("calibration.png", "Strain and fit, resolution, and contributions to the variance of mu"),
            Figure("map.png", "Sensitivity of strain to friction over the section"),
        ],
    )


def joint_calibration_page(folder: str | Path) -> Path:
    """Write report.html of a calibration of several readings from the files in its folder.

    Raises
    ------
    Finger3dError
        If calibration.json cannot be read or the page cannot be written.
    """
    folder = Path(folder)
    data = read_json(folder / "calibration.json")
    mu, sd, readings = data["mu"], data["mu_sd"], data["readings"]
    known = [(i, s) for i, s in enumerate(sd) if s is not None]
    best = min(known, key=lambda pair: pair[1], default=(0, None))[0]
    trusted = ", ".join(f"{s['low']:.3g} to {s['high']:.3g}" for s in data["trusted"]) or "none"
    headline = [
        HeadlineRow(f"mu known within {data['resolution_limit']:g}, all tolerances", trusted),
        HeadlineRow(f"mu \u00b1 at mu = {mu[best]:.3g}, all readings", f"{sd[best]:.2g}" if known else "unknown"),
    ]
    each = Table(
        ("reading", "unit", "noise", f"at mu = {mu[0]:g}", f"at mu = {mu[-1]:g}", f"sd of mu at {mu[best]:.3g}, alone"),
        [
            (
                name,
                r["unit"],
                r["noise"],
                r["curve"][0],
                r["curve"][-1],
                "" if (own := r["mu_sd"][best]) is None else own,
            )
            for name, r in readings.items()
        ],
    )
    causes = Table(
        ("uncertain quantity", f"fall of the variance of mu at {mu[best]:.3g} if it were known exactly"),
        [(name, f"{100.0 * share[best]:.1f} %") for name, share in data["variance_reductions"].items()],
    )
    given = " ".join(f"--strain {name}={r['curve'][len(mu) // 2]:.4g}" for name, r in readings.items())
    return _write(
        folder,
        data,
        f"{title_of(data['scene'])}: {len(readings)} readings against friction",
        headline,
        [
            PageSection("Verdict", [data["verdict"]]),
            PageSection("Readings", [each, causes]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d estimate {folder}/calibration.json {given}")]),
        ],
        [Figure("calibration.png", "Readings, standard deviation of mu, and what would reduce its variance")],
    )


def _or_blank(value: float | None) -> float | str:
    """Return a number, or nothing where it is not finite."""
    return "" if value is None else value


def _write(
    folder: Path,
    data: Tree,
    title: str,
    headline: Sequence[HeadlineRow],
    sections: Sequence[PageSection],
    figures: Sequence[Figure],
) -> Path:
    """Write the page of a calibration, with the values of mu that failed and the note on its mesh."""
    failed = [f"mu = {f['mu']:g}: {f['why']}" for f in data["failed"]]
    note = data["about"].get("mesh", {}).get("note")
    return write_page(
        folder,
        title,
        headline,
        sections,
        figures,
        command="calibrate",
        outcome="converged" if not failed else f"{len(failed)} values of mu gave no numbers",
        good=not failed,
        notes=[*failed, *([note] if note else [])],
        versions=data["about"].get("versions"),
    )
