"""Page of an identification."""

from __future__ import annotations

from pathlib import Path

from finger3d.report.build import Code, Figure, HeadlineRow, Page, PageSection, Table, how_modelled
from finger3d.results.summary import read_json, title_of

_STABLE = (
    "To these stretches the nominal stress of the fitted law rises and it satisfies Drucker's postulate; 10, and 0.1 "
    "in compression, are the last that were tried. Tension, shear and equibiaxial tension all count as measured to the "
    "largest stretch of any test."
)


def identify_page(folder: str | Path) -> Page:
    """Return the page of an identification, from the files in its folder.

    Raises
    ------
    Finger3dError
        If identify.json or task.json cannot be read.
    """
    folder = Path(folder)
    data, task = read_json(folder / "identify.json"), read_json(folder / "task.json")
    values, bounds = data["values"], {key: (low, high) for key, low, high in task["free"]}
    headline = [
        *(HeadlineRow(key, f"{v['value']:.4g} \u00b1 {v['std']:.2g}") for key, v in values.items()),
        HeadlineRow("presses solved", str(data["presses"])),
    ]
    stable = data.get("stable")
    if stable:
        within = "over the measured range" if stable["over_measured_range"] else "not over the measured range"
        headline.append(HeadlineRow("law is stable", within))
    found = Table(
        ("key", "from", "to", "value", "standard deviation", "68 % interval"),
        [(key, *bounds[key], v["value"], v["std"], f"{v['low']:.4g} to {v['high']:.4g}") for key, v in values.items()],
    )
    correlation = Table(
        ("correlation", *values),
        [(key, *(f"{r:.3f}" for r in row.values())) for key, row in data["correlation"].items()],
    )
    columns = Table(
        ("measured column", "residual, rms", "standard deviation, rms", "from"),
        [
            (n, rms, data["std_of_columns"][n]["rms"], data["std_of_columns"][n]["from"])
            for n, rms in data["residual_rms"].items()
        ],
    )
    stability = Table(
        ("mode", "stable to a stretch of", "measured to"),
        [(mode, to, stable["measured_to"][mode]) for mode, to in stable["rises_to"].items()] if stable else [],
    )
    sources = [path for path in (data["measured"], *data.get("material_tests", ())) if path]
    told = f"Standard deviations are {data['deviations']}."
    scene = folder / "identified.toml"
    return Page(
        f"{title_of(data['scene'])}: values from {', '.join(Path(path).name for path in sources)}",
        headline,
        [
            PageSection("Values", [told, *data["notes"], found, *([correlation] if len(values) > 1 else [])]),
            PageSection("Fit", [columns]),
            *([PageSection("Stability", [_STABLE, stability])] if stable else []),
            PageSection("Scene", how_modelled(data, folder)),
            PageSection("Use it", [Code(f"finger3d press {scene} --out {folder / 'pressed'}")]),
        ],
        [Figure("identify.png", "Measured points over the fitted scene, and residuals")],
        command="identify",
        notes=list(data["notes"]),
    )
