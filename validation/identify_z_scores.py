"""Do the standard deviations that an identification states agree with the errors of its values?

No source; the measured curves are presses of the same finger on a mesh 1.5 to 4 times finer, with noise.  The finger of
Fig. 9 is pressed 10 mm, as a section in plane strain and as a solid 20 mm wide; normal force and gauge strain are read
at ten depths, between increments.  Young's modulus, friction, Poisson's ratio, the edges of the mesh, and the noise are
drawn; one to three of the first are free.  Then fingers are drawn, too, as sections, with a depth and a gauge: force,
and in half of them strain, are read at 16 depths with a noise of 1 %, and all three values are free.  In many of these
the likelihood of friction is flat, or has two maxima.  z is (identified - true) / stated standard deviation, with and
without the part of mesh and increments.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from finger3d._types import Float
from finger3d.analyses.identify.run import identify
from finger3d.analyses.press import press
from finger3d.io import write_csv

from ._rows import Result, Row, columns, listed, rms

judged = listed(__file__)

FREE = {"material.E_MPa": (0.05, 5.0), "friction.mu": (0.02, 1.0), "material.nu": (0.3, 0.495)}
CASES, IF_QUICK = {"plane-strain": 80, "solid": 20, "drawn": 72}, {"plane-strain": 12, "drawn": 6}
SIZES = {"plane-strain": (1.0, 3.0), "solid": (3.5, 5.0)}
FINER = {"plane-strain": (1.5, 4.0), "solid": (1.5, 2.0), "drawn": (2.0, 3.3)}
NOISE = 1e-3, 2e-2  # of the largest value of a column
FIG9 = {"radius_mm": 100.0, "half_length_mm": 50.0, "edge_height_mm": 36.6, "width_mm": 20.0}
_NONE = 1e-12  # standard deviation of nothing


class Fitted(NamedTuple):
    """One value of one identification."""

    domain: str
    free: int
    key: str
    finer: float
    noise: float
    true: float
    found: float
    std: float
    std_numerical: float

    @property
    def z(self) -> float:
        """Error over the stated standard deviation."""
        return (self.found - self.true) / self.std

    @property
    def z_of_noise(self) -> float:
        """Error over the part of the noise."""
        return (self.found - self.true) / max(np.sqrt(max(self.std**2 - self.std_numerical**2, 0.0)), _NONE)


class Bench(NamedTuple):
    """A finger as its table, the depths (mm) at which it is read, the gauge's x, y and angle, and edges (mm)."""

    finger: dict[str, float]
    depths: Float
    gauge: tuple[float, float, float]
    size: float

    @classmethod
    def drawn(cls, random: np.random.Generator) -> Bench:
        """A clipped cylinder with 18 to 40 edges in the half length of its overlap."""
        radius = random.uniform(40.0, 100.0)
        half = radius * random.uniform(0.4, 0.6)
        rise = radius - np.sqrt(radius**2 - half**2)
        edge, depth = rise * random.uniform(0.6, 1.3), rise * random.uniform(0.2, 0.35)
        overlap = float(np.sqrt(2.0 * radius * depth))
        gauge = overlap * random.uniform(0.3, 0.8), (edge + rise) * random.uniform(0.7, 0.85), random.uniform(0.0, 90.0)
        finger = {"radius_mm": radius, "half_length_mm": half, "edge_height_mm": edge, "width_mm": 8.0}
        return cls(finger, depth * np.arange(1, 17) / 16.0, gauge, overlap / random.uniform(18.0, 40.0))

    def scene(self, domain: str, size: float, values: dict[str, float], steps: int | str) -> dict[str, Any]:
        """The finger with a gauge, pressed to the last depth in small strain."""
        x, y, angle = self.gauge
        return {
            "finger": {"geometry": "clipped_cylinder", **self.finger},
            "material": {"E_MPa": values["material.E_MPa"], "nu": values["material.nu"]},
            "friction": {"mu": values["friction.mu"]},
            "press": {"depth_mm": float(self.depths[-1]), "steps": steps},
            "model": {"domain": domain},
            "mesh": {"size_mm": size, "base_size_mm": 4.0 * size, "mesher": "swept"},
            "effects": {"auto": False},
            "gauge": [{"name": "g", "x_mm": x, "y_mm": y, "angle_deg": angle}],
        }


