"""Reduced models and their files."""

from __future__ import annotations

import io
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.reduced import ReducedModel
from finger3d.contact.friction import Coulomb
from finger3d.effects.elastic_object import Effect as ElasticObject
from finger3d.effects.embedded_gauge import Effect as Foil
from finger3d.effects.kinetic_friction import Effect as Kinetic
from finger3d.effects.large_deformation import Effect as Large
from finger3d.effects.viscosity import Effect as Viscous
from finger3d.errors import Finger3dError
from finger3d.io import read_arrays, write_arrays
from finger3d.mechanics.discretise.build import build
from finger3d.mechanics.history import measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Gauge, Leg, MeshOptions
from tests.commands import loaded
from tests.models import small_section

ROUND_OFF = 1e-12  # the same arithmetic on the same numbers
MUS = (0.0, 0.1, 0.7)
LONG = Gauge("g", 2.0, 4.0, angle=0.5, length_mm=1.0)


def same(reduced: ReducedModel, problem: Any, mu: float) -> None:
    law = problem.model.friction.with_mu(mu)
    whole = list(march(replace(problem, model=replace(problem.model, friction=law))))
    small = reduced.press(mu)
    assert small.outcome.ok
    assert len(whole) == len(small.steps)
    scale = max(np.abs(whole[-1].state.force).max(), 1e-300)
    for a, b in zip(whole, small.steps, strict=True):
        assert np.abs(a.state.force - b.state.force).max() <= ROUND_OFF * scale
        for name, strain in a.gauges.items():
            assert b.gauges[name] == pytest.approx(strain, abs=ROUND_OFF)
        told, got = measure(problem.points, a), measure(small.points, b)
        for key in ("normal_force_N", "friction_sum_N", "dissipation_mJ", "contact_area_mm2", "stick_half_length_mm"):
            assert got[key] == pytest.approx(told[key], rel=1e-11, abs=ROUND_OFF * scale)


VARIANTS: dict[str, Any] = {
    "section": lambda: small_section(),
    "solid": lambda: small_section(domain="solid", mesh=MeshOptions(1.2, 2.5, "swept")),
    "slide": lambda: small_section(legs=(Leg(0.5, steps=3), Leg(0.5, slide_x_mm=0.2, steps=2), Leg(0.1, 0.2, steps=2))),
    "kinetic": lambda: Kinetic(0.7).apply(small_section()),
    "elastic": lambda: ElasticObject(2.0, 0.4).apply(small_section()),
    "foil": lambda: Foil(3000.0, 0.02, 1.0).apply(small_section(gauges=(LONG,))),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_a_saved_body_presses_as_the_scene_does(name: str, tmp_path: Path) -> None:
    problem = build(VARIANTS[name]())
    loaded = ReducedModel.load(ReducedModel.of(problem).save(tmp_path / "reduced.npz"))
    assert loaded.gauges == tuple(g.name for g in problem.model.gauges)
    for mu in MUS:
        same(loaded, problem, mu)


def test_other_legs_are_those_of_the_scene() -> None:
    legs = (Leg(0.3, steps=3), Leg(0.0, steps=2))
    changed = Kinetic(0.6, "paper").apply(small_section(friction=Coulomb(0.4), legs=legs))
    small = ReducedModel.of(build(Kinetic(0.6, "paper").apply(small_section()))).press(0.4, legs)
    whole = list(march(replace(build(small_section()), model=changed)))
    assert small.steps[2].gauges["g"] == pytest.approx(whole[2].gauges["g"], abs=ROUND_OFF)
    assert small.steps[-1].dissipation_mJ == pytest.approx(whole[-1].dissipation_mJ, rel=1e-11)


def test_loading_and_pressing_need_no_mesher_cad_or_factorisation(tmp_path: Path) -> None:
    path = ReducedModel.of(build(small_section())).save(tmp_path / "reduced.npz")
    program = f"import finger3d; assert finger3d.ReducedModel.load({str(path)!r}).press(0.3).outcome.ok"
    heavy = ("OCP", "build123d", "vtk", "pyvista", "pytetwild", "trimesh", "pypardiso", "matplotlib")
    assert not loaded(program, *heavy, "finger3d.fem.solvers.pardiso")


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"mu": float("nan")}, "from 0 up"),
        ({"legs": [Leg(float("nan"))]}, "finite"),
        ({"legs": [Leg(0.5, slide_x_mm=0.1)]}, "slide"),
        ({"legs": [Leg(2.0)]}, "condense"),
    ],
)
def test_what_was_not_condensed_is_refused(asked: dict[str, Any], told: str) -> None:
    with pytest.raises(Finger3dError, match=told) as found:
        ReducedModel.of(build(small_section())).press(**asked)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize("effect", [Large(), Viscous(((0.3, 0.5),))])
