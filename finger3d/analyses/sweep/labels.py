"""Labels of a sweep in one file: fields on a regular grid of the contact face, a sample for each point.

Every sample is a file of its own in the folder `PARTS` until the sweep is complete, and `FILE` is written from these
and the rows of the sweep: an interruption at any time loses no sample that has a row.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finger3d._machine import versions
from finger3d.io import atomic
from finger3d.mechanics.postprocess.labels import FIELDS, Sample

if TYPE_CHECKING:
    import h5py

    from finger3d.analyses.sweep.points import Sweep
    from finger3d.results.journal import Row

FILE, PARTS = "labels.h5", "labels"

SAMPLE = "sample"
"""Key of a row that has the arrays of its sample, which are stored beside the row."""


def store_part(folder: Path, number: int, sample: Sample) -> None:
    """Write the arrays of a sample into a file of its own."""
    path = _part(folder, number)
    path.parent.mkdir(exist_ok=True)
    with path.with_suffix(".tmp").open("wb") as stream:  # `atomic` would search a folder of up to 100 000 files
        np.savez(stream, allow_pickle=False, **sample)
    os.replace(stream.name, path)


def _part(folder: Path, number: int) -> Path:
    return folder / PARTS / f"{number:06d}.npz"


def write_labels(folder: Path, sweep: Sweep, rows: Mapping[int, Row], columns: Mapping[str, Sequence[object]]) -> None:
    """Write labels.h5 from the samples that have rows; once all points have one, the files of samples are removed.

    Parameters
    ----------
    rows : by number of the point
    columns : the table of the sweep, with a number of the point in ``point``
    """
    if not (folder / PARTS).is_dir():
        return
    import h5py

    done = [point for point in sweep.points if _part(folder, point.number).exists() and point.number in rows]
    with atomic(folder / FILE) as temporary, h5py.File(temporary, "w") as file:
        scene = json.dumps(sweep.given, default=str)
        file.attrs.update(title=sweep.title, scene=scene, versions=json.dumps(versions()))
        for number, body in enumerate(sweep.bodies, start=1):
            of_body = [point.number for point in done if point.body == body]
            if of_body:
                _write_body(file.create_group(f"body_{number}"), folder, of_body, columns)
    if len(rows) == len(sweep.points):
        shutil.rmtree(folder / PARTS)


def _write_body(
    group: h5py.Group, folder: Path, numbers: Sequence[int], columns: Mapping[str, Sequence[object]]
) -> None:
    """Write the samples of a body: a chunk for each, NaN after the last of its increments."""
    group.create_dataset("sample", data=np.array(numbers))
    place = {number: k for k, number in enumerate(columns["point"])}
    for name, values in columns.items():
        own = [values[place[number]] for number in numbers]
        if name not in ("point", "body", "outcome"):
            texts = isinstance(own[0], str)
            group.create_dataset(f"numbers/{name}", data=np.array(own, dtype=object if texts else None))
    for k, sample in enumerate(_samples(folder, numbers)):
        for name, array in sample.items():
            if name in ("x_mm", "z_mm"):
                group.require_dataset(name, array.shape, array.dtype, data=array)
                continue
            if name not in group:
                _create(group, name, len(numbers), array)
            data = group[name]
            if len(array) > data.shape[1]:
                data.resize(len(array), axis=1)
            data[k, : len(array)] = array


def _create(group: h5py.Group, name: str, count: int, values: NDArray[Any]) -> None:
    shape = {"shape": (count, *values.shape), "maxshape": (count, None, *values.shape[1:])}
    packed = {"chunks": (1, *values.shape), "compression": "gzip", "compression_opts": 1, "shuffle": True}
    missing = np.nan if values.dtype.kind == "f" else -1
    data = group.create_dataset(name, dtype=values.dtype, fillvalue=missing, **shape, **packed)
    if name in FIELDS:
        data.attrs["description"] = FIELDS[name]
        data.attrs["axes"] = "sample, increment, x, z" + (", component" if values.ndim > 3 else "")


def _samples(folder: Path, numbers: Sequence[int]) -> Iterator[dict[str, NDArray[Any]]]:
    for number in numbers:
        with np.load(_part(folder, number)) as arrays:
            yield dict(arrays)
