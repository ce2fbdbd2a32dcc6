"""Measured material tests: CSV files of nominal stress against stretch, and the law of a scene that predicts them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from finger3d._types import Float, Tree, TreeView
from finger3d.analyses.free_keys import FreeKey
from finger3d.analyses.identify.presses import INDEX, MODULI, STD, check_stds, with_last_share
from finger3d.csv_table import CsvTable, read_table
from finger3d.effects import LARGE_DEFORMATION
from finger3d.effects.large_deformation import CONSTANTS, Effect
from finger3d.errors import Finger3dError
from finger3d.fem.laws import IsochoricLaw
from finger3d.fem.laws.base import LARGEST_STRETCH, TESTS, nominal_stress, principal_stretches, rising_to
from finger3d.scene import Scene
from finger3d.scene.messages import choose, listed

_STRETCH, _STRESS, _MODE = "stretch", "stress_MPa", "mode"
_COLUMNS = (_STRETCH, _STRESS, _MODE, _STRESS + STD)

_PREFIX = f"effects.{LARGE_DEFORMATION}."
CONSTANT_KEYS = tuple(_PREFIX + name for names in CONSTANTS.values() for name in names)
"""Keys of the constants of all laws."""


@dataclass(frozen=True)
class MaterialTest:
    """Rows of one mode in a file, n.

    Attributes
    ----------
    path : of the file
    mode : one of `TESTS`
    stretch, stress : (n,) of the loaded direction; nominal stress, MPa
    std : (n,) standard deviation of the stress, MPa; None without that column
    """

    path: Path
    mode: str
    stretch: Float
    stress: Float
    std: Float | None


def is_material_test(path: Path) -> bool:
    """Return whether a file has the column of a material test, and not those of a press."""
    return _STRETCH in read_table(path, lambda cell: cell in (*_COLUMNS, *INDEX)).names


def read_material_tests(path: Path) -> list[MaterialTest]:
    """Read a file of material tests, one test for each of its modes.

    Raises
    ------
    Finger3dError
        In one line: for a column that is missing or unknown, an unknown mode, a stretch out of range, a stress of the
        wrong sign.
    """
    table = read_table(path, lambda cell: cell in _COLUMNS)
    if missing := [name for name in _COLUMNS[:3] if name not in table.names]:
        raise Finger3dError(f"{path}: has no column {listed(missing)}; a material test has {listed(_COLUMNS[:3])}")
    if other := [name for name in table.names if name not in _COLUMNS]:
        raise Finger3dError(f'{path}: column "{other[0]}": a material test has {listed(_COLUMNS)}; leave out others')
    modes = np.array(table.texts([_MODE])[_MODE], dtype=str)
    numbers = table.numbers([name for name in table.names if name != _MODE])
    for line, mode, stretch in zip(table.lines, modes.tolist(), numbers[_STRETCH], strict=True):
        if mode not in TESTS:
            raise Finger3dError(f"{path}: line {line}: {choose((_MODE,), mode, list(TESTS))}")
        low, high = (1.0 / LARGEST_STRETCH, 1.0) if mode == "compression" else (1.0, LARGEST_STRETCH)
        if not low <= stretch <= high:
            allowed = f"must be from {low:g} to {high:g} in {mode}"
            meant = "a stretch is the length over that at rest, 1 plus the strain"
            raise Finger3dError(f"{path}: line {line}: stretch = {stretch:g}: {allowed}; {meant}")
    if _STRESS + STD in numbers:
        check_stds(path, table.lines, _STRESS, numbers[_STRESS + STD])
    return [_of_mode(path, table, mode, modes == mode, numbers) for mode in TESTS if mode in modes]


def _of_mode(path: Path, table: CsvTable, mode: str, rows: Any, numbers: Mapping[str, Float]) -> MaterialTest:
    own = {name: values[rows] for name, values in numbers.items()}
    test = MaterialTest(path, mode, own[_STRETCH], own[_STRESS], own.get(_STRESS + STD))
    if test.stress @ (test.stretch - 1.0) <= 0.0:
        sign = "negative" if mode == "compression" else "positive"
        line = table.lines[int(np.argmax(rows))]
        must = f"the stress in {mode} must be {sign}, at a stretch beside 1"
        raise Finger3dError(f"{path}: line {line} and others: {must}")
    return test


@dataclass(frozen=True)
class LawInTests:
    """What the law of a scene predicts of material tests, for values of the free keys.

    Attributes
    ----------
    given : tables of the scene
    scene : loaded
    free : the free keys (k)
    tests : by name of the column
    """

    given: TreeView
    scene: Scene
    free: tuple[FreeKey, ...]
    tests: Mapping[str, MaterialTest]

    @classmethod
    def of(cls, given: TreeView, scene: Scene, free: tuple[FreeKey, ...], tests: Sequence[MaterialTest]) -> LawInTests:
        """Name the tests by mode, those of equal mode with numbers.

        Raises
        ------
        Finger3dError
            If the scene has no law.
        """
        if tests and LARGE_DEFORMATION not in scene.effects:
            advice = f"give --set {_PREFIX}law=neo-hookean, or another"
            raise Finger3dError(f"{tests[0].path}: a material test needs a law; {advice}")
        named: dict[str, MaterialTest] = {}
        for test in tests:
            count = sum(one.mode == test.mode for one in named.values())
            named[f"{test.mode}{f'_{count + 1}' * (count > 0)}_{_STRESS}"] = test
        return cls(given, scene, free, named)

    @property
    def columns(self) -> dict[str, Float]:
        """Measured stresses by name."""
        return {name: test.stress for name, test in self.tests.items()}

    @property
    def stds(self) -> dict[str, Float]:
        """Standard deviations by name, of the tests that have them."""
        return {name: test.std for name, test in self.tests.items() if test.std is not None}

    def tells(self, key: str) -> bool:
        """Whether the tests depend on a free key."""
        return key in MODULI or key.startswith(CONSTANT_KEYS)

    @cached_property
    def _stretches(self) -> Float:
        """Principal stretches (n, 3) of all rows."""
        own = [principal_stretches(test.mode, test.stretch) for test in self.tests.values()]
        return np.concatenate([np.empty((0, 3)), *own])

    def law(self, values: Any) -> IsochoricLaw:
        """Return the law for a value of each key (k), a number or an array that broadcasts with the stretches."""
        effect, modulus = self.scene.effects[LARGE_DEFORMATION], self.scene.constants.E_MPa
        assert isinstance(effect, Effect)
        terms: Any = [list(term) for term in effect.terms or ()]
        constants: Tree = {"terms": terms} if terms else {}
        for key, value in with_last_share(self.given, [(f.key, v) for f, v in zip(self.free, values, strict=True)]):
            name, *place = key.removeprefix(_PREFIX).split(".")
            if key in MODULI:
                modulus = np.vectorize(MODULI[key], otypes=[float])(value)
            elif key.startswith(CONSTANT_KEYS) and place:
                terms[int(place[0])][int(place[1])] = value
            elif key.startswith(CONSTANT_KEYS):
                constants[name] = value
        # E = 3 G of an incompressible solid
        return replace(effect, **constants).isochoric_law().with_shear(modulus / 3.0)

    def stress(self, shares: Float) -> Float:
        """Return the nominal stress (s, n) MPa of all rows at shares (s, k)."""
        if not self.tests:
            return np.empty((len(shares), 0))
        values = [free.value(share)[:, None] for free, share in zip(self.free, shares.T, strict=True)]
        return np.broadcast_to(nominal_stress(self.law(values), self._stretches), (len(shares), len(self._stretches)))

    def stable(self, values: Float) -> Tree | None:
        """Return how far the stress of the fitted law rises in each mode, and whether the tests are within.

        The other modes are checked up to the largest stretch of any test.
        """
        if not self.tests:
            return None
        stretch = np.concatenate([[1.0], *(test.stretch for test in self.tests.values())])
        law = self.law(values.tolist())
        to = {mode: rising_to(law, mode) for mode in TESTS}
        measured = {mode: float(stretch.min() if mode == "compression" else stretch.max()) for mode in TESTS}
        unstable = [mode for mode in TESTS if abs(np.log(to[mode])) < abs(np.log(measured[mode]))]
        return {"over_measured_range": not unstable, "unstable": unstable, "rises_to": to, "measured_to": measured}

    def instability(self, values: Float) -> list[str]:
        """Return a remark on the modes in which the fitted law is not stable over the measured range."""
        found = self.stable(values)
        if found is None or found["over_measured_range"]:
            return []
        told = ", ".join(f"{mode} from a stretch of {found['rises_to'][mode]:.3g}" for mode in found["unstable"])
        return [f"the law is unstable within the measured range of stretch: in {told}"]
