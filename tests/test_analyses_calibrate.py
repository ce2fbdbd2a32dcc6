"""Calibration: presses by mu, joint readings, the mesh, and the files."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.calibrate import TOLERANCES
from finger3d.analyses.calibrate.curve_points import SHARE, choose_mesh, mesh_share
from finger3d.analyses.calibrate.run import calibrate, calibrated
from finger3d.analyses.reduced import ReducedModel
from finger3d.cli import main
from finger3d.contact.friction import Coulomb
from finger3d.errors import Finger3dError
from finger3d.io import claimed
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.march.solve import Press, march
from finger3d.mechanics.model import Model
from finger3d.mechanics.readings import ORDER
from finger3d.objects import Move
from finger3d.progress import QUIET
from finger3d.scene import load as load_scene
from finger3d.sensor import Calibration, ReadingCurve, Tolerance, estimate, load
from tests.logs import Log
from tests.models import fig9
from tests.sensor_cases import FEW, NONE, SCENE, curve, scene, straight


def test_the_curve_is_what_presses_of_the_scene_give() -> None:
    found = calibrate(scene(), "g36", mus=FEW, tolerances=NONE)
    model = scene().model()
    *_, frame = march(build(replace(model, friction=Coulomb(0.4))))
    assert found.readings[0].reading[2] == pytest.approx(frame.gauges["g36"], abs=1e-13)
    assert tuple(found.mu) == FEW
    assert found.readings[0].tolerances == ()


def test_effects_the_scene_names_are_in_the_curve() -> None:
    effects = {"embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 3.0},
               "kinetic_friction": {"ratio": 0.7}}  # fmt: skip
    stiff = scene(effects=effects, gauge=[SCENE["gauge"][1]])
    found = calibrate(stiff, "long", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3})
    *_, frame = march(build(replace(stiff, tables=stiff.tables).model()))
    free = calibrate(scene(gauge=[SCENE["gauge"][1]]), "long", mus=FEW, tolerances=NONE)
    assert (
        np.abs(found.readings[0].reading).max() < 0.5 * np.abs(free.readings[0].reading).max()
    )  # a foil reads a part of the free strain
    assert found.readings[0].tolerances[0].slope.any()


@pytest.mark.parametrize("bulk", [True, False])
def test_a_fast_viscous_press_reads_the_instantaneous_body_and_a_slow_one_the_relaxed(
    bulk: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    # elastic presses are not cut where contact begins, as viscous ones are not
    monkeypatch.setattr(Press, "moves_to", lambda press, pose: (Move(press.pose, pose),))

    def viscous(duration_s: float) -> Calibration:
        effects = {"viscosity": {"prony": [[0.5, 1.0]], "bulk": bulk}}
        timed = scene(effects=effects, press={"depth_mm": 10.0, "steps": 4, "duration_s": duration_s})
        return calibrate(timed, "g36", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3, "tilt_deg": 0.5})

    def elastic(nu: float) -> Calibration:
        still = scene(material={"E_MPa": 1.0, "nu": nu})
        return calibrate(still, "g36", mus=FEW, tolerances={**NONE, "gauge_x_mm": 0.3, "tilt_deg": 0.5})

    k, g = 1.0 / (3.0 * (1.0 - 2.0 * 0.45)), 0.5 / (2.0 * (1.0 + 0.45))
    relaxed = 0.45 if bulk else (3.0 * k - 2.0 * g) / (2.0 * (3.0 * k + g))
    # a share 1e-6 of the time constant moves the moduli by as much; contact edges may turn that into a little more
    for one, other in ((viscous(1e-6), elastic(0.45)), (viscous(1e6), elastic(relaxed))):
        assert one.readings[0].reading == pytest.approx(other.readings[0].reading, rel=1e-4)
        for a, b in zip(one.readings[0].tolerances, other.readings[0].tolerances, strict=True):
            assert a.slope == pytest.approx(b.slope, rel=1e-3, abs=1e-6), a.name


def test_a_viscous_curve_is_read_after_the_hold_and_tells_mu() -> None:
    legs = [{"depth_mm": 10.0, "steps": 4, "duration_s": 0.2}, {"depth_mm": 10.0, "steps": 2, "duration_s": 3.0}]
    changes = {"press": {"leg": legs}, "effects": {"viscosity": {"prony": [[0.4, 0.5]], "bulk": False}}}
    found = calibrate(scene(**changes), "g36", mus=FEW)
    assert {t.name for t in found.readings[0].tolerances} == set(TOLERANCES)
    *_, before, frame = march(build(scene(**changes, friction={"mu": 0.4}).model()))
    assert found.readings[0].reading[2] == pytest.approx(frame.gauges["g36"], rel=1e-9)
    assert abs(found.readings[0].reading[2] - before.gauges["g36"]) > 1e-5  # it creeps
    (answer,) = estimate(found, frame.gauges["g36"], tolerances=False)
    assert answer.mu == pytest.approx(0.4, abs=answer.std)


def test_large_deformation_goes_the_long_way_and_says_so(tmp_path: Path) -> None:
    coarse = {"size_mm": 5.0, "base_size_mm": 15.0, "mesher": "swept"}
    large = scene(effects={"large_deformation": {}}, mesh=coarse, press={"depth_mm": 3.0, "steps": 2})
    found = calibrate(large, "g36", tmp_path, FEW[:4], tolerances=NONE, report=(said := Log()))
    assert found.about["factorizations"] > 2  # one of the build, and those of the increments, which all mu share
    assert len(found.mu) == 4
    assert any("full" in line for line in said.lines)
    assert not (tmp_path / "reduced.npz").exists()


def test_coverage_with_a_depth_that_is_off_by_presses_of_the_real_body() -> None:
    """Depth errors are pressed, not linearised; noise is drawn; the interval comes from the calibration's slopes."""
    model = scene().model()
    found, curve = calibrated(model, "g36", np.linspace(0.1, 1.0, 13), tolerances={**NONE, "depth_mm": 0.1})
    body = ReducedModel.of(curve.problem)
    random = np.random.default_rng(7)
    count = 250
    hits = 0
    for mu in random.uniform(0.2, 0.9, count):
        legs = [replace(leg, depth_mm=leg.depth_mm + random.normal(0.0, 0.1)) for leg in model.legs]
        strain = body.press(float(mu), legs).steps[-1].gauges["g36"] + random.normal(0.0, found.noise[0])
        (answer,) = estimate(found, strain)
        hits += any(low <= mu <= high for low, high in answer.intervals)
    wanted = 0.9
    # three binomial standard deviations; the interpolation error, which is no random one here, can only widen the set
    three = 3.0 * math.sqrt(wanted * (1.0 - wanted) / count)
    assert wanted - three <= hits / count <= wanted + three + 0.1


