"""Studies of validation/: finding, running and storing them, and the index of their results.

A study is a file validation/<name>.py.  Its docstring states a question and the source of the reference, and its
function ``run(quick) -> Result`` answers it.  Results are stored in validation/results/; README.md is made from them.
"""

from __future__ import annotations

import ast
import csv
import hashlib
import json
import re
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

import finger3d
from finger3d._machine import versions
from finger3d._types import Tree, TreeView
from finger3d.errors import Finger3dError
from finger3d.geometry.design import import_from
from finger3d.io import atomic, write_csv, write_json
from finger3d.progress import Progress

from . import _verdict
from ._rows import COLUMNS, Result, Row, Settled, given, score

NO_NUMBERS = ("cli/*", "plotting/*", "report/*", "__main__.py", "_notebook.py", "progress.py", "py.typed")
"""Files of the package that only draw, write pages, report progress or parse commands. A change of any other one makes
the results of all studies out of date."""

_LIBRARIES = ("numpy", "scipy", "pypardiso", "mkl", "build123d", "cadquery-ocp-novtk", "pytetwild", "trimesh")
"""Packages that shape numbers."""


@dataclass(frozen=True)
class Study:
    """A study by its file, not yet imported."""

    name: str
    path: Path

    @property
    def question(self) -> str:
        """First paragraph of the file's docstring, on one line."""
        text = ast.get_docstring(ast.parse(self.path.read_text(encoding="utf-8"))) or ""
        return " ".join(text.split("\n\n")[0].split())

    @property
    def by_name(self) -> bool:
        """Whether a full run must name the study: one that times this machine states ``BY_NAME = True``."""
        return bool(re.search(r"^BY_NAME = True$", self.path.read_text(encoding="utf-8"), flags=re.MULTILINE))

    def run(self, quick: bool) -> Result:
        """Import the file and answer its question."""
        result: Result = import_from(self.path.parent, "finger3d_validation", self.name).run(quick)
        return result

    def stamp(self) -> str:
        """Return a hash of all that shapes the study's numbers: sources, data files, and versions of the libraries.

        Comments and docstrings do not count.
        """
        package = Path(finger3d.__file__).parent
        digest = hashlib.sha256()
        for path in [*sources(package), *_scenes(package), *_with_helpers(self.path)]:
            digest.update(_content(path))
        installed = versions()
        digest.update(repr([(name, installed.get(name)) for name in _LIBRARIES]).encode())
        return digest.hexdigest()[:16]


def _content(path: Path) -> bytes:
    """Return what a file contributes to a stamp."""
    return _without_docstrings(path.read_bytes()) if path.suffix == ".py" else path.read_bytes()


