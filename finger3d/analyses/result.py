"""Result of a press: its numbers, tables, pictures and fields, for a script or a notebook."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Literal

from finger3d._extras import require
from finger3d._types import Tree
from finger3d.accuracy.error_bars import ErrorBars
from finger3d.analyses.press_files import history_table
from finger3d.errors import Finger3dError, Outcome
from finger3d.io import atomic
from finger3d.mechanics.results.history import History, contact_table, measure
from finger3d.results.summary import PressStep, read_rows, steps_of
from finger3d.results.vtu import grid

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


@dataclass(frozen=True, repr=False)
class PressResult:
    """A finished press, also one that stopped at a step that did not converge.

    Attributes
    ----------
    history : the contact state of every increment
    out : folder of the files; a temporary one, removed together with this object, if none was asked for

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

    history: History
    out: Path
    _numbers: Tree
    _folder: TemporaryDirectory[str] | None = field(default=None, compare=False)

    @property
    def outcome(self) -> Outcome:
        """CONVERGED if every increment is."""
        return self.history.outcome

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

        if table == "contact":
            return pandas.DataFrame(self._contact())
        if table == "markers":
            if not (self.out / "markers.csv").exists():
                raise Finger3dError("to_dataframe('markers'): the scene has no [[marker]] and no [marker_grid]")
            rows = pandas.DataFrame(read_rows(self.out / "markers.csv"))
            return rows.astype({name: int if name == "step" else float for name in rows if name != "marker"})
        if table != "history":
            raise Finger3dError(f'to_dataframe({table!r}): must be "history", "contact" or "markers"')
        points, steps = self.history.points, self.history.steps
        return pandas.DataFrame(history_table(steps, [measure(points, step) for step in steps]))

    def derivatives(self, number: str, falling: bool = False) -> dict[str, float]:
        """Return the derivatives of a number at the end of the press by the keys of its scene, per unit of each key.

        They hold as keys grow, or as they fall; both differ where the press ends at a kink.

        Raises
        ------
        Finger3dError
            If the press has no such number, or its numbers have no derivatives.
        """
        from finger3d.analyses.sensitivity import sensitivity  # a press needs none of it
        from finger3d.scene.material import with_moduli_only

        found = sensitivity(with_moduli_only(self._numbers["scene"]), [number])
        return {**found.derivatives[number], **(found.falling.get(number, {}) if falling else {})}

    def plot_contact(self) -> Picture:
        """Draw pressure, friction, its limit and the zones of stick and slip along x in the last good increment."""
        from finger3d.plotting.figures import contact_figure

        points = self.history.points
        half_width = points.half_width_mm if points.dim == 3 else None
        with TemporaryDirectory(prefix="finger3d-") as folder:
            path = Path(folder) / "contact.png"
            mu = (self._numbers["scene"].get("friction") or {}).get("mu", 0.0)
            contact_figure(path, self._contact(), mu, points.band_mm, half_width)
            return Picture(path.read_bytes())

    def to_pyvista(self, step: int | None = None) -> pyvista.UnstructuredGrid:
        """Return the finger at rest with its fields; ``warp_by_vector("displacement")`` deforms it.

        Parameters
        ----------
        step : number of a step that steps.npz holds (from 1); None: the last good one, with strain and stress
        """
        return grid(self.out, step)

    def _contact(self) -> Tree:
        steps = self.history.steps
        if not steps:
            raise Finger3dError(f"{self.out}: no increment was finished, so there is no contact to show")
        last = next((f for f in reversed(steps) if f.outcome.ok), steps[-1])
        return contact_table(self.history.points, last.state)

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
        return f"{self.outcome}, {len(good)} steps{last}"

    def _repr_html_(self) -> str:
        from finger3d._notebook import card
        from finger3d.report.build import number
        from finger3d.report.press import headline

        good, bars = self._good(), ErrorBars.of_summary(self._numbers)
        rows = [
            (row.name, f"{number(row.value, row.error)} {row.unit}".strip())
            for row in (headline(good[-1], bars.totals(), bars.modulus) if good else ())
        ]
        return card(self._title, self._status(), rows, self._numbers["warnings"], self._numbers["advice"])
