"""finger3d show: pictures without a display, the window off-screen, and one line where there is nothing to show."""

from __future__ import annotations

import io
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from finger3d.cli import main
from finger3d.errors import Finger3dError
from finger3d.plotting import renderer as opengl
from finger3d.plotting.window import values
from finger3d.results.states import load_states
from tests.pictures import marked, rgb


@pytest.mark.slow
def test_the_window_off_screen_answers_its_controls(solid: Path, section: Path, tmp_path: Path) -> None:
    for folder in (solid, section):
        picture = tmp_path / f"{folder.parent.name}.png"
        command = [sys.executable, "-P", "-m", "finger3d.plotting.window", str(folder), str(picture)]
        assert opengl.run_child(command) is None
        assert rgb(picture).std() > 10.0
        assert marked(rgb(picture)) > 30


def test_values_of_the_window(solid: Path) -> None:
    import pyvista

    states, end = load_states(solid / "steps.npz"), pyvista.read(solid / "fields.vtu")
    assert values(states, end, "displacement", 0).max() == pytest.approx(0.125, rel=0.2)
    assert np.array_equal(values(states, end, "status", 3), end["status"])
    assert np.isnan(values(states, end, "stress", 0)).all()
    # von Mises from its definition by the deviator
    tensor = np.asarray(end["stress"])[:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    deviator = tensor - np.trace(tensor, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    wanted = np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2)))
    assert np.allclose(values(states, end, "stress", 3), wanted, rtol=1e-6)
    shear = values(states, end, "shear", 3)
    # friction is limited by mu times the pressure, in single precision
    assert (shear <= 0.25 * values(states, end, "pressure", 3) + 1e-6).all()


def damaged_steps(arrays: dict[str, np.ndarray]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Each array of steps.npz missing, of another type, shape or length, or with numbers that cannot be."""
    for name, a in arrays.items():
        yield f"{name} missing", {k: v for k, v in arrays.items() if k != name}
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
        with pytest.raises(Finger3dError, match="press the scene again") as refused:
            load_states(path)
        assert str(refused.value).startswith(f"{path}: "), what
        assert "\n" not in str(refused.value)


GAUGE = {"name": "g", "x_mm": 0.0, "y_mm": 1.0, "z_mm": 0.0, "angle_deg": 0.0, "length_mm": 0.0}
NAN = math.nan
SCENES: list[object] = [
    None, 5, [], {"title": 5}, {"gauge": 5}, {"gauge": [1]}, {"gauge": [{}]},
    *({"gauge": [{**GAUGE, key: value}]} for key in ("x_mm", "angle_deg") for value in (None, "a", [1], 10**400, NAN)),
]  # fmt: skip


def test_a_damaged_summary_is_one_line_that_names_the_file(
    section: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "steps.npz").symlink_to(section / "steps.npz")
    path = tmp_path / "summary.json"
    texts = ["", "{", "[]", "5", "null", "[" * 100_000, "{}", *(json.dumps({"scene": s}) for s in SCENES)]
    for data in [*(text.encode() for text in texts), b'{"scene": "\xe9"}']:
        path.write_bytes(data)
        assert main(["show", str(tmp_path), "--png", str(tmp_path / "a.png")]) == 2, data
        err = capsys.readouterr().err
        assert len(err.splitlines()) == 1
        assert str(path) in err
        assert "again" in err  # the cure
    assert not (tmp_path / "a.png").exists()


@pytest.mark.slow
def test_a_display_that_cannot_be_opened_is_one_line(section: Path) -> None:
    command = [sys.executable, "-m", "finger3d", "show", str(section)]
    env = {**os.environ, "DISPLAY": ":4711"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1
    assert "add --png FILE" in done.stderr
