"""Identification from material tests: closed forms, the constants of every law, stability, and mistakes in a file."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import finger3d
from finger3d.analyses.identify.run import Identification
from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.fem.laws import MooneyRivlin, NeoHooke, Ogden, Yeoh
from finger3d.fem.laws.base import TESTS, nominal_stress, principal_stretches, rising_to, unstable_from
from tests.identify_cases import PRESS, bench
from tests.scenes import written
from tests.sensor_cases import scene

G = 0.3
E = 3.0 * G
ACROSS: dict[str, Callable[[Any], tuple[Any, Any]]] = {
    "tension": lambda x: (x**-0.5, x**-0.5),
    "compression": lambda x: (x**-0.5, x**-0.5),
    "shear": lambda x: (1.0, 1.0 / x),
    "equibiaxial": lambda x: (x, x**-2.0),
}
"""The other two principal stretches of each test; the last is across a free face."""
STRETCH = {mode: np.linspace(0.5, 0.95, 12) if mode == "compression" else np.linspace(1.05, 2.5, 12) for mode in TESTS}


def by_invariants(w1: Callable[[Any], Any], w2: float = 0.0) -> Callable[[str, Any], Any]:
    """P = 2 (l - l3^2 / l) (W_1 + l2^2 W_2) of Rivlin (1948), with the derivatives by I1 and I2."""

    def stress(mode: str, x: Any) -> Any:
        second, third = ACROSS[mode](x)
        return 2.0 * (x - third**2 / x) * (w1(x**2 + second**2 + third**2 - 3.0) + w2 * second**2)

    return stress


def by_stretches(*terms: tuple[float, float]) -> Callable[[str, Any], Any]:
    """P = sum of mu (l^alpha - l3^alpha) / l of Ogden (1972), with mu = 2 share G / alpha."""
    return lambda mode, x: sum(2.0 * s * G / a * (x**a - ACROSS[mode](x)[1] ** a) / x for s, a in terms)


CLOSED: dict[str, tuple[Any, Callable[[str, Any], Any]]] = {
    "neo-hookean": (NeoHooke(G), by_invariants(lambda e: 0.5 * G)),
    "mooney-rivlin": (MooneyRivlin(G, 0.3), by_invariants(lambda e: 0.35 * G, 0.15 * G)),
    "yeoh": (Yeoh(G, -0.05, 0.01), by_invariants(lambda e: 0.5 * G * (1.0 - 0.1 * e + 0.03 * e**2))),
    "ogden": (Ogden(G, ((0.7, 1.6), (0.3, 5.0))), by_stretches((0.7, 1.6), (0.3, 5.0))),
}
FREE: dict[str, dict[str, tuple[float, float, float]]] = {
    "neo-hookean": {},
    "mooney-rivlin": {"c01_share": (0.0, 1.0, 0.3)},
    "yeoh": {"c2_over_c1": (-0.2, 0.2, -0.05), "c3_over_c1": (-0.05, 0.05, 0.01)},
    "ogden": {"terms.0.0": (0.3, 1.0, 0.7), "terms.0.1": (0.5, 3.0, 1.6), "terms.1.1": (3.0, 8.0, 5.0)},
}
"""Bounds and true value of the constants."""
TERMS = "effects.large_deformation.terms=[[0.5,2.0],[0.5,4.0]]"


@pytest.mark.parametrize("mode", TESTS)
@pytest.mark.parametrize("name", CLOSED)
def test_the_nominal_stress_is_that_of_the_closed_form(name: str, mode: str) -> None:
    law, wanted = CLOSED[name]
    found = nominal_stress(law, principal_stretches(mode, STRETCH[mode]))
    np.testing.assert_allclose(found, wanted(mode, STRETCH[mode]), rtol=1e-12)


@pytest.mark.parametrize("name", CLOSED)
def test_at_small_strain_the_slopes_are_those_of_an_incompressible_solid(name: str) -> None:
    """E in tension, 4/3 E in pure shear (plane strain), 2 E in equibiaxial tension, to the order of the strain."""
    stretch = np.array([1.0 + 1e-6])
    for mode, slope in {"tension": E, "shear": 4.0 / 3.0 * E, "equibiaxial": 2.0 * E}.items():
        found = nominal_stress(CLOSED[name][0], principal_stretches(mode, stretch))[0] / 1e-6
        assert found == pytest.approx(slope, rel=2e-5)


def test_a_stress_that_falls_and_a_law_that_drucker_refuses_are_found() -> None:
    """Of one term P = mu (l^(a-1) - l^(-a/2-1)) is largest where l^(3a/2) = (1 + a/2) / (1 - a), for a < 1."""
    alpha = 0.5
    largest = ((1.0 + 0.5 * alpha) / (1.0 - alpha)) ** (2.0 / 3.0 / alpha)
    assert rising_to(Ogden(G, ((1.0, alpha),)), "tension") == pytest.approx(largest, rel=6e-3)  # half a per cent apart
    assert [rising_to(NeoHooke(G), mode) for mode in TESTS] == [10.0, 0.1, 10.0, 10.0]
    negative = MooneyRivlin(G, -0.2)  # its nominal stress in tension rises on where Drucker's postulate fails
    limit = 1.0 + unstable_from(negative)["uniaxial tension"]
    assert rising_to(negative, "tension") == pytest.approx(limit, rel=6e-3)


def rows_of(path: Path, stress: Callable[[str, Any], Any], modes: Sequence[str], std: float = 1e-6) -> Path:
    rows = [f"{x!r},{float(stress(mode, x))!r},{mode},{std}" for mode in modes for x in STRETCH[mode].tolist()]
    names = "stretch,stress_MPa,mode,stress_MPa_std"
    path.write_text("\n".join([names, *rows]) + "\n")
    return path


def identified(
    law: str, measured: Path | list[Path], out: Path, constants: Mapping[str, Any], *sets: str
) -> Identification:
    free = {"material.E_MPa": (0.05, 5.0)}
    free |= {f"effects.large_deformation.{key}": tuple(bounds[:2]) for key, bounds in constants.items()}
    options = [f"effects.large_deformation.law={law}", *([TERMS] if law == "ogden" else []), *sets]
    return finger3d.identify(scene(press=PRESS), measured, free, out, options)


@pytest.mark.parametrize("name", FREE)
def test_the_constants_of_a_law_are_found_again_without_a_press(tmp_path: Path, name: str) -> None:
    modes = ["tension", "compression", "equibiaxial"]
    found = identified(name, rows_of(tmp_path / "a.csv", CLOSED[name][1], modes), tmp_path / "out", FREE[name])
    # a deviation of 1e-6 MPa leaves 1e-5 of the exponents; the first guess counts as one measurement
    assert found.fitted.values == pytest.approx([E, *(true for *_, true in FREE[name].values())], rel=1e-4)
    assert found.presses == 0
    data = json.loads((tmp_path / "out" / "identify.json").read_text())
    assert data["stable"]["over_measured_range"]
    assert data["material_tests"] == [str(tmp_path / "a.csv")]
    assert max(data["residual_rms"].values()) < 1e-5
    files = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"identify_tests.csv", "identified.toml", "identify.png", "report.html"} <= files
    again = finger3d.load(tmp_path / "out" / "identified.toml")
    assert again.constants.E_MPa == pytest.approx(E, rel=1e-4)


def test_the_standard_deviation_of_the_modulus_is_that_of_linear_least_squares(tmp_path: Path) -> None:
    path = rows_of(tmp_path / "a.csv", CLOSED["neo-hookean"][1], ["tension"], 0.01)
    found = identified("neo-hookean", path, tmp_path / "out", {})
    slope = CLOSED["neo-hookean"][1]("tension", STRETCH["tension"]) / E
    assert found.fitted.stds[0] == pytest.approx(0.01 / np.linalg.norm(slope), rel=0.05)  # of 2048 samples: 2 %


def test_an_unstable_law_is_told(tmp_path: Path) -> None:
    """Tension that softens gives a negative c2, with which the law is unstable before the last stretch."""
    softening = by_invariants(lambda e: 0.5 * G * (1.0 - 0.16 * e))
    path = rows_of(tmp_path / "a.csv", softening, ["tension"])
    found = identified(
        "yeoh", path, tmp_path / "out", {"c2_over_c1": (-0.2, 0.2)}, "effects.large_deformation.c3_over_c1=0"
    )
    assert found.fitted.values[1] == pytest.approx(-0.08, rel=1e-3)
    (note,) = (note for note in found.notes if "unstable" in note)
    assert "tension from a stretch of" in note
    assert not json.loads((tmp_path / "out" / "identify.json").read_text())["stable"]["over_measured_range"]


def test_a_press_and_tests_share_one_likelihood(tmp_path: Path) -> None:
    """The press alone and the tests alone have independent errors: their weights add."""
    law = {"effects": {"large_deformation": {"law": "neo-hookean"}}}
    press = bench(tmp_path / "bench.csv", stds=True, **law)
    test = rows_of(tmp_path / "a.csv", by_invariants(lambda e: 0.37 / 6.0), ["tension"], 0.02)
    path = written(tmp_path, scene(press=PRESS, **law).to_toml())
    found = [
        finger3d.identify(
            path, measured, {"material.E_MPa": (0.05, 5.0)}, tmp_path / str(i), ["friction.mu=0.2"]
        ).fitted
        for i, measured in enumerate((press, test, [press, test]))
    ]
    weights = [one.stds[0] ** -2.0 for one in found]
    # a share of the press's error bar and the ratio of Birge differ between the fits
    assert weights[2] == pytest.approx(weights[0] + weights[1], rel=0.3)
    mean = (weights[0] * found[0].values[0] + weights[1] * found[1].values[0]) / (weights[0] + weights[1])
    assert found[2].values[0] == pytest.approx(mean, abs=0.5 * found[2].stds[0])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("stretch,stress_MPa\n1.1,0.1\n", 'has no column "mode"'),
        ("stretch,stress_MPa,mode,strain\n1.1,0.1,tension,0.1\n", 'column "strain"'),
        ("stretch,stress_MPa,mode\n1.1,0.1,tensile\n", 'line 2: mode = "tensile": did you mean "tension"?'),
        ("stretch,stress_MPa,mode\n0.1,0.1,tension\n", "line 2: stretch = 0.1: must be from 1 to 10 in tension"),
        ("stretch,stress_MPa,mode\n1.1,0.1,shear\n1.2,-0.1,compression\n", "line 3: stretch = 1.2: must be from 0.1"),
        (
            "stretch,stress_MPa,mode\n0.9,0.1,compression\n0.8,0.2,compression\n",
            "the stress in compression must be neg",
        ),
        ("stretch,stress_MPa,mode\n1.1,a,tension\n", "line 2: stress_MPa = 'a'"),
        ("stretch,stress_MPa,mode,stress_MPa_std\n1.1,0.1,tension,0\n", "line 2: stress_MPa_std = 0: must be from"),
        ("stretch,stress_MPa,mode\n1.1,0.1,tension\n", "1 measured values for 1 free keys"),
    ],
)
def test_mistakes_of_a_file(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(Finger3dError) as found:
        identified("neo-hookean", tmp_path / "a.csv", tmp_path / "out", {})
    assert told in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--free", "material.E_MPa=0.1:5"], "a.csv: a material test needs a law"),
        (
            ["--set", "effects.large_deformation.law=yeoh", "--free", "friction.mu=0.1:1"],
            "--free friction.mu: material",
        ),
        (["--measured", "A", "--free", "material.E_MPa=0.1:5"], "given twice"),
        (["--measured", "P", "--measured", "Q", "--free", "material.E_MPa=0.1:5"], "is a second press beside"),
    ],
)
def test_what_the_command_refuses_in_one_line(tmp_path: Path, capsys: Any, options: list[str], told: str) -> None:
    path = rows_of(tmp_path / "a.csv", CLOSED["yeoh"][1], ["tension"])
    for name in ("p.csv", "q.csv"):
        (tmp_path / name).write_text("depth_mm,normal_force_N\n1,1\n2,3\n")
    named = {"A": str(path), "P": str(tmp_path / "p.csv"), "Q": str(tmp_path / "q.csv")}
    first = ["identify", str(written(tmp_path, scene(press=PRESS).to_toml())), "--measured", str(path)]
    fixed = ["--set", "effects.large_deformation.c2_over_c1=0", "--set", "effects.large_deformation.c3_over_c1=0"]
    rest = [named.get(option, option) for option in options] + (fixed if "yeoh" in " ".join(options) else [])
    assert main([*first, "--out", str(tmp_path / "out"), *rest]) == 2
    assert told in capsys.readouterr().err.strip().splitlines()[-1]
