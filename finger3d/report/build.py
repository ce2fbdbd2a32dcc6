"""Self-contained HTML page with rows, tables, text, pictures, charts and a 3D view. All text is escaped."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path

import numpy as np

from finger3d._machine import versions as installed
from finger3d._types import Array, TreeView
from finger3d.accuracy.error_bars import with_error
from finger3d.contact.zones import facet_borders
from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.io import atomic
from finger3d.mechanics.readings import Gauge
from finger3d.plotting.gauges import marks_of
from finger3d.results.states import States, chosen, label


def asset(name: str) -> str:
    """Return the text of a file of this package."""
    return resources.files("finger3d.report").joinpath(name).read_text(encoding="utf-8")


def embedded(data: object) -> str:
    """Return JSON for a script element, with "<" escaped, which could end the element or begin a comment."""
    return json.dumps(data).replace("<", "\\u003c")


@dataclass(frozen=True)
class Line:
    """Line through points with coordinates x and y, shape (n,); NaN leaves a gap."""

    label: str
    x: Sequence[float]
    y: Sequence[float]


@dataclass(frozen=True)
class Chart:
    """Chart of lines in common axes.

    Attributes
    ----------
    caption : caption of the chart
    x, y : titles of the axes, with units
    lines : at least one line; labels are shown if there are several
    legend : title of the legend: the quantity whose values the labels are
    more : number of omitted lines
    joined : whether the points of a line are joined
    """

    caption: str
    x: str
    y: str
    lines: Sequence[Line]
    legend: str = ""
    more: int = 0
    joined: bool = True

    def html(self) -> str:
        """Return the HTML element that holds the chart."""
        text = escape(self.caption, quote=True)
        left_out = f"; {self.more} more lines are left out" if self.more else ""
        return (
            f'<figure class="chart"><div role="img" aria-label="{text}"></div>'
            f"<noscript>Curves need JavaScript; their numbers are in the tables.</noscript>"
            f"<figcaption>{text}{left_out}</figcaption></figure>"
        )


def script(charts: Sequence[Chart]) -> str:
    """Return the scripts with the data of all charts of a page and the code that draws them."""
    data = []
    for chart in charts:
        lines = [{"label": line.label, "x": _known(line.x), "y": _known(line.y)} for line in chart.lines]
        data.append({**vars(chart), "lines": lines})
    numbers = f'<script type="application/json" id="chart-data">{embedded(data)}</script>\n'
    return f"{numbers}<script>{asset('chart.js')}</script>\n"


def _known(values: Sequence[float]) -> list[float | None]:
    """Replace NaN and infinity, which JSON lacks, by None."""
    return [value if math.isfinite(value) else None for value in values]


_TABLES = ("finger", "material", "object", "friction", "press", "grip", "contact", "model", "mesh")


def how_modelled(summary: TreeView, folder: Path) -> list[Part]:
    """Return the scene as a table, with the active effects, and the text of scene.toml.

    Parameters
    ----------
    summary : JSON object with the key ``scene``
    folder : results folder
    """
    scene = summary["scene"]
    rows = [(name, _settings(scene[name])) for name in _TABLES if scene.get(name)]
    rows += _modulus("", scene.get("material", {}))
    for part, settings in scene.get("parts", {}).items():
        rows += [(f"part {part}", _settings(settings)), *_modulus(f" of {part}", settings)]
    for gauge in scene.get("gauge", ()):
        rows.append((f"gauge {gauge['name']}", _settings({k: v for k, v in gauge.items() if k != "name"})))
    effects = {name: table for name, table in scene.get("effects", {}).items() if isinstance(table, Mapping)}
    rows += [(f"effect {name}", _settings(settings) or "on") for name, settings in effects.items()]
    parts: list[Part] = [Table(("", "settings, with defaults"), rows)]
    if not effects:
        parts.append(
            "No effect beyond the baseline: small strain, linear elasticity, a rigid object, Coulomb friction."
        )
    file = folder / "scene.toml"
    if file.exists():
        parts.append(Code(file.read_text(encoding="utf-8"), "scene.toml"))
    return parts


def _modulus(of: str, table: TreeView) -> list[tuple[str, str]]:
    """Return the row of a Young's modulus that follows from a hardness or a silicone, with its spread and origin."""
    E, spread, origin = (table.get(key) for key in ("E_MPa", "E_spread", "E_origin"))
    if spread is None or not origin:
        return []
    return [(f"Young's modulus{of}", f"{E:.3g} MPa \u00b1 {100.0 * spread:.0f} %: {origin}")]


