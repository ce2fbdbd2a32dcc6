"""Forecast of size, time and memory."""

from __future__ import annotations

import csv
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d._cost import mesh_gb
from finger3d.accuracy.cost import forecast
from finger3d.contact.friction import Coulomb
from finger3d.effects import effect_names, effect_type
from finger3d.errors import OUT_OF_MEMORY, Finger3dError
from finger3d.fem.laws.material import Isotropic
from finger3d.geometry.design import designs
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.model import Domain, Gauge, Leg, MeshOptions, Model
from finger3d.objects import Plane, Sphere
from finger3d.scene import load
from tests.scenes import FIG9

SETTINGS: dict[str, dict[str, Any]] = {
    "elastic_object": {"E_MPa": 2.0, "nu": 0.4},
    "embedded_gauge": {"E_MPa": 3000.0, "thickness_mm": 0.02, "width_mm": 2.0},
    "kinetic_friction": {"ratio": 0.7},
    "large_deformation": {},
    "viscosity": {"prony": ((0.3, 0.5),), "bulk": False},
}


def baseline(domain: Domain) -> Model:
    body = designs()["clipped_cylinder"](radius_mm=100.0, half_length_mm=50.0, edge_height_mm=36.6, width_mm=20.0)
    return Model(
        body, Isotropic(1.0, 0.45), MeshOptions(3.0, 8.0, "swept"), (Leg(10.0, steps=5, duration_s=1.0),),
        friction=Coulomb(0.25), domain=domain, gauges=(Gauge("g", 36.0, 38.0, length_mm=4.0),),
    )  # fmt: skip


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
@pytest.mark.parametrize("name", effect_names())
def test_every_effect_says_what_it_costs(name: str, domain: Domain) -> None:
    plain = baseline(domain)
    without, with_it = forecast(plain), forecast(effect_type(name)(**SETTINGS[name]).apply(plain))
    assert name not in without
    assert with_it[name]
    for key in ("total_s", "memory_MB"):
        if name == "kinetic_friction":
            assert with_it[key] == without[key]
        else:
            assert with_it[key] >= without[key]


def test_gauges_and_increments_are_counted() -> None:
    plain = baseline("plane-strain")
    many = tuple(Gauge(f"g{i}", 30.0, 38.0) for i in range(10_000))
    without, with_them = forecast(plain), forecast(replace(plain, gauges=many))
    # 10 000 gauges took over 40 s before condensing, in a compliance of 10 000 rows: 0.8 GB, and copies of it
    assert with_them["total_s"] > without["total_s"] + 20.0
    assert with_them["memory_MB"] > without["memory_MB"] + 800.0
    assert with_them["gauges"] == 10_000
    long = forecast(replace(plain, legs=(Leg(10.0, steps=10_000, duration_s=1.0),)))
    # every increment keeps force, gap, position and slip of all points, 8 bytes each
    kept = 10_000 * 2 * 8 * 6 * without["contact_points"] / 1e6
    assert long["memory_MB"] - without["memory_MB"] > kept
    assert long["total_s"] > without["total_s"] + 20.0


@pytest.mark.parametrize("many", [{"gauges": tuple(Gauge(f"g{i}", 30.0, 38.0) for i in range(10_000))},
                                  {"legs": (Leg(10.0, steps=10_000, duration_s=1.0),)}])  # fmt: skip