SENSORS: dict[str, Any] = {
    "marker": [{"name": "m1", "x_mm": 30.0, "y_mm": 40.0}],
    "taxel": [{"name": "t1", "x_mm": 20.0, "length_mm": 6.0, "width_mm": 6.0}],
}
SOME = {**NONE, "depth_mm": 0.1, "E_percent": 5.0, "nu": 0.003, "tilt_deg": 0.5, "gauge_y_mm": 0.3, "mesh": 1.0}


@pytest.fixture(scope="module")
def joint() -> Calibration:
    found = calibrate(scene(**SENSORS), ["g36", "m1.x", "t1"], mus=FEW, tolerances=SOME)
    return found


def tolerance(one: ReadingCurve, name: str) -> Any:
    return next(t for t in one.tolerances if t.name == name)


def test_each_reading_is_calibrated_as_if_alone(joint: Calibration) -> None:
    alone = calibrate(scene(), "g36", mus=FEW, tolerances=SOME)
    gauge, (other_gauge,) = joint.readings[0], alone.readings
    assert gauge.reading == pytest.approx(other_gauge.reading, rel=1e-9)
    assert [t.name for t in gauge.tolerances] == [t.name for t in other_gauge.tolerances]
    for own, other in zip(gauge.tolerances, other_gauge.tolerances, strict=True):
        assert own.slope == pytest.approx(other.slope, rel=1e-6, abs=1e-9)
        assert own.spread == pytest.approx(other.spread, rel=1e-6, abs=1e-12)
    assert [c.kind for c in joint.readings] == ["gauge", "marker", "taxel"]
    assert [c.noise for c in joint.readings] == [1.5e-4, 0.02, 1e-3]


