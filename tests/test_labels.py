"""Labels for learning: fields on a grid of the contact face, for the points of a sweep, against single presses."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import finger3d
from finger3d.analyses.sweep.labels import PARTS
from finger3d.analyses.sweep.run import sweep
from finger3d.progress import Progress

PAD: dict[str, Any] = {
    "finger": {"geometry": "block", "half_length_mm": 6.0, "height_mm": 3.0, "width_mm": 8.0},
    "material": {"E_MPa": 0.1, "nu": 0.45},
    "object": {"shape": "sphere", "radius_mm": 4.0, "x_mm": 1.0},
    "friction": {"mu": 0.5},
    "press": {"leg": [{"depth_mm": 0.5, "steps": 2}, {"depth_mm": 0.5, "slide_x_mm": 0.3, "steps": 2}]},
    "mesh": {"mesher": "swept", "size_mm": 1.0, "base_size_mm": 1.0},
    "labels": {"grid_mm": 1.0},
    "effects": {"auto": False},
}
DRAWN = {"friction.mu": [0.2, 0.9, 0.5], "object.radius_mm": [3.0, 5.0, 4.0], "object.x_mm": [-2.0, 1.5, 1.0]}


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("points") / "points.csv"
    lines = [",".join(DRAWN), *(",".join(map(str, row)) for row in zip(*DRAWN.values(), strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _arrays(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = {}
    with h5py.File(folder / "labels.h5") as file:
        file.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
    return found


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory, drawn: Path) -> Path:
    folder = tmp_path_factory.mktemp("labels")
    sweep(PAD, drawn, folder)
    return folder


def test_objects_and_friction_of_all_samples_share_a_body(swept: Path) -> None:
    found = _arrays(swept)
    assert {name.split("/")[0] for name in found} == {"body_1"}
    assert found["body_1/numbers/object.radius_mm"].tolist() == DRAWN["object.radius_mm"]
    assert found["body_1/displacement_mm"].shape == (3, 1, 13, 9, 3)
    assert not (swept / PARTS).exists()


def test_a_sample_is_a_single_press(swept: Path, tmp_path: Path) -> None:
    overrides = [f"{key}={values[0]}" for key, values in DRAWN.items()]
    result = finger3d.press(PAD | {"marker_grid": {"spacing_mm": 1.0}}, tmp_path, overrides=overrides, figures=False)
    found, last = _arrays(swept), result.last
    for name in ("normal_force_N", "tangential_force_x_N", "stick_area_mm2", "slip_margin", "external_work_mJ"):
        assert found[f"body_1/numbers/{name}"][0] == pytest.approx(getattr(last, name), rel=1e-9, abs=1e-12), name
    with (tmp_path / "markers.csv").open(newline="") as stream:
        rows = [row for row in csv.DictReader(stream) if row["step"] == "4"]
    moved = np.array([[float(row[f"displacement_{axis}_mm"]) for axis in "xyz"] for row in rows])
    # both satisfy the contact conditions to 1e-8 of the depth, on other sets of candidate points
    assert found["body_1/displacement_mm"][0, 0].reshape(-1, 3) == pytest.approx(moved, rel=0.0, abs=0.5e-8)


def test_the_fields_of_a_flat_pad_add_up_to_its_forces(swept: Path) -> None:
    """The trapezoidal rule with some five places across the contact."""
    found = _arrays(swept)
    pressure, shear, status = (found[f"body_1/{name}"][:, 0] for name in ("pressure_MPa", "shear_MPa", "status"))
    assert pressure.sum(axis=(1, 2)) == pytest.approx(found["body_1/numbers/normal_force_N"], rel=0.03)
    assert shear[..., 0].sum(axis=(1, 2)) == pytest.approx(found["body_1/numbers/tangential_force_x_N"], rel=0.06)
    assert (pressure[status == 0] == 0.0).mean() > 0.9
    depth = found["body_1/depth_mm"][:, 0]
    assert np.nanmax(depth, axis=(1, 2)) == pytest.approx(0.5, abs=0.1)
    assert abs(np.nanmin(depth)) < 0.1


def test_an_interrupted_sweep_ends_with_the_same_file(swept: Path, drawn: Path, tmp_path: Path) -> None:
    class Interrupted(Progress):
        def step(self, done: int, total: int, remark: str = "") -> None:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(PAD, drawn, tmp_path, report=Interrupted())
    kept = _arrays(tmp_path)["body_1/sample"]
    assert 1 <= len(kept) < 3
    assert (tmp_path / PARTS).is_dir()
    sweep(PAD, drawn, tmp_path)
    whole, again = _arrays(swept), _arrays(tmp_path)
    assert not (tmp_path / PARTS).exists()
    assert whole.keys() == again.keys()
    for name in whole.keys() - {f"body_1/numbers/{key}" for key in ("seconds", "build_seconds")}:
        assert np.allclose(whole[name], again[name], rtol=1e-9, atol=1e-12, equal_nan=True), name


def test_all_increments_at_large_deformation(tmp_path: Path) -> None:
    scene = PAD | {"labels": {"grid_mm": 2.0, "increments": "all"}, "effects": {"auto": False, "large_deformation": {}}}
    sweep(scene, {"object.radius_mm": [3.0, 5.0]}, tmp_path, overrides=["mesh.size_mm=1.5", "mesh.base_size_mm=1.5"])
    found = _arrays(tmp_path)
    assert found["body_1/status"].shape == (2, 4, 7, 5)
    assert found["body_1/pose/slide_x_mm"][0] == pytest.approx([0.0, 0.0, 0.15, 0.3])


def test_a_grid_that_is_too_fine_is_refused() -> None:
    with pytest.raises(finger3d.Finger3dError, match=r"labels\.grid_mm = 1e-05: must be a number from"):
        finger3d.plan(PAD, overrides=["labels.grid_mm=1e-5"])


def test_labels_of_an_elastic_object_are_refused(tmp_path: Path) -> None:
    soft = PAD | {"effects": {"auto": False, "elastic_object": {"E_MPa": 1.0, "nu": 0.4}}}
    with pytest.raises(finger3d.Finger3dError, match=r"\[labels\]: only of rigid objects"):
        sweep(soft, {"friction.mu": [0.2, 0.5]}, tmp_path)