@cache
def _without_docstrings(source: bytes) -> bytes:
    """Return the syntax tree of a Python source, which has no comments, without its docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [statement for statement in node.body if not _is_docstring(statement)]
    return ast.dump(tree).encode()


def _is_docstring(statement: ast.stmt) -> bool:
    if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
        return False
    return isinstance(statement.value.value, str)


def sources(package: Path) -> list[Path]:
    """Return the files of a package that can change a study's numbers: all but those that only draw or report."""

    def counts(path: Path) -> bool:
        name = path.relative_to(package).as_posix()
        return not any(fnmatchcase(name, pattern) for pattern in NO_NUMBERS)

    files = (path for path in sorted(package.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)
    return [path for path in files if counts(path) and "geometries" not in path.parts]


def _scenes(package: Path) -> list[Path]:
    """Designs, scenes and triangulated objects of the folder geometries/, in a checkout or an installed package."""
    found = (path for folder in (package, package.parent) for path in sorted((folder / "geometries").rglob("*")))
    return [path for path in found if path.is_file() and "__pycache__" not in path.parts]


def _with_helpers(path: Path) -> list[Path]:
    """A study's file, those beside it that it imports, and those that these import; and their data."""
    found = [path]
    for file in found:
        imports = re.findall(r"^from \.(\w*) import (.*)", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
        names = [name for module, what in imports for name in ([module] if module else what.split(", "))]
        found += [p for n in names if (p := path.with_name(f"{n}.py")) not in found and p.is_file()]
    return found + [data for file in found for end in (".toml", ".csv") if (data := file.with_suffix(end)).is_file()]


def studies(folder: Path | None = None) -> dict[str, Study]:
    """Return the studies by name; those beside this file unless another folder is given."""
    where = folder or Path(__file__).resolve().parent
    return {p.stem: Study(p.stem, p) for p in sorted(where.glob("[a-z]*.py"))}


def chosen(names: Sequence[str], known: Mapping[str, Study], quick: bool = False) -> list[Study]:
    """Return the studies of these names; without names all studies, in full runs without those that run only by name.

    Raises
    ------
    Finger3dError
        For a name that is unknown, with the nearest one.
    """
    from difflib import get_close_matches

    for name in names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.0)
            raise Finger3dError(f"no study {name!r}; did you mean {near[0]!r}? known: {', '.join(known)}")
    if not names:
        return [study for study in known.values() if quick or not study.by_name]
    return [known[name] for name in dict.fromkeys(names)]


def results_folder(known: Mapping[str, Study], quick: bool, out: str | Path | None) -> Path:
    """Return the folder of the results; a new temporary one for quick results if none is given."""
    home = next(iter(known.values())).path.parent
    if quick and out is not None and Path(out).resolve() == home:
        raise Finger3dError(f"--out {out}: quick results would overwrite the full ones there; name another folder")
    if out is not None:
        return Path(out)
    return Path(tempfile.mkdtemp(prefix="finger3d-validate-")) if quick else home


def run_studies(
    selected: Sequence[Study],
    quick: bool,
    out: Path,
    report: Progress | None = None,
    resume: bool = False,
    known: Mapping[str, Study] | None = None,
) -> dict[str, tuple[Row, ...]]:
    """Run studies and keep their results as they come.

    Parameters
    ----------
    quick : small meshes and few steps
    out : folder for results/ and figures/; with `known` given also for README.md, the index of all results there
    report : receives the progress
    resume : leave out studies whose results in `out` were made by the sources as they are now

    Returns
    -------
    dict
        Rows by study, of those that ran and those left out.
    """
    report = report or Progress()
    found: dict[str, tuple[Row, ...]] = {}
    for done, study in enumerate(selected, start=1):
        stamp = study.stamp()
        kept = _about(out, study).get("stamp") if resume else None
        if kept == stamp:
            found[study.name] = kept_rows(out, study)
            remark = "up to date"
        else:
            report.stage(study.name)
            start = time.perf_counter()
            result = study.run(quick)
            found[study.name] = result.rows
            _keep(out, study, result, stamp, time.perf_counter() - start)
            failed = sum(not row.passed for row in result.rows)
            remark = f"{len(result.rows) - failed} of {len(result.rows)} rows pass, {time.perf_counter() - start:.1f} s"
        if known is not None:
            write_index(out, known)
        report.step(done, len(selected), f"{study.name}: {remark}")
    return found


def _keep(out: Path, study: Study, result: Result, stamp: str, seconds: float) -> None:
    """Write the files of one study; the stamp last, so that an interruption between files leaves the study undone."""
    results, about = out / "results", _place(out, study)
    about.unlink(missing_ok=True)
    rows = [row.columns() for row in result.rows]
    write_csv(results / f"{study.name}.csv", {k: [r[k] for r in rows] for k in COLUMNS})
    for name, part in (result.parts or {study.name: result}).items():
        if part.table is not None:
            write_csv(results / f"{name}_table.csv", part.table)
        if part.figure is not None:
            draw(part.figure, out / "figures" / f"{name}.png")
    more: Tree = {"settled": list(result.settled)} if result.settled else {}
    more |= {"parts": list(result.parts)} if result.parts else {}
    write_json(about, {"question": study.question, "seconds": round(seconds, 1), "stamp": stamp, **more})


def draw(figure: Callable[[Any], None], path: Path) -> None:
    """Let a study draw on a fresh Figure, add what all figures have, and save it without a display."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({"axes.titlesize": 10.0, "legend.fontsize": 8.0}):
        canvas = FigureCanvasAgg(Figure(figsize=(10.0, 4.5), layout="constrained", dpi=110))
        figure(canvas.figure)
        _finish(canvas.figure)
        with atomic(path) as temporary:
            canvas.figure.savefig(temporary)


def _finish(figure: Any) -> None:
    """Add a grid under curves, and legends to a figure, or a part of one, that has none."""
    for part in figure.subfigs or (figure,):
        has_legend = part.legends or any(axes.get_legend() for axes in part.axes)
        for axes in part.axes:
            if axes.lines and not axes.images and all(drawn.get_array() is None for drawn in axes.collections):
                axes.grid(alpha=0.3)
            if not has_legend and axes.get_legend_handles_labels()[0]:
                axes.legend()


def _place(out: Path, study: Study) -> Path:
    return out / "results" / f"{study.name}.json"


def _about(out: Path, study: Study) -> Tree:
    try:
        return dict(json.loads(_place(out, study).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def kept_rows(out: Path, study: Study) -> tuple[Row, ...]:
    """Rows of a study as they were kept; none if it has not run."""
    path = out / "results" / f"{study.name}.csv"
    if not path.is_file():
        return ()
    with path.open(newline="", encoding="utf-8") as stream:
        return tuple(map(_row, csv.DictReader(stream)))


def kept_parts(out: Path, study: Study) -> list[str]:
    """Return the names of the parts of a study, those of its tables and figures; its own name if it has no parts."""
    return list(_about(out, study).get("parts", [study.name]))


def kept_settled(out: Path, study: Study) -> Settled | None:
    """Return the increments that a study counted, as they were kept; None if it counts none or has not run."""
    counts = _about(out, study).get("settled")
    return Settled(*counts) if counts else None


def _row(kept: TreeView) -> Row:
    wanted, got, tolerance = (float(kept[k]) for k in ("wanted", "got", "tolerance"))
    return Row(kept["what"], kept["reference"], wanted, got, tolerance, kept["reason"], kept["kind"], kept["measure"])


def write_index(out: Path, known: Mapping[str, Study]) -> None:
    """Write README.md from the results that are kept in `out`."""
    kept = {name: kept_rows(out, study) for name, study in known.items()}
    texts = given(__file__)
    lines = [texts["title"], *_verdict.lines(kept, "figures"), "", _verdict.summary(kept), texts["head"]]
    seconds = sum(_about(out, study).get("seconds", 0.0) for study in known.values() if not study.by_name)
    timed = [name for name, study in known.items() if study.by_name]
    total = score([row for rows in kept.values() for row in rows])
    missing = [name for name, rows in kept.items() if not rows]
    lines.append(f"{total}; {len(kept) - len(missing)} studies, {seconds / 60.0:.1f} minutes.")
    if timed:
        lines.append(f"Not in these minutes, as they time the machine and run only by name: {', '.join(timed)}.")
    if missing:
        lines.append(f"Not run yet: {', '.join(missing)}.")
    lines += ["", "| study | question | found | seconds |", "|---|---|---|---|"]
    for name, rows in kept.items():
        if rows:
            about = _about(out, known[name])
            links = f"[{name}]({name}.py), [rows](results/{name}.csv)"
            for part in kept_parts(out, known[name]):
                of = "" if part == name else f" {part}"
                for what, file in (("figure", f"figures/{part}.png"), ("table", f"results/{part}_table.csv")):
                    links += f", [{what}{of}]({file})" if (out / file).is_file() else ""
            found = score(rows) + ("" if all(row.passed for row in rows) else ", **FAIL**")
            question = known[name].question.replace("|", "\\|")
            lines.append(f"| {links} | {question} | {found} | {about.get('seconds', '')} |")
    with atomic(out / "README.md") as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
