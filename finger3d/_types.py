"""Types that many modules share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Float: TypeAlias = NDArray[np.float64]
Int: TypeAlias = NDArray[np.int64]
Array: TypeAlias = NDArray[Any]
"""Array of any type of numbers or texts."""

Tree: TypeAlias = dict[str, Any]
"""Table of TOML or object of JSON; its values are numbers, texts, lists and tables."""

TreeView: TypeAlias = Mapping[str, Any]
"""The same, read-only."""