def case(kind: str, random: np.random.Generator) -> Iterator[Fitted]:
    """Values identified from one curve."""
    true = {"material.E_MPa": random.uniform(0.1, 2.0), "friction.mu": random.uniform(0.06, 0.4),
            "material.nu": random.uniform(0.4, 0.48)}  # fmt: skip
    finer, names = random.uniform(*FINER[kind]), ["normal_force_N", "gauge_g"]
    if kind == "drawn":
        bench, domain, free, noise = Bench.drawn(random), "plane-strain", list(FREE), 0.01
        true |= {"friction.mu": random.uniform(0.05, 0.8), "material.nu": random.uniform(0.35, 0.485)}
        names = names[: random.integers(1, 3)]
    else:
        bench = Bench(FIG9, np.linspace(1.0, 10.0, 10), (36.0, 40.0, 30.0), random.uniform(*SIZES[kind]))
        domain, free = kind, list(FREE)[: random.integers(1, 4)]
        noise = float(np.exp(random.uniform(*np.log(NOISE))))
    table: dict[str, Any] = {"depth_mm": bench.depths}
    # a multiple of the rows, so that increments end at them
    pressed = press(bench.scene(domain, bench.size / finer, true, 2 * len(bench.depths)), error=False)
    rows = [min(pressed.steps, key=lambda step: abs(step.depth_mm - depth)) for depth in bench.depths]
    for name in names:
        values = np.array([row.normal_force_N if name == "normal_force_N" else row.gauges["g"] for row in rows])
        table[f"{name}_std"] = np.full(len(rows), noise * float(np.abs(values).max()))
        table[name] = values + random.normal(0.0, table[f"{name}_std"])
    start = true | {key: 0.5 * sum(FREE[key]) for key in free}
    with TemporaryDirectory() as folder:
        write_csv(Path(folder) / "bench.csv", table)
        scene = bench.scene(domain, bench.size, start, "auto" if kind == "drawn" else 7)
        found = identify(scene, Path(folder) / "bench.csv", {k: FREE[k] for k in free}, Path(folder) / "out").fitted
    for k, key in enumerate(free):
        told = float(found.values[k]), float(found.stds[k]), float(found.numerical[k])
        yield Fitted(kind, len(free), key, finer, noise, true[key], *told)


def run(quick: bool) -> Result:
    """Quick: eighteen sections."""
    random = np.random.default_rng(20261130)
    counts = IF_QUICK if quick else CASES
    found = [one for domain, count in counts.items() for _ in range(count) for one in case(domain, random)]
    rows = list(_rows(found, quick))
    table = columns(" ".join(Fitted._fields), found)
    return Result(tuple(rows), table, lambda figure: _draw(figure, found))


def _rows(found: list[Fitted], quick: bool) -> Iterator[Row]:
    groups = {"all": found}
    if not quick:
        groups |= {f"{d}, {k}": [f for f in found if (f.domain, f.key) == (d, k)] for d in CASES for k in FREE}
    for name, some in groups.items():
        z, bare = (np.array([getattr(f, which) for f in some]) for which in ("z", "z_of_noise"))
        what = f"{name}, {len(some)} values"
        # a posterior that is flat up to a bound, or has two maxima, has longer tails
        yield judged("largest-z", float(np.abs(z).max()), what=what)
        if len(some) >= 8:
            share = float(np.mean(np.abs(z) <= 2.0))
            yield judged("share-within-two-stated-deviations", share, what=what)
            yield judged("rms-of-z", rms(z), what=what)
            yield judged("rms-of-z-noise-alone", rms(bare), what=what)


def _draw(figure: Any, found: list[Fitted]) -> None:
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, which, title in (
        (left, "z_of_noise", "deviation of the noise alone"),
        (right, "z", "deviation as stated"),
    ):
        for k, key in enumerate(FREE):
            for domain, mark in (("plane-strain", "o"), ("solid", "s"), ("drawn", "^")):
                some = [f for f in found if (f.key, f.domain) == (key, domain)]
                label = f"{key.partition('.')[2].removesuffix('_MPa')}, {domain.replace('-', ' ')}"
                axes.plot([f.noise for f in some], [abs(getattr(f, which)) for f in some], mark, color=f"C{k}", ms=4,
                          mfc=f"C{k}" if mark == "o" else "none", label=label)  # fmt: skip
        axes.axhline(1.0, color="k", lw=0.8)
        axes.set(xscale="log", yscale="log", xlabel="noise over the largest value", title=title, ylim=(1e-3, None))
    left.set_ylabel("|identified - true| / standard deviation")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
