"""Plan of a press: which effects are on, the size of the model, and the time and memory it will take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from finger3d._types import Tree, TreeView
from finger3d.accuracy.cost import forecast
from finger3d.geometry.imported import extent
from finger3d.mechanics.discretise.resolution import warnings_before_meshing
from finger3d.mechanics.discretise.symmetry import symmetry
from finger3d.scene import Source, scene_of
from finger3d.scene.material import moduli


@dataclass(frozen=True)
class Plan:
    """Forecast of a press.

    Attributes
    ----------
    title : of the scene
    moduli : Young's modulus of the finger and of its parts in words, with spread and origin
    effects : settings by name of the effects that are on
    forecast : printable values by name: model, size, seconds of each stage, memory
    warnings : unusual values of the scene, and what the mesh will not resolve
    """

    title: str
    moduli: Mapping[str, str]
    effects: Mapping[str, TreeView]
    forecast: TreeView
    warnings: tuple[str, ...]

    @property
    def dofs(self) -> int:
        """Number of unknowns."""
        return int(self.forecast["dofs"])

    @property
    def contact_points(self) -> int:
        """Number of contact points of the meshed part."""
        return int(self.forecast["contact_points"])

    @property
    def total_s(self) -> float:
        """Time of the press, s; the real time is 0.5 to 2.5 times this."""
        return float(self.forecast["total_s"])

    @property
    def memory_MB(self) -> float:
        """Peak memory, MB; the real one is 0.8 to 1.3 times this."""
        return float(self.forecast["memory_MB"])

    def summary(self) -> Tree:
        """Return what `finger3d plan --json` prints."""
        return asdict(self)


def plan(scene: Source, overrides: Sequence[str] = ()) -> Plan:
    """Forecast size, time and memory of a press without solving anything.

    Parameters
    ----------
    scene : path of a TOML file, a dict with its tables, or a loaded scene
    overrides : other keys to set, such as ``"mesh.size_mm=1.0"``

    Returns
    -------
    Plan
        For instance ``plan.dofs``, ``plan.total_s`` and ``plan.memory_MB``.
    """
    scene = scene_of(scene, overrides)
    model = scene.with_effects([*scene.fixed_effects, *scene.open_effects]).model()  # at the most
    expected = forecast(model, bars=True)
    warnings = [*model.warnings, *warnings_before_meshing(model, symmetry(model))]
    expected = {"finger": extent(model.design)} | expected
    tolerance = scene.tables.mesh.tolerance
    if tolerance is not None:
        expected = {"mesh": f"the first of those refined to tolerance = {tolerance:g}"} | expected
    effects = {name: settings for name, settings in scene.as_dict()["effects"].items() if name in scene.effects}
    return Plan(scene.title, moduli(scene.tables), effects, expected, tuple(warnings))