def test_effects_without_a_fixed_compliance_are_refused(effect: Any) -> None:
    problem = build(effect.apply(small_section(legs=(Leg(0.5, steps=4, duration_s=1.0),))))
    with pytest.raises(Finger3dError, match="reduced"):
        ReducedModel.of(problem)


def test_files_that_are_none_or_were_altered_are_one_line(tmp_path: Path) -> None:
    """A checksum covers the header and every array."""
    good = ReducedModel.of(build(small_section())).save(tmp_path / "good.npz")
    data = good.read_bytes()
    with np.load(good) as stored:
        arrays = dict(stored)
    header = json.loads(arrays["header"].tobytes())

    def file(*left_out: str, **changes: Any) -> bytes:
        stream = io.BytesIO()
        np.savez(stream, **{name: a for name, a in {**arrays, **changes}.items() if name not in left_out})
        return stream.getvalue()

    def headed(**changes: Any) -> bytes:
        return file(header=np.frombuffer(json.dumps({**header, **changes}).encode(), dtype=np.uint8))

    def sealed(**changes: Any) -> bytes:
        text = json.dumps({**header, **changes}).encode()
        others = {name: a for name, a in arrays.items() if name != "checksum"}
        write_arrays(tmp_path / "sealed.npz", {**others, "header": np.frombuffer(text, dtype=np.uint8)})
        return (tmp_path / "sealed.npz").read_bytes()

    single = io.BytesIO()
    np.save(single, np.zeros(3))
    turned = bytearray(data)
    turned[data.index(b"compliance.npy") + 400] ^= 0xFF  # inside the array, whose checksum is stored by zip, too
    cases = [
        ("cut short", data[: len(data) // 2]),
        ("no reduced model", b"hello"),
        ("version 8", sealed(version=8)),
        ("; `finger3d calibrate` writes one", sealed(format="a cake")),
        ("damaged", file("compliance")),
        ("reduced model, or cut", single.getvalue()),
        ("no reduced model, or cut short", bytes(turned)),
        ("damaged", headed(legs=[{**header["legs"][0], "force_N": -1}])),
    ]
    cases += [("damaged", headed(touch_mm=value)) for value in (None, "a", [], math.nan, -1)]
    cases += [
        ("condense", file(**{name: value}))
        for name, a in arrays.items()
        if a.size
        for value in (a[:-1], a[..., None], np.full(a.shape, "x"), np.full(a.shape, np.nan), np.array(1.0))
    ]
    path = tmp_path / "bad.npz"
    for told, content in cases:
        path.write_bytes(content)
        with pytest.raises(Finger3dError, match=told) as found:
            ReducedModel.load(path)
        assert str(found.value).startswith(f"{path}: ")
        assert "\n" not in str(found.value)
    with pytest.raises(Finger3dError, match="none.npz"):
        ReducedModel.load(tmp_path / "none.npz")


def test_a_file_that_expands_a_thousandfold_is_refused_before_it_is_read(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "zeros.npz", compliance=np.zeros(2_000_000))
    with pytest.raises(Finger3dError, match="no reduced model"):
        ReducedModel.load(tmp_path / "zeros.npz")
    with pytest.raises(ValueError, match="expands to 16 MB"):
        read_arrays(tmp_path / "zeros.npz")