def test_the_modulus_changes_pressures_alone(joint: Calibration) -> None:
    gauge, marker, taxel = joint.readings
    assert tolerance(gauge, "E_percent").spread == pytest.approx(0.0)
    assert tolerance(marker, "E_percent").spread == pytest.approx(0.0)
    assert tolerance(taxel, "E_percent").slope == pytest.approx(0.01 * taxel.reading, rel=0.05)


def test_a_tilt_is_that_of_tilted_presses(joint: Calibration) -> None:
    """By sqrt(3) deviations to both sides."""
    model, tilt = scene(**SENSORS).model(), 0.5 * 3.0**0.5
    change = {}
    for sign in (1.0, -1.0):
        tilted = replace(model, object=replace(model.object, tilt=sign * np.radians(tilt)), symmetry=())
        *_, last = march(build(replace(tilted, friction=tilted.friction.with_mu(0.6))))
        change[sign] = last.named_readings
    for one in joint.readings:
        expected = 0.5 * (change[1.0][one.name] - change[-1.0][one.name])
        found = tilt * tolerance(one, "tilt_deg").slope[list(FEW).index(0.6)]
        # the meshes of the tilted bodies differ
        assert found == pytest.approx(expected, rel=0.3, abs=0.1 * abs(one.reading).max() * 0.05)


def test_all_readings_together_tell_no_less_than_each(joint: Calibration) -> None:
    together = joint.mu_sd(joint.mu)
    for name in joint.names:
        assert (together <= joint.of([name]).mu_sd(joint.mu) * (1.0 + 1e-9)).all()


