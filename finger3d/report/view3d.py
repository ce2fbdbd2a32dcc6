"""Interactive 3D view of a page: the deformed surface, drawn in the browser by plotly."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from finger3d._types import Array
from finger3d.contact.zones import facet_borders
from finger3d.fem.mesh import FREE_FACES, Mesh
from finger3d.mechanics.readings import Gauge
from finger3d.plotting.gauges import marks_of
from finger3d.report.html import asset, embedded
from finger3d.results.states import States, chosen, label

_MOST_BYTES = 1_500_000  # of the data of a view; plotly.js has 1.8 MB


@dataclass(frozen=True)
class View3D:
    """Surface of a solid at several increments, reduced to the corners of its facets.

    Attributes
    ----------
    rest : (v, 3) undeformed vertices, mm
    body, contact : (t, 3) triangles of faces that cannot touch, and of those that may; they share no vertices
    moved : (s, v, 3) deformed vertices at each increment, mm
    pressure : (s, v) contact pressure, MPa
    status : (s, v) 0 open, 1 stick, 2 slip
    border : (s, t, 3) where the status changes along the sides of each contact triangle, as a share of their length
    labels : (s,) label of each increment
    gauges : (s, g, 3, 3) start, middle and end of each gauge at each increment, projected onto the front face (+z), mm
    gauge_labels : (g,) label of each gauge
    object_points, object_faces : (o, 3) mm, (f, 3) triangles of the object in its own coordinates
    object_poses : (s, 3, 4) its rotation and place at each increment
    """

    rest: Array
    body: Array
    contact: Array
    moved: Array
    pressure: Array
    status: Array
    border: Array
    labels: tuple[str, ...]
    gauges: Array
    gauge_labels: tuple[str, ...]
    object_points: Array
    object_faces: Array
    object_poses: Array

    def html(self) -> str:
        """Return the HTML element that holds the view and its controls."""
        last = len(self.labels) - 1
        hidden = " hidden" if last == 0 else ""
        none = "" if self.gauge_labels else " hidden"
        no_object = "" if len(self.object_faces) else " hidden"
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
            f"{' Gauges are projected onto the front face.' if self.gauge_labels else ''}"
            "<noscript> The 3D view needs JavaScript; the pictures below show the last increment.</noscript></p></div>"
        )

    def script(self) -> str:
        """Return the scripts with the data and the code that draws them."""
        data = {
            "labels": self.labels,
            "vertices": len(self.rest),
            "rest": _packed(self.rest, "<f4"),
            "moved": _packed(self.moved, "<f4"),
            "pressure": _packed(self.pressure, "<f4"),
            "status": _packed(self.status, "u1"),
            "border": _packed(np.round(255.0 * self.border), "u1"),
            "body": _packed(self.body, "<u4"),
            "contact": _packed(self.contact, "<u4"),
            "gauges": np.round(self.gauges, 3).tolist(),
            "gaugeLabels": self.gauge_labels,
            "objectPoints": _packed(self.object_points, "<f4"),
            "objectFaces": _packed(self.object_faces, "<u4"),
            "objectPoses": np.round(self.object_poses, 6).tolist(),
        }
        numbers = f'<script type="application/json" id="view-data">{embedded(data)}</script>\n'
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

    return View3D(
        rest=rest,
        body=triangles[~states.on_contact],
        contact=triangles[states.on_contact],
        moved=rest + states.displacement[kept][:, corners],
        pressure=np.array([values("pressure", k) for k in kept]),
        status=np.array([values("status", k) for k in kept]),
        border=np.array([borders(k) for k in kept]),
        labels=tuple(label(int(states.step[k]), states.target[k]) for k in kept),
        gauges=np.array(at).reshape(len(kept), len(marks), 3, 3),
        gauge_labels=tuple(mark.label for mark in marks),
        object_points=states.object_points,
        object_faces=states.object_faces,
        object_poses=np.concatenate([states.object_rotation, states.object_place[:, :, None]], axis=2)[kept],
    )


def _packed(values: Array, kind: str) -> str:
    """Return numbers of a NumPy type `kind` in base64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
