"""Result of a press, made just now or opened from its folder: numbers, tables, pictures and fields."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal

from finger3d._extras import require
from finger3d._types import Tree
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.errors import Finger3dError, Outcome
from finger3d.io import atomic
from finger3d.mechanics.history import History
from finger3d.results.states import grid, load_states
from finger3d.results.summary import PressStep, press_summary, read_columns, steps_of
from finger3d.scene import load as load_scene

if TYPE_CHECKING:
    import pandas
    import pyvista


@dataclass(frozen=True)
class Picture:
    """A PNG picture; a notebook shows it, `save` writes it."""

    png: bytes = field(repr=False)

    def _repr_png_(self) -> bytes:
        return self.png

    def save(self, path: str | Path) -> None:
        """Write the picture."""
        with atomic(path) as temporary:
            temporary.write_bytes(self.png)


_TABLES = ("history", "contact", "markers")


def load(path: str | Path, overrides: Iterable[str] = ()) -> Any:
    """Read a scene file, or open the folder of a press.

    Parameters
    ----------
    path : TOML file, or the folder that a press was written into
    overrides : of a scene: texts such as ``friction.mu=0.5``, applied before anything is checked

    Returns
    -------
    Scene or PressResult

    Raises
    ------
    Finger3dError
        With one line: of a scene, it names the file, the key, the value and what is allowed; of a folder, what is
        missing or damaged.

    Examples
    --------
    >>> import finger3d
    >>> finger3d.load("scene.toml", ["friction.mu=0.5"]).tables.friction.mu
    0.5
    >>> _ = finger3d.press("scene.toml", "out")
    >>> finger3d.load("out").plot_forces().save("forces.png")
    """
    if not Path(path).is_dir():
        return load_scene(path, overrides)
    if overrides := list(overrides):
        raise Finger3dError(f"{path}: holds results, and {overrides[0]} changes a scene; load {path}/scene.toml")
    return result_in(Path(path))


def result_in(
    folder: Path, history: History | None = None, temporary: TemporaryDirectory[str] | None = None
) -> PressResult:
    """Open the folder of a press.

    Parameters
    ----------
    history : of a press that was made just now
    temporary : the folder, if it is to be removed with the result

    Raises
    ------
    Finger3dError
        If the folder holds no press, or its tables are damaged.
    """
    numbers = press_summary(folder)
    try:
        steps_of(numbers)
    except TypeError as error:
        why = f"its steps are damaged, or of another version of finger3d ({error})"
        raise Finger3dError(f"{folder / 'summary.json'}: {why}; press {folder}/scene.toml again") from None
    tables = {name: read_columns(folder / f"{name}.csv") for name in _TABLES}
    return PressResult(folder, history, numbers, tables, temporary)


@dataclass(frozen=True, repr=False)
class PressResult:
    """A finished press, also one that stopped at a step that did not converge.

    Attributes
    ----------
    out : folder of the files; a temporary one, removed together with this object, if none was asked for
    history : the contact state of every increment; None if the folder was opened by `load`

    Examples
    --------
    >>> import finger3d
    >>> result = finger3d.press("scene.toml")
    >>> result.outcome.ok
    True
    >>> f"{result.last.normal_force_N:.2f} N"
    '0.81 N'
    >>> result.summary()["steps"][-1]["normal_force_N"] == result.last.normal_force_N
    True
    >>> result.to_dataframe()[["depth_mm", "normal_force_N"]].shape
    (4, 2)
    >>> set(result.to_dataframe("contact")["status"]) <= {"open", "stick", "slip"}
    True
    >>> result.plot_contact().save("contact.png")
    >>> grid = result.to_pyvista()
    >>> grid.warp_by_vector("displacement").bounds.y_max < 5.0
    True
    """

    out: Path
    history: History | None
    _numbers: Tree
    _tables: Mapping[str, Tree]
    _folder: TemporaryDirectory[str] | None = field(default=None, compare=False)

    @property
    def outcome(self) -> Outcome:
        """CONVERGED if every increment is, else the first other outcome."""
        return next((Outcome(s.outcome) for s in self.steps if s.outcome != "converged"), Outcome.CONVERGED)

    @property
    def steps(self) -> tuple[PressStep, ...]:
        """The numbers of every increment."""
        return steps_of(self._numbers)

    @property
    def last(self) -> PressStep:
        """The numbers of the last increment that converged.

        Raises
        ------
        Finger3dError
            If none did.
        """
        good = self._good()
        if not good:
            raise Finger3dError(f"{self.out}: no increment converged: {self._numbers['outcome']}")
        return good[-1]

    def summary(self) -> Tree:
        """Return what summary.json holds: scene, effects, steps, mesh, cost, versions, errors, warnings."""
        return self._numbers

    @property
    def model_error(self) -> dict[str, dict[str, dict[str, float]]]:
        """What each effect that is off would change: effect -> number -> change, low, high; in the number's unit."""
        found: dict[str, dict[str, dict[str, float]]] = self._numbers.get("model_error") or {}
        return found

    def to_dataframe(self, table: Literal["history", "contact", "markers"] = "history") -> pandas.DataFrame:
        """Return a table as a pandas DataFrame.

        Parameters
        ----------
        table : ``"history"``, a row an increment, as in history.csv; or ``"contact"``, a row a contact point in the
            last good increment, as in contact.csv; or ``"markers"``, a row a marker and increment, as in markers.csv
        """
        require("to_dataframe()", "pandas")
        import pandas

        if table not in self._tables:
            raise Finger3dError(f'to_dataframe({table!r}): must be "history", "contact" or "markers"')
        if table == "markers" and not self._tables[table]:
            raise Finger3dError("to_dataframe('markers'): the scene has no [[marker]] and no [marker_grid]")
        return pandas.DataFrame(self._tables[table])

    def plot_contact(self) -> Picture:
        """Draw pressure, friction, its limit and the zones of stick and slip along x in the last good increment."""
        from finger3d.plotting.figures import contact_figure

        mu, table = (self._numbers["scene"].get("friction") or {}).get("mu", 0.0), self._contact()
        if self.history is None:
            half_width = load_states(self.out / "steps.npz").half_width_mm
            return _picture(contact_figure, table, mu, None, half_width or None)
        points = self.history.points
        return _picture(contact_figure, table, mu, points.band_mm, points.half_width_mm if points.dim == 3 else None)

    def plot_forces(self) -> Picture:
        """Draw forces, and half the extents of contact and stick zone, against depth and slides of the object."""
        from finger3d.plotting.figures import force_figure

        self._contact()
        return _picture(force_figure, [step for step in self._numbers["steps"] if step["outcome"] == "converged"])

    def plot_map(self) -> Picture:
        """Draw a flat map of the contact face in the last good increment: pressure, friction, and stick and slip.

        Raises
        ------
        Finger3dError
            If the press is that of a section.
        """
        from finger3d.plotting.figures import map_figure

        table = self._contact()
        if not table["z_mm"].any():
            raise Finger3dError("plot_map(): a section has no map; plot_contact() draws it along x")
        return _picture(map_figure, table)

    def to_pyvista(self, step: int | None = None) -> pyvista.UnstructuredGrid:
        """Return the finger at rest with its fields; ``warp_by_vector("displacement")`` deforms it.

        Parameters
        ----------
        step : number of a step that steps.npz holds (from 1); None: the last good one, with strain and stress
        """
        return grid(self.out, step)

    def _contact(self) -> Tree:
        if not self._tables["contact"]:
            raise Finger3dError(f"{self.out}: no increment was finished, so there is no contact to show")
        return self._tables["contact"]

    def __repr__(self) -> str:
        """One line: title, outcome, force and depth of the last good increment."""
        return f"<PressResult {self._title}: {self._status()}>"

    @property
    def _title(self) -> str:
        from finger3d.results.summary import title_of

        return title_of(self._numbers["scene"])

    def _good(self) -> list[PressStep]:
        return [step for step in self.steps if step.outcome == "converged"]

    def _status(self) -> str:
        good = self._good()
        last = f", {good[-1].normal_force_N:.5g} N at {good[-1].depth_mm:.4g} mm" if good else ""
        return f"{self._numbers['outcome']}, {len(good)} steps{last}"

    def _repr_html_(self) -> str:
        from finger3d._notebook import card
        from finger3d.report.build import number
        from finger3d.report.press import headline

        good, bars = self._good(), ErrorBars.of_summary(self._numbers)
        rows = [
            (row.name, f"{number(row.value, row.error)} {row.unit}".strip())
            for row in (headline(good[-1], bars) if good else ())
        ]
        return card(self._title, self._status(), rows, self._numbers["warnings"], self._numbers["advice"])


def _picture(draw: Callable[..., None], *arguments: object) -> Picture:
    with TemporaryDirectory(prefix="finger3d-") as folder:
        path = Path(folder) / "picture.png"
        try:
            draw(path, *arguments)
        except KeyError as error:
            raise Finger3dError(f"the results have no column {error} for a picture; press the scene again") from None
        return Picture(path.read_bytes())