def test_files_of_a_joint_calibration(tmp_path: Path) -> None:
    path, out = tmp_path / "scene.toml", tmp_path / "cal"
    path.write_text(scene(**SENSORS).to_toml())
    mu = ",".join(map(str, FEW))
    off = [f"--tolerance={name}=0" for name in NONE if name != "depth_mm"]
    assert main(["calibrate", str(path), "--gauge", "g36, t1", "--out", str(out), "--mu", mu, *off]) == 0
    found = load(out / "calibration.json")
    assert found.names == ("g36", "t1")
    with (out / "calibration.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [float(r["t1"]) for r in rows] == pytest.approx(list(found.readings[1].reading))
    assert {"calibration.png", "reduced.npz", "report.html", "scene.toml"} <= {p.name for p in out.iterdir()}
    assert set(json.loads((out / "calibration.json").read_text())["variance_reductions"]) == {"noise", "depth_mm"}


@pytest.mark.parametrize(
    ("gauge", "options", "told"),
    [
        (["g36", "x1"], {}, "--gauge x1: "),
        (["g36", "m1"], {}, '"m1.'),
        (["g36", "g36"], {}, "--gauge g36: "),
        ([], {}, "--gauge: "),
        (["m1.x"], {"marker_noise_mm": 0.0}, "--marker-noise 0: "),
        (["t1"], {"taxel_noise_MPa": -1.0}, "--taxel-noise -1: "),
    ],
)
def test_what_is_refused(gauge: list[str], options: Any, told: str) -> None:
    with pytest.raises(Finger3dError) as found:
        calibrate(scene(**SENSORS), gauge, mus=FEW, **options)
    assert told in str(found.value)


@pytest.mark.slow
def test_readings_at_large_deformation() -> None:
    """At a small depth they are those of small strain."""
    shallow = {"press": {"depth_mm": 0.2, "steps": 3}, **SENSORS}
    names = ["g36", "m1.x", "t1"]
    small, large = (
        calibrate(scene(**shallow, effects=effects), names, mus=FEW[:4], tolerances={**NONE, "depth_mm": 0.01})
        for effects in ({}, {"large_deformation": {}})
    )
    for one, other in zip(small.readings, large.readings, strict=True):
        assert other.reading == pytest.approx(one.reading, rel=0.05, abs=0.02 * np.abs(one.reading).max())


SECTION = replace(fig9(), domain="plane-strain")


class Fake:
    """Calibrates without a press: the mesh leaves an error of 1e-4 at edges of 1 mm, the noise is as large."""

    def __init__(self, fails_below: float = 0.0, error: float = 1e-4) -> None:
        self.sizes: list[float] = []
        self.fails_below, self.error = fails_below, error

    def __call__(self, model: Model) -> tuple[SimpleNamespace, Calibration]:
        size = model.mesh.size_mm
        if size < self.fails_below:
            raise Finger3dError("too large")
        self.sizes.append(size)
        error = np.full(25, self.error * size**ORDER)
        found = curve(straight, noise=1e-4, tolerances=(Tolerance("mesh", "error bar", 1.0, error, 0.0 * error),))
        return SimpleNamespace(model=model), found


def test_the_mesh_is_refined_until_it_makes_less_than_a_tenth_of_the_variance() -> None:
    fake, said = Fake(), Log()
    found = choose_mesh(SECTION, True, fake, said)
    assert mesh_share(found.calibration) <= SHARE
    assert found.note == ""
    assert fake.sizes[0] == SECTION.mesh.size_mm
    assert 2 <= len(fake.sizes) <= 3  # the order of convergence tells how fine
    assert len(said.lines) == len(fake.sizes) - 1
    assert "again" in said.lines[0]


@pytest.mark.parametrize(("automatic", "longest_s"), [(False, 60.0), (True, 0.0)])
def test_a_finer_mesh_that_is_not_made_is_named_with_its_time(automatic: bool, longest_s: float) -> None:
    fake = Fake()
    found = choose_mesh(SECTION, automatic, fake, pytest.fail, longest_s)
    assert fake.sizes == [SECTION.mesh.size_mm]
    assert "mesh.size_mm = 0.6" in found.note
    assert found.note.endswith(" s")


def test_a_mesh_that_cannot_be_made_leaves_the_calibration_before() -> None:
    fake = Fake(fails_below=1.0)
    found = choose_mesh(SECTION, True, fake, QUIET)
    assert fake.sizes == [SECTION.mesh.size_mm]
    assert "large" in found.note
    with pytest.raises(Finger3dError, match="large"):
        choose_mesh(SECTION, True, Fake(fails_below=9.0), pytest.fail)


@pytest.mark.slow
def test_the_mesh_that_was_chosen_is_that_of_the_results(tmp_path: Path) -> None:
    only = {**NONE, "mesh": 1.0}
    chosen = calibrate(scene(mesh={"mesher": "swept"}), "g36", tmp_path / "own", FEW, noise=1e-3, tolerances=only)
    assert chosen.about["mesh"]["size_mm"] < 0.5  # of the first mesh
    assert chosen.about["mesh"]["note"] == ""
    assert mesh_share(chosen) <= SHARE
    assert load_scene(tmp_path / "own" / "scene.toml").mesh.size_mm == chosen.about["mesh"]["size_mm"]
    given = calibrate(scene(), "g36", tmp_path / "given", FEW, tolerances=only)
    assert given.about["mesh"]["size_mm"] == SCENE["mesh"]["size_mm"]
    assert " % " in given.about["mesh"]["note"]
    assert given.about["mesh"]["note"] in (tmp_path / "given" / "report.html").read_text(encoding="utf-8")


def test_a_folder_takes_one_calibration_at_a_time(tmp_path: Path) -> None:
    with claimed(tmp_path), pytest.raises(Finger3dError, match="writing"):
        calibrate(scene(), "g36", tmp_path)
