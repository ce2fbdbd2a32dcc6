"""Steps that are kept."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from finger3d.contact.zones import zone_area
from finger3d.errors import Finger3dError
from finger3d.results.states import chosen, load_states


def test_steps_hold_the_last_state_of_the_other_files(solid: Path) -> None:
    import pyvista

    states, grid = load_states(solid / "steps.npz"), pyvista.read(solid / "fields.vtu")
    with (solid / "contact.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert states.step.tolist() == [1, 2, 3, 4]
    assert np.allclose(states.target[:, 0], [0.125, 0.25, 0.375, 0.5])
    # single precision: 6e-8 of the largest value
    assert np.allclose(states.points, grid.points, atol=1e-5)
    assert np.allclose(states.displacement[-1], grid["displacement"], atol=1e-6)
    assert np.allclose(states.pressure[-1], [float(row["pressure_MPa"]) for row in table], atol=1e-6)
    assert [("open", "stick", "slip")[s] for s in states.status[-1]] == [row["status"] for row in table]
    assert np.array_equal(states.on_points("status", -1), grid["status"])


def test_every_kept_step_is_the_finger_at_that_depth(solid: Path) -> None:
    states = load_states(solid / "steps.npz")
    for k, (depth, *_) in enumerate(states.target):
        at = states.points[states.nodes] + states.displacement[k][states.nodes]
        # vertices that touch lie on the plane up to the weighting of the gap over their facets, h^2 / 8 R, twice
        touching = states.status[k] != 0
        assert touching.any()
        assert np.abs(at[touching, 1] - (5.0 - depth)).max() < 2 * 0.5**2 / (8 * 5.0)
        assert np.abs(states.gap[k][touching]).max() < 1e-6


def test_zones_of_kept_steps_have_the_areas_of_the_summary(solid: Path, section: Path) -> None:
    for folder in (solid, section):
        states, steps = load_states(folder / "steps.npz"), json.loads((folder / "summary.json").read_text())["steps"]
        facets = states.contact_facets[(states.contact_facets >= 0).all(axis=1)]
        corners = states.points[states.nodes][facets].astype(float)
        arms = corners[:, 1:] - corners[:, :1]
        width = np.ptp(load_states(solid / "steps.npz").points[:, 2])
        if states.dim == 3:
            area = 0.5 * np.linalg.norm(np.cross(arms[:, 0], arms[:, 1]), axis=1)
        else:
            area = width * np.linalg.norm(arms[:, 0], axis=1)
        for k, step in enumerate(states.step):
            for zone, name in zip(states.zones(k), ("contact", "stick"), strict=True):
                # single precision
                assert zone_area(facets, area, zone) == pytest.approx(steps[step - 1][f"{name}_area_mm2"], rel=1e-4)


def test_few_of_many_steps_are_kept_the_last_among_them() -> None:
    assert chosen(0) == []
    assert chosen(1) == [0]
    kept = chosen(160, 10)
    assert len(kept) == 10
    assert kept[-1] == 159
    assert np.ptp(np.diff(kept)) <= 1


def test_steps_of_something_else_are_refused_in_one_line(tmp_path: Path) -> None:
    np.savez(tmp_path / "steps.npz", a=1)
    (tmp_path / "text.npz").write_text("no")
    for name in ("steps.npz", "text.npz", "absent.npz"):
        with pytest.raises(Finger3dError, match="press"):
            load_states(tmp_path / name)


def damaged_steps(arrays: dict[str, np.ndarray]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Each array of steps.npz missing, of another type, shape or length, or with numbers that cannot be."""
    for name, a in arrays.items():
        yield f"{name} missing", {k: v for k, v in arrays.items() if k != name}
        if name == "checksum":  # its type does not matter
            continue
        changed = {
            "text": np.full(a.shape, "x"), "scalar": np.array(1.0), "one more axis": a[..., None], "empty": a[:0],
            "complex": a.astype(complex),
        }  # fmt: skip
        if name not in ("cells", "object_faces"):
            changed["shorter"] = a[:-1]
        if a.dtype.kind == "f":
            changed |= {"nan": np.full_like(a, np.nan), "infinite": np.full_like(a, np.inf)}
        if a.dtype.kind == "i":
            changed |= {"negative": np.full_like(a, -1), "float": a + 0.5}
        if name in ("cells", "facets", "nodes", "status"):
            changed["too large"] = np.full_like(a, np.iinfo(a.dtype).max)
        for how, value in changed.items():
            yield f"{name} {how}", {**arrays, name: value}


def test_damaged_steps_are_one_line_that_names_the_file(section: Path, tmp_path: Path) -> None:
    raw = (section / "steps.npz").read_bytes()
    with np.load(section / "steps.npz") as stored:
        arrays = dict(stored)
    cases = {"empty": b"", "half": raw[: len(raw) // 2], "cut": raw[:-1], "text": b"steps", "pickle": b"\x80\x04N."}
    single = io.BytesIO()
    np.save(single, np.arange(3.0))
    cases["an array alone"] = single.getvalue()
    turned = bytearray(raw)
    turned[len(raw) // 2] ^= 0xFF
    cases["a changed byte"] = bytes(turned)
    for what, content in damaged_steps(arrays):
        stream = io.BytesIO()
        np.savez(stream, **content)
        cases[what] = stream.getvalue()
    path = tmp_path / "steps.npz"
    for what, data in cases.items():
        path.write_bytes(data)
        with pytest.raises(Finger3dError, match="press") as refused:
            load_states(path)
        assert str(refused.value).startswith(f"{path}: "), what
        assert "\n" not in str(refused.value)
