"""Page of gauges that are placed together."""

from __future__ import annotations

from pathlib import Path

from finger3d.report.build import Code, Figure, HeadlineRow, Page, PageSection, Table
from finger3d.report.scene import how_modelled
from finger3d.results.summary import read_json, title_of


def gauge_places_page(folder: str | Path) -> Page:
    """Return the page of placed gauges, from the files in its folder.

    Raises
    ------
    Finger3dError
        If gauges.json cannot be read.
    """
    folder = Path(folder)
    data = read_json(folder / "gauges.json")
    gauges, names = data["gauges"], ",".join(g["name"] for g in data["gauges"])
    headline = [
        HeadlineRow(f"mu \u00b1, mean over mu = {data['mu'][0]:g} to {data['mu'][-1]:g}", f"{data['mean_mu_sd']:.3g}"),
        *(
            HeadlineRow(
                f"{g['name']}",
                f"x {g['x_mm']:.1f}, y {g['y_mm']:.1f}, z {g['z_mm']:.1f} mm, {g['angle_deg']:.1f}\u00b0",
            )
            for g in gauges
        ),
    ]
    each = Table(
        ("gauge", "x (mm)", "y (mm)", "z (mm)", "angle (degree)", "mean sd of mu alone", "with those before"),
        [
            (
                g["name"],
                g["x_mm"],
                g["y_mm"],
                g["z_mm"],
                g["angle_deg"],
                g["mean_mu_sd_alone"],
                g["mean_mu_sd_with_those_before"],
            )
            for g in gauges
        ],
    )
    spread = Table(("mu", "sd of mu"), list(zip(data["mu"], data["mu_sd"], strict=True)))
    best = folder / "best.toml"
    return Page(
        f"{title_of(data['scene'])}: places of {len(gauges)} gauge{'s' if len(gauges) > 1 else ''}",
        headline,
        [
            PageSection("Gauges", [each]),
            PageSection("Standard deviation of mu", [spread]),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d calibrate {best} --gauge {names} --out {folder / 'calibration'}")]),
        ],
        [Figure("map.png", "Mean standard deviation of mu with a gauge at each place, in its best direction")],
        command="optimise",
    )