def _settings(settings: object) -> str:
    """Return a table of a scene in one line."""
    if not isinstance(settings, Mapping):
        return str(settings)
    # the spread and the origin of a modulus have a row of their own
    told = {k: v for k, v in settings.items() if v is not None and k not in ("E_spread", "E_origin")}
    return ", ".join(f"{k} = {_value(v)}" for k, v in told.items())


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        return f"({_settings(value)})"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


# Content security policy: only scripts, styles and pictures inside the page; no network access.
_POLICY = "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"

# Collapsed sections are expanded for printing.
_UNFOLD = (
    'addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));'
)

CITE = (
    "The finger3d authors. finger3d: frictional contact of an elastic finger-shaped tactile sensor in three dimensions"
)

PAPER = (
    "Takashi Maeno, Tomoyuki Kawamura, Sen-Chieh Cheng. Friction Estimation by Pressing an Elastic Finger-Shaped "
    "Sensor Against a Surface. IEEE Transactions on Robotics and Automation 20(2), 2004"
)
"""Citations of the program and of the paper that it follows, as in CITATION.cff."""

_MOST_UNBROKEN = 18  # characters of a table cell that is not broken into lines


@dataclass(frozen=True)
class HeadlineRow:
    """Main result of a page: its name, its value (a number or text), its unit, and its error in that unit or None."""

    name: str
    value: float | str
    unit: str = ""
    error: float | None = None

    @property
    def text(self) -> str:
        """Value, error and unit, as a terminal shows them."""
        return f"{number(self.value, self.error)} {self.unit}".rstrip().replace("±", "+-").replace("²", "2")


@dataclass(frozen=True)
class Table:
    """Table; numbers have five significant digits and are aligned to the right."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]


@dataclass(frozen=True)
class Figure:
    """PNG file, relative to the folder of the page; omitted if it does not exist."""

    path: str | Path
    caption: str = ""


@dataclass(frozen=True)
class Code:
    """Preformatted text; with a `summary`, collapsed below it."""

    text: str
    summary: str = ""


Part = str | Table | Figure | Code


@dataclass(frozen=True)
class PageSection:
    """Heading followed by paragraphs, tables, pictures and code; collapsed if `folded`."""

    title: str
    parts: Sequence[Part]
    folded: bool = False


@dataclass(frozen=True)
class Page:
    """Page of a result; versions and citations follow the sections.

    Attributes
    ----------
    title : title of the page
    headline : main results
    sections : sections of the page, in order
    figures : pictures below the headline
    view : interactive 3D view
    charts : interactive charts
    command : command that made the results, for instance ``press``
    outcome : outcome of the command, in one line
    good : whether the command succeeded
    notes : warnings and advice, shown below the headline
    versions : package -> version used for the results; default: the installed versions
    """

    title: str
    headline: Sequence[HeadlineRow] = ()
    sections: Sequence[PageSection] = ()
    figures: Sequence[Figure] = ()
    view: View3D | None = None
    charts: Sequence[Chart] = ()
    command: str = ""
    outcome: str = "converged"
    good: bool = True
    notes: Sequence[str] = ()
    versions: Mapping[str, str] | None = None

    def write(self, folder: str | Path, file: str = "report.html") -> Path:
        """Write the page atomically into the folder that has its figures, and return its path.

        Raises
        ------
        Finger3dError
            If the page cannot be written.
        """
        target = Path(folder) / file
        before, after = _document(self.title, self._body(target.parent))
        scripts = [self.view.script()] if self.view is not None else []
        if self.charts:
            scripts.append(script(self.charts))
        with atomic(target) as temporary, temporary.open("wb") as stream:
            stream.write(before.encode())
            if scripts:
                # "</script" would end the element
                plotly = asset("plotly/plotly-gl3d.min.js").encode().replace(b"</script", b"<\\/script")
                stream.write(b"<script>" + plotly + b"</script>\n")
            stream.write("".join([*scripts, after]).encode())
        return target

    def _body(self, folder: Path) -> str:
        """Return the HTML of all that is seen."""
        body = [
            f'<header><p class="kicker">finger3d {escape(self.command)}</p><h1>{escape(self.title)}</h1>'
            f'<p class="{"good" if self.good else "bad"}">{escape(self.outcome)}</p></header>'
        ]
        if self.headline:
            body.append(f'<dl class="headline">{"".join(map(_card, self.headline))}</dl>')
        if self.notes:
            body.append(f'<ul class="notes">{"".join(f"<li>{escape(note)}</li>" for note in self.notes)}</ul>')
        if self.view is not None:
            body.append(self.view.html())
        body += [_figures(folder, self.figures), _grid(chart.html() for chart in self.charts)]
        found = installed() if self.versions is None else self.versions
        closing = [
            PageSection("Versions", [", ".join(f"{k} {v}" for k, v in found.items())]),
            PageSection("How to cite", [f"{CITE}, version {found.get('finger3d', 'unknown')}.", f"{PAPER}."]),
        ]
        return "\n".join([*body, *(_section(folder, section) for section in (*self.sections, *closing))])


def number(value: object, error: float | None = None) -> str:
    """Return a number with its error, or with five significant digits; other values as text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return with_error(value, error)


