"""Columns as a Parquet file, without pandas.

pyarrow imports pandas, if it is installed, as soon as it is given a list or an array: 0.35 s of a processor that
presses. So Arrow is given the memory of each column, which needs no pandas.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pyarrow


def write_parquet(path: Path, columns: Mapping[str, Sequence[Any]]) -> None:
    """Write columns of equal length, each of one type: float, int, bool or str.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = [_array(values) for values in columns.values()]
    pq.write_table(pa.table(arrays, names=list(columns)), path)


def _array(values: Sequence[Any]) -> pyarrow.Array:
    """What ``pyarrow.array(values)`` gives, by Arrow's memory layout of each type."""
    import pyarrow as pa

    kind, count = type(values[0]) if values else float, len(values)
    if kind is str:
        parts = [v.encode() for v in values]
        ends = np.fromiter(accumulate(map(len, parts), initial=0), np.int32, count + 1)
        return pa.Array.from_buffers(pa.string(), count, [None, pa.py_buffer(ends), pa.py_buffer(b"".join(parts))])
    if kind is bool:
        bits = np.packbits(np.array(values, bool), bitorder="little")
        return pa.Array.from_buffers(pa.bool_(), count, [None, pa.py_buffer(bits)])
    plain, arrow = (np.int64, pa.int64()) if kind is int else (np.float64, pa.float64())
    return pa.Array.from_buffers(arrow, count, [None, pa.py_buffer(np.array(values, plain))])
