"""Types that many modules share, and read-only arrays of frozen dataclasses."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Float: TypeAlias = NDArray[np.float64]
Int: TypeAlias = NDArray[np.int64]
Array: TypeAlias = NDArray[Any]
"""Array of any type of numbers or texts."""

Tree: TypeAlias = dict[str, Any]
"""Table of TOML or object of JSON; its values are numbers, texts, lists and tables."""

TreeView: TypeAlias = Mapping[str, Any]
"""The same, read-only."""


def freeze_arrays(record: DataclassInstance) -> None:
    """Replace every array of a dataclass, and every array in its mappings, by a read-only view.

    A frozen dataclass calls it in ``__post_init__``. The arrays that were passed stay writable for their owner.
    """
    values = vars(record)
    for name, value in values.items():
        if isinstance(value, np.ndarray):
            values[name] = _view(value)
        elif isinstance(value, Mapping):
            values[name] = {key: _view(v) if isinstance(v, np.ndarray) else v for key, v in value.items()}


def _view(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.setflags(write=False)
    return view