def _card(row: HeadlineRow) -> str:
    unit = f' <span class="unit">{escape(row.unit)}</span>' if row.unit else ""
    return f"<div><dt>{escape(row.name)}</dt><dd>{escape(number(row.value, row.error))}{unit}</dd></div>"


def _section(folder: Path, section: PageSection) -> str:
    inside = "".join(_part(folder, part) for part in section.parts)
    title = f"<h2>{escape(section.title)}</h2>"
    if section.folded:
        return f"<section><details><summary>{title}</summary>{inside}</details></section>"
    return f"<section>{title}{inside}</section>"


def _part(folder: Path, part: Part) -> str:
    if isinstance(part, Table):
        return _table(part)
    if isinstance(part, Figure):
        return _figures(folder, [part])
    if isinstance(part, Code):
        code = f"<pre>{escape(part.text)}</pre>"
        return f"<details><summary>{escape(part.summary)}</summary>{code}</details>" if part.summary else code
    return f"<p>{escape(part)}</p>"


def _table(table: Table) -> str:
    # Column names may break after an underscore.
    head = "".join(f'<th scope="col">{escape(name).replace("_", "_<wbr>")}</th>' for name in table.head)
    rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in table.rows)
    # A wide table scrolls in its own box, which has a tab index for keyboard users.
    return f'<div class="wide" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _cell(value: object) -> str:
    text = number(value)
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    kind = "number" if numeric else "short" if len(text) <= _MOST_UNBROKEN else ""
    return f'<td class="{kind}">{escape(text)}</td>' if kind else f"<td>{escape(text)}</td>"


def _figures(folder: Path, figures: Sequence[Figure]) -> str:
    """Return existing pictures in a grid."""
    return _grid(_figure(folder / figure.path, figure.caption) for figure in figures)


def _grid(figures: Iterable[str]) -> str:
    shown = "".join(figures)
    return f'<div class="figures">{shown}</div>' if shown else ""


def _figure(path: Path, caption: str) -> str:
    """Return a figure element with the embedded picture, which scrolls in its own box on a narrow screen."""
    if not path.exists():
        return ""
    data, text = base64.b64encode(path.read_bytes()).decode("ascii"), escape(caption, quote=True)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return (
        f'<figure class="picture"><div class="wide" tabindex="0">{image}</div><figcaption>{text}</figcaption></figure>'
    )


