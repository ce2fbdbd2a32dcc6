"""Files of reduced models: what is written is read again, and damaged files are refused."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from finger3d.analyses.reduced import ReducedModel
from finger3d.errors import Finger3dError
from finger3d.io import read_arrays, write_arrays
from finger3d.mechanics.discretise.build import build
from tests.models import small_section


def replaced(header: Any, path: tuple[Any, ...], value: Any) -> Any:
    copy = json.loads(json.dumps(header))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copy


def test_a_header_or_arrays_that_do_not_fit_are_one_line(tmp_path: Path) -> None:
    good = ReducedModel.of(build(small_section())).save(tmp_path / "good.npz")
    with np.load(good) as stored:
        arrays = dict(stored)
    header = json.loads(arrays.pop("header").tobytes())
    numbers: list[tuple[Any, ...]] = [
        ("material", "E_MPa"), ("material", "nu"), ("legs", 0, "depth_mm"), ("legs", 0, "steps"),
        ("body", "height_mm"), ("touch_mm",), ("object", "x_mm"), ("friction", "mu"), ("gauges", 0, "x_mm"),
    ]  # fmt: skip
    headers = [replaced(header, path, v) for path in numbers for v in (None, "a", [], {}, math.nan, math.inf)]
    headers += [replaced(header, path, -1) for path in numbers[:6]]
    headers += [replaced(header, (key,), v) for key in ("legs", "object", "domain", "axes") for v in (None, 5, "a")]
    contents = [
        (header, {**arrays, name: value})
        for name, a in arrays.items()
        if a.size
        for value in (a[:-1], a[..., None], np.full(a.shape, "x"), np.full(a.shape, np.nan), np.array(1.0))
    ]
    path = tmp_path / "bad.npz"
    for told, values in [*((h, arrays) for h in headers), *contents]:
        text = np.frombuffer(json.dumps(told).encode(), dtype=np.uint8)
        np.savez(path, **values, header=text)
        with pytest.raises(Finger3dError, match="condense") as found:
            ReducedModel.load(path)
        assert str(found.value).startswith(f"{path}: ")
        assert "\n" not in str(found.value)


def test_damaged_files_are_one_line(tmp_path: Path) -> None:
    good = ReducedModel.of(build(small_section())).save(tmp_path / "good.npz")
    data = good.read_bytes()
    with np.load(good) as stored:
        arrays = dict(stored)

    def with_header(**changes: Any) -> bytes:
        header = {**json.loads(arrays["header"].tobytes()), **changes}
        stream = io.BytesIO()
        np.savez(stream, **{**arrays, "header": np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)})
        return stream.getvalue()

    missing = io.BytesIO()
    np.savez(missing, **{k: v for k, v in arrays.items() if k != "compliance"})
    cases = {
        "cut short": data[: len(data) // 2],
        "no reduced model": b"hello",
        "version 8": with_header(version=8),
        "; `finger3d calibrate` writes one": with_header(format="a cake"),
        "parts of the reduced model are missing": missing.getvalue(),
    }

    def with_array(name: str, change: Any) -> bytes:
        stream = io.BytesIO()
        np.savez(stream, **{**arrays, name: change(arrays[name].copy())})
        return stream.getvalue()

    def put(index: int, value: float) -> Any:
        def changed(array: Any) -> Any:
            array.flat[index] = value
            return array

        return changed

    single = io.BytesIO()
    np.save(single, np.zeros(3))
    damaged = [
        with_array("parent", put(0, 10**6)), with_array("parent", put(0, -1)), with_array("share", lambda a: a[:-1]),
        with_array("face_mean_at", put(0, 10**6)), with_array("compliance", put(0, np.nan)),
        with_array("reading_rows", put(0, np.inf)), with_array("sign", lambda a: a[:, :1]),
        with_array("face_area", lambda a: a.astype(object).astype(str)), with_array("face_mean_rows", put(1, -1)),
        with_header(legs=[{**json.loads(arrays["header"].tobytes())["legs"][0], "force_N": -1}]),
    ]  # fmt: skip
    for content in damaged:
        (tmp_path / "bad.npz").write_bytes(content)
        with pytest.raises(Finger3dError, match="damaged"):
            ReducedModel.load(tmp_path / "bad.npz")
    cases["reduced model, or cut"] = single.getvalue()
    turned = bytearray(data)
    turned[data.index(b"compliance.npy") + 400] ^= 0xFF  # inside the array, whose checksum is stored
    cases["no reduced model, or cut short"] = bytes(turned)
    for told, content in cases.items():
        path = tmp_path / "bad.npz"
        path.write_bytes(content)
        with pytest.raises(Finger3dError, match=told) as found:
            ReducedModel.load(path)
        assert "\n" not in str(found.value)
    with pytest.raises(Finger3dError, match="none.npz"):
        ReducedModel.load(tmp_path / "none.npz")


def test_whole_numbers_of_a_header_become_floats(tmp_path: Path) -> None:
    good = ReducedModel.of(build(small_section())).save(tmp_path / "good.npz")
    with np.load(good) as stored:
        arrays = {name: stored[name] for name in stored if name != "checksum"}
    header = json.loads(arrays["header"].tobytes())
    header["legs"][0]["slide_x_mm"] = 10**30
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    write_arrays(tmp_path / "whole.npz", arrays)
    assert isinstance(ReducedModel.load(tmp_path / "whole.npz").problem.model.legs[0].slide_x_mm, float)


def test_a_file_that_expands_a_thousandfold_is_refused_before_it_is_read(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "zeros.npz", compliance=np.zeros(2_000_000))
    with pytest.raises(Finger3dError, match="no reduced model"):
        ReducedModel.load(tmp_path / "zeros.npz")
    with pytest.raises(ValueError, match="expands to 16 MB"):
        read_arrays(tmp_path / "zeros.npz")
