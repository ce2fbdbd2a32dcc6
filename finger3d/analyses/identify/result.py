"""Result of an identification, and its files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from finger3d._types import Float, Tree
from finger3d.analyses.identify.material_tests import LawInTests
from finger3d.analyses.identify.measured import MeasuredPress
from finger3d.analyses.identify.posterior import FittedValues
from finger3d.analyses.identify.simulated import OFFSET, Curve, moving_part
from finger3d.fem.laws.material_tests import nominal_stress, principal_stretches
from finger3d.io import write_csv, write_json, write_text
from finger3d.plotting.identify import Panel, draw
from finger3d.report.identify import identify_page
from finger3d.scene import Scene

DEVIATIONS = "of the noise of the data, and of the errors of mesh and increments"
"""What the standard deviations of an identification contain."""

_FINE = 100  # stretches of a curve that is drawn


@dataclass(frozen=True)
class Identification:
    """Result of an identification.

    Attributes
    ----------
    scene : with the values that were found
    keys : the free keys (k)
    fitted : their values, standard deviations and correlation
    measured : the measured press, without columns if there is none
    tested : the material tests, and the law for any values of the free keys
    simulated : values by column at the measured rows
    stds : standard deviations by column (n,): those of the file, or those that the residuals have
    curve : the simulated press
    reduced_chi_square : of the columns with standard deviations of their own; NaN without any
    notes : remarks on values that the data do not determine, and on a poor fit
    presses : number of presses that were solved
    """

    scene: Scene
    keys: tuple[str, ...]
    fitted: FittedValues
    measured: MeasuredPress
    tested: LawInTests
    simulated: Mapping[str, Float]
    stds: Mapping[str, Float]
    curve: Curve
    reduced_chi_square: float
    notes: tuple[str, ...]
    presses: int

    def as_dict(self) -> Tree:
        """Return the content of identify.json."""
        fitted, names = self.fitted, ("value", "std", "std_numerical", "low", "high")
        rows = np.column_stack([fitted.values, fitted.stds, fitted.numerical, fitted.low, fitted.high]).tolist()
        tables = zip(self.keys, rows, fitted.correlation.tolist(), strict=True)
        values, correlation = {}, {}
        for key, row, correlated in tables:
            values[key] = dict(zip(names, row, strict=True))
            correlation[key] = dict(zip(self.keys, correlated, strict=True))
        measured, given = {**self.measured.columns, **self.tested.columns}, {*self.measured.stds, *self.tested.stds}
        return {
            "scene": self.scene.as_dict(),
            "measured": str(self.measured.path) if self.measured.columns else None,
            "material_tests": list(dict.fromkeys(str(test.path) for test in self.tested.tests.values())),
            "index": self.measured.index or None,
            "values": values,
            "correlation": correlation,
            "reduced_chi_square": self.reduced_chi_square,
            "residual_rms": {
                name: float(np.sqrt(np.mean((values - self.simulated[name]) ** 2))) for name, values in measured.items()
            },
            "stable": self.tested.stable(self.fitted.values),
            "std_of_columns": {
                name: {"from": "file" if name in given else "residuals", "rms": float(np.sqrt(np.mean(std**2)))}
                for name, std in self.stds.items()
            },
            "deviations": DEVIATIONS,
            "notes": list(self.notes),
            "presses": self.presses,
        }


def write(folder: Path, found: Identification) -> None:
    """Write the results, the figure and the page."""
    write_json(folder / "identify.json", found.as_dict())
    write_text(folder / "identified.toml", found.scene.to_toml())
    panels = [*(_of_press(folder, found) if found.measured.columns else []), *_of_tests(folder, found)]
    draw(folder / "identify.png", panels)
    identify_page(folder).write(folder)


def _of_press(folder: Path, found: Identification) -> list[Panel]:
    """Write the rows of the press, and return its panels."""
    data = found.measured
    columns: Tree = {data.index: data.at}
    for name, values in data.columns.items():
        columns |= {
            name: values,
            f"{name}_std": found.stds[name],
            f"{name}_simulated": found.simulated[name],
        }
    write_csv(folder / "identify.csv", columns)
    offset = dict(zip(found.keys, found.fitted.values, strict=True)).get(OFFSET, 0.0)
    part = moving_part(found.curve[data.index], data)
    curve = {name: values[part] for name, values in found.curve.items()}
    at = data.at + float(offset)
    return [
        Panel(n, values, found.stds[n], found.simulated[n], curve[n], data.index, at, curve[data.index])
        for n, values in data.columns.items()
    ]


def _of_tests(folder: Path, found: Identification) -> list[Panel]:
    """Write the rows of the material tests, and return their panels."""
    tests = found.tested.tests.items()
    if not tests:
        return []
    columns: Tree = {
        "test": [name.removesuffix("_stress_MPa") for name, test in tests for _ in test.stretch],
        "stretch": np.concatenate([test.stretch for _, test in tests]),
        "stress_MPa": np.concatenate([test.stress for _, test in tests]),
        "stress_MPa_std": np.concatenate([found.stds[name] for name, _ in tests]),
        "stress_MPa_simulated": np.concatenate([found.simulated[name] for name, _ in tests]),
    }
    write_csv(folder / "identify_tests.csv", columns)
    law, panels = found.tested.law(found.fitted.values.tolist()), []
    for name, test in tests:
        at = np.linspace(min(1.0, test.stretch.min()), max(1.0, test.stretch.max()), _FINE)
        curve = nominal_stress(law, principal_stretches(test.mode, at))
        panels.append(
            Panel(name, test.stress, found.stds[name], found.simulated[name], curve, "stretch", test.stretch, at)
        )
    return panels