def test_what_memory_cannot_hold_is_refused(many: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    from finger3d.meshing import limits

    plain = replace(baseline("plane-strain"), gauges=())
    few, lot = (1e6 * forecast(model)["memory_MB"] for model in (plain, replace(plain, **many)))
    # four fifths of the memory may be used: as much as lies between the two forecasts
    memory = round(0.5 * (few + lot) / 0.8)
    monkeypatch.setattr(limits, "memory_bytes", lambda: (memory, memory))
    assert forecast(plain)["memory_MB"] > 0
    with pytest.raises(Finger3dError, match="forecast"):
        forecast(replace(plain, **many))


@pytest.mark.slow
def test_presses_took_what_is_foretold(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # whole presses of the Fig. 9 finger as measured last, 12 000 unknowns and more; a factor 2 is what it claims
    from finger3d.meshing import limits

    monkeypatch.setattr(limits, "memory_bytes", lambda: (10**12, 10**12))  # larger ones need more than this machine has
    with (root / "validation" / "results" / "scaling_table.csv").open(encoding="utf-8", newline="") as file:
        measured = list(csv.DictReader(file))
    assert {row["series"] for row in measured} == {"unknowns", "contact rows"}
    for row in measured:
        sizes = ["mesh.gauge_refinement=1", *(f"mesh.{key}={row[key]}" for key in ("size_mm", "base_size_mm"))]
        told = forecast(
            load(root / "geometries" / "fig9.toml", [*sizes, "mesh.mesher=swept", "press.steps=10"]).model()
        )
        assert 0.5 < told["total_s"] / float(row["seconds"]) < 2.0, row
        assert 0.5 < told["memory_MB"] / float(row["peak_MB"]) < 2.0, row
        assert 0.5 < told["dofs"] / float(row["dofs"]) < 2.0, row


def test_automatic_increments_are_foretold_with_all_the_runs_that_choose_them() -> None:
    # 5, 10 and 20 increments where the last is usual
    legs = (Leg(10.0, steps="auto"),)
    told, fixed = (forecast(replace(baseline("solid"), legs=x)) for x in (legs, (Leg(10.0, steps=35),)))
    assert (told["steps"], told["steps_of_all_runs"]) == (20, 35)
    assert told["contact_s"] == fixed["contact_s"]
    assert "steps_of_all_runs" not in fixed
    large = effect_type("large_deformation")().apply(replace(baseline("solid"), legs=legs))
    assert forecast(large)["steps"] == 12  # chosen on a coarser mesh
    assert "steps_of_all_runs" not in forecast(large)


@pytest.mark.parametrize("domain", ["plane-strain", "solid"])
def test_a_mesh_that_needs_no_mesher_is_counted_exactly(domain: Domain) -> None:
    """Parts that meet count the pressures of their interface twice, and candidates lie beyond the overlap."""
    from tests.test_parts import tip

    model = tip(domain=domain, mesh=MeshOptions(0.4 if domain == "plane-strain" else 1.2, 1.5, "swept"))
    expected, problem = forecast(model), build(model)
    assert expected["contact_points"] == len(problem.surface.nodes)
    assert expected["dofs"] == problem.body.stiffness.upper.shape[0]


def test_points_at_the_border_of_stick_are_foretold() -> None:
    from finger3d.analyses.pressed_body import PressedBody

    plain = replace(baseline("solid"), gauges=(), mesh=MeshOptions(4.0, 10.0, "swept"))
    model = replace(plain, mesh=replace(plain.mesh, stick_refinement=3.5))
    body = PressedBody.with_refined_borders(model)
    expected, without = forecast(model), forecast(plain)
    # seven solids had 0.75 to 1.21 times the contact points and 0.81 to 1.19 times the unknowns
    assert 0.67 < body.problem.size.contact_points / expected["contact_points"] < 1.5
    assert 0.67 < body.problem.size.dofs / expected["dofs"] < 1.5
    assert expected["contact_points"] > 1.5 * without["contact_points"]
    assert expected["total_s"] > without["total_s"]
    smooth = replace(model, friction=Coulomb(0.0))  # nothing sticks
    assert forecast(smooth)["contact_points"] == without["contact_points"]


@pytest.mark.slow
def test_unstructured_solids_have_the_size_that_was_foretold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = replace(baseline("solid"), legs=(Leg(3.0, steps=2),), object=Sphere(radius_mm=20.0))
    model = replace(plain, mesh=MeshOptions(1.5, 8.0, "ftetwild"))
    expected, made = forecast(model), []
    for number in range(3):
        monkeypatch.setenv("FINGER3D_CACHE", str(tmp_path / str(number)))  # each mesh is made anew
        made.append(build(model))
    # nine meshes had 0.79 to 1.01 times the unknowns, and eight 1.04 to 1.27 times the contact points: 60 on average
    assert 0.8 < np.mean([one.body.stiffness.upper.shape[0] for one in made]) / expected["dofs"] < 1.15
    assert 0.85 < np.mean([len(one.surface.nodes) for one in made]) / expected["contact_points"] < 1.4


FINGERTIP = {"radius_mm": 20.0, "half_length_mm": 10.0, "edge_height_mm": 6.0, "width_mm": 12.0}


@pytest.mark.parametrize(
    ("design", "dimensions", "edges", "unknowns"),
    [
        ("fingertip", FINGERTIP | {"skin_mm": 0.5}, (1.0, 2.0), 20117),
        ("fingertip", FINGERTIP | {"skin_mm": 1.0}, (1.5, 3.0), 14113),
        ("fingertip", FINGERTIP | {"skin_mm": 1.0}, (0.7, 2.0), 16223),
        ("clipped_cylinder", FINGERTIP, (4.0, 8.0), 8577),
        ("block", {"half_length_mm": 10.0, "height_mm": 8.0, "width_mm": 12.0}, (1.5, 4.0), 8472),
    ],
)
def test_unknowns_of_thin_layers_and_of_coarse_solids_are_those_that_ftetwild_made(
    design: str, dimensions: dict[str, float], edges: tuple[float, float], unknowns: int
) -> None:
    body = designs()[design](**dimensions)
    model = Model(body, Isotropic(1.0, 0.49), MeshOptions(*edges, "ftetwild"), (Leg(1.0, steps=5),), object=Plane())
    assert 0.7 < unknowns / forecast(model)["dofs"] < 1.4


def test_large_meshes_take_the_memory_that_was_measured() -> None:
    # of condensations of the Fig. 9 finger with 482 640, 776 577 and 1 009 778 unknowns, by validation/scaling.py
    for tets, measured in ((107_613, 8.0), (174_372, 14.4), (228_024, 19.8)):
        assert mesh_gb(tets, 3) == pytest.approx(measured, rel=0.1)


SCENE = (
    FIG9
    + """
[material]
E_MPa = 1.0
nu = 0.49
[press]
depth_mm = 10.0
steps = 1
[mesh]
size_mm = 1.5
base_size_mm = 6.0
mesher = "swept"
"""
)

LIMITED = """
import resource, sys
import finger3d.cli, finger3d.analyses.press, finger3d.scene
resource.setrlimit(resource.RLIMIT_AS, ({limit}, resource.getrlimit(resource.RLIMIT_AS)[1]))
sys.exit(finger3d.cli.main(sys.argv[1:]))
"""


# bytes of address space that are left to 19 000 unknowns: too few for MKL's libraries.  With fewer,
# OpenBLAS may wait for ever for a buffer that it cannot map.
def test_one_line_and_exit_3(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    command = ["press", str(scene), "--out", str(tmp_path / "out"), "--no-figures", "--no-error"]
    run = subprocess.run(
        [sys.executable, "-c", LIMITED.format(limit=300_000_000), *command], capture_output=True, text=True, timeout=100
    )
    assert run.returncode == 3, run.stderr
    assert run.stderr == f"finger3d: {OUT_OF_MEMORY}\n"