def _document(title: str, body: str) -> tuple[str, str]:
    """Return the HTML before and after the scripts of view and charts."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n<link rel="icon" href="data:,">\n'
        f"<title>{escape(title)} - finger3d</title>\n<style>\n{asset('style.css')}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n<script>{_UNFOLD}</script>\n"
    ), "</body>\n</html>\n"


_MOST_BYTES = 1_500_000  # of the data of a view; plotly.js has 1.8 MB


@dataclass(frozen=True)
class View3D:
    """Surface of a solid at several increments, reduced to the corners of its facets.

    Attributes
    ----------
    data : what view3d.js draws; arrays in base64
        labels : (s,) label of each increment
        vertices : number v of vertices
        rest : (v, 3) undeformed vertices, mm
        moved : (s, v, 3) deformed vertices at each increment, mm
        pressure : (s, v) contact pressure, MPa
        status : (s, v) 0 open, 1 stick, 2 slip
        border : (s, t, 3) where the status changes along the sides of each contact triangle, in 255ths of their length
        body, contact : (t, 3) triangles of faces that cannot touch, and of those that may; they share no vertices
        gauges : (s, g, 3, 3) start, middle and end of each gauge, projected onto the front face (+z), mm
        gaugeLabels : (g,) label of each gauge
        objectPoints, objectFaces : (o, 3) mm, (f, 3) triangles of the object in its own coordinates
        objectPoses : (s, 3, 4) its rotation and place at each increment
    """

    data: TreeView

    def html(self) -> str:
        """Return the HTML element that holds the view and its controls."""
        last = len(self.data["labels"]) - 1
        hidden = " hidden" if last == 0 else ""
        none = "" if self.data["gaugeLabels"] else " hidden"
        no_object = "" if self.data["objectFaces"] else " hidden"
        return (
            '<div class="view"><div class="controls">'
            '<label>colour <select id="view-field"><option value="pressure">contact pressure</option>'
            '<option value="status">stick and slip</option><option value="moved">displacement</option></select></label>'
            f'<label{hidden}>increment <input id="view-step" type="range" min="0" max="{last}" value="{last}"></label>'
            f'<label{none}><input id="view-gauges" type="checkbox"{"" if none else " checked"}>gauges</label>'
            f'<label{no_object}><input id="view-object" type="checkbox"{"" if no_object else " checked"}>object</label>'
            '<output id="view-label"></output>'
            '<span class="key"><span class="zone"><i style="background:#1f3f77"></i>stick</span>'
            '<span class="zone"><i style="background:#f28e2b"></i>slip</span>'
            '<span class="open"><i style="background:#c4c4c4"></i>open, no contact</span></span>'
            '</div><div class="stage" id="view-stage"></div>'
            "<p>Deformed, to scale. Drag to rotate, scroll or pinch to zoom; hover over the contact surface for values."
            f"{' Gauges are projected onto the front face.' if self.data['gaugeLabels'] else ''}"
            "<noscript> The 3D view needs JavaScript; the pictures below show the last increment.</noscript></p></div>"
        )

    def script(self) -> str:
        """Return the scripts with the data and the code that draws them."""
        numbers = f'<script type="application/json" id="view-data">{embedded(self.data)}</script>\n'
        return f"{numbers}<script>{asset('view3d.js')}</script>\n"


def view_of(states: States, gauges: Sequence[Gauge] = (), budget: int = _MOST_BYTES) -> View3D | None:
    """Return a view of a solid with as many increments as `budget`, in bytes, allows; None if none fits, or for 2D."""
    if states.dim != 3:
        return None
    # a vertex on a crease has a pressure on each face
    faces = np.where(states.on_contact, states.facet_face.astype(int), -1)
    key = states.corners.astype(np.int64) * (len(FREE_FACES) + 1) + (faces + 1)[:, None]
    keys, index = np.unique(key, return_inverse=True)
    corners, face_of = keys // (len(FREE_FACES) + 1), keys % (len(FREE_FACES) + 1) - 1
    triangles = index.reshape(states.corners.shape)
    budget -= (states.object_points.size + states.object_faces.size) * 16 // 3
    each = (len(corners) * (3 * 4 + 4 + 1) + states.contact_facets.size) * 4 // 3
    most = (budget - triangles.size * 16 // 3) // each
    if most < 1:
        return None
    kept = chosen(len(states.step), most)
    rest = states.points[corners]
    marks = marks_of(Mesh(states.points.astype(float), states.cells, {}), gauges, near=True)
    at = [[mark.of(states.points + states.displacement[k]) for mark in marks] for k in kept]

    def values(name: str, k: int) -> Array:
        out = np.zeros(len(corners))
        for face in np.unique(faces[faces >= 0]):
            own = face_of == face
            out[own] = states.on_points(name, k, int(face))[corners[own]]
        return out

    places = states.points[states.nodes].astype(float)

    def borders(k: int) -> Array:
        return facet_borders(states.contact_facets, states.status[k], states.zones(k), places)

    poses = np.concatenate([states.object_rotation, states.object_place[:, :, None]], axis=2)[kept]
    return View3D(
        {
            "labels": [label(int(states.step[k]), states.target[k]) for k in kept],
            "vertices": len(rest),
            "rest": _packed(rest, "<f4"),
            "moved": _packed(rest + states.displacement[kept][:, corners], "<f4"),
            "pressure": _packed(np.array([values("pressure", k) for k in kept]), "<f4"),
            "status": _packed(np.array([values("status", k) for k in kept]), "u1"),
            "border": _packed(np.round(255.0 * np.array([borders(k) for k in kept])), "u1"),
            "body": _packed(triangles[~states.on_contact], "<u4"),
            "contact": _packed(triangles[states.on_contact], "<u4"),
            "gauges": np.round(np.array(at).reshape(len(kept), len(marks), 3, 3), 3).tolist(),
            "gaugeLabels": [mark.label for mark in marks],
            "objectPoints": _packed(states.object_points, "<f4"),
            "objectFaces": _packed(states.object_faces, "<u4"),
            "objectPoses": np.round(poses, 6).tolist(),
        }
    )


def _packed(values: Array, kind: str) -> str:
    """Return numbers of a NumPy type `kind` in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
