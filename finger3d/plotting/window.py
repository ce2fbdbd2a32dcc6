"""Window of `finger3d show`, run in a child process: ``python -m finger3d.plotting.window FOLDER [PICTURE.png]``.

With a PNG file as second argument the window is drawn off-screen; each control is used once, and the final view saved.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from finger3d.plotting.deformed import coloured_halves
from finger3d.plotting.gauges import COLOUR, marks_of
from finger3d.plotting.panels import palette
from finger3d.plotting.renderer import of_vtk, unshared
from finger3d.plotting.show import finger_of, found, mesh_of
from finger3d.plotting.solid import BODY, OBJECT_OPACITY, OBJECT_TINT, skin_of
from finger3d.results.states import States, captions, grid

if TYPE_CHECKING:
    import pyvista as pv

Array = NDArray[np.floating]

FIELDS = {
    "pressure": "contact pressure (MPa)",
    "status": "stick (blue), slip (orange), open (grey)",
    "displacement": "displacement (mm)",
    "shear": "friction (MPa)",
    "stress": "von Mises stress (MPa), last increment only",
}
"""Name of a field among the controls -> its description."""


class Window:
    """Interactive view of a deformed finger, with controls for the step, the field and a clip plane.

    Parameters
    ----------
    folder : results folder of a press
    off_screen : render without a display
    """

    def __init__(self, folder: str, off_screen: bool = False) -> None:
        import pyvista as pv

        self.states, title, gauges = found(folder)
        self.end = grid(folder)
        self.rest = np.array(self.end.points)
        # Contact fields are known at the vertices only: on quadratic cells they would drop to 0 at mid-side nodes.
        kind = pv.CellType.TETRA if self.states.dim == 3 else pv.CellType.TRIANGLE
        self.shown = pv.UnstructuredGrid({kind: self.states.cells[:, : self.states.dim + 1]}, self.rest.copy())
        self.step, self.field = len(self.states.step) - 1, "pressure"
        self.shown["value"] = np.zeros(self.shown.n_points)
        self.plotter = pv.Plotter(off_screen=off_screen, title=f"finger3d: {title}", window_size=[1280, 860])
        self.plotter.set_background("white")
        look = {
            "scalars": "value", "cmap": "viridis", "color": BODY, "scalar_bar_args": {"title": " ", "color": "black"}
        }  # fmt: skip
        if self.states.dim == 3:
            self.plotter.add_mesh_clip_plane(
                self.shown, normal="z", invert=True, origin=self._front(), outline_translation=False, **look
            )
        else:
            self.plotter.add_mesh(self.shown, **look)
        self.mapper = self.plotter.mapper  # of the finger; the attribute of the plotter changes with the next mesh
        self.bar = self.plotter.scalar_bars[" "]
        self.zones = self._add_zones()
        self.thing = pv.PolyData(*self._object())
        if self.thing.n_points:
            self.plotter.add_mesh(self.thing, color=OBJECT_TINT, opacity=OBJECT_OPACITY)
        self.marks = marks_of(mesh_of(self.states), gauges, near=self.states.dim == 3)
        self.lines = [pv.lines_from_points(self.rest[:3]) for _ in self.marks]
        for line in self.lines:
            self.plotter.add_mesh(line, color=COLOUR, line_width=5, lighting=False)
        count, place = len(self.states.step), {"pointa": (0.62, 0.92), "pointb": (0.95, 0.92)}
        slider = {"title": "kept increment", "fmt": "%.0f", "style": "modern", "color": "black"}
        self.plotter.add_slider_widget(
            self.to_step, rng=[1, max(count, 2)], value=count, interaction_event="always", **place, **slider
        )
        for key, name in zip("12345", FIELDS, strict=True):
            self.plotter.add_key_event(key, lambda name=name: self.to_field(name))
        towards = (-0.45, 1.05, 1.0) if self.states.dim == 3 else (0.0, 0.0, 1.0)
        self.plotter.view_vector(towards, viewup=(0.0, 1.0, 0.0))
        self.plotter.reset_camera(bounds=self.shown.bounds)  # the object may be far larger
        self.plotter.add_axes(color="black")
        self.update()

    def _add_zones(self) -> pv.Actor:
        """Draw the zones of stick and slip with their borders, before the finger; return what makes them visible."""
        import pyvista as pv

        points, cells, colours = self._zones()
        self.zone_mesh = pv.PolyData(points, **{"faces" if self.states.dim == 3 else "lines": cells})
        self.zone_mesh.cell_data["zone"] = colours
        actor = self.plotter.add_mesh(self.zone_mesh, scalars="zone", rgb=True, line_width=6)
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(-2.0, -2.0)
        for widget in self.plotter.widgets.plane_widgets:
            plane = pv.generate_plane((0.0, 0.0, -1.0), self._front())

            def follow(widget: Any, _event: str, plane: Any = plane) -> None:
                widget.GetPlane(plane)
                plane.SetNormal(-np.array(plane.GetNormal()))  # a mapper keeps what is on the side of the normal

            widget.AddObserver("EndInteractionEvent", follow)
            actor.mapper.AddClippingPlane(plane)
        return actor

    def _zones(self) -> tuple[Array, NDArray[np.integer], Array]:
        """Return points (v, 3), cells in VTK's format and their RGB colours at the current step."""
        mesh = mesh_of(self.states)
        if self.states.dim == 2:
            parts, _, status = coloured_halves(finger_of(self.states, self.step, mesh))
            parts = np.pad(parts, [(0, 0), (0, 0), (0, 1)])
        else:  # on the corners, as the finger is shown
            mesh = replace(mesh, facets={label: f[:, :3] for label, f in mesh.facets.items()})
            skin = skin_of(finger_of(self.states, self.step, mesh))
            parts, status = skin.contact, skin.status
        points, cells = unshared(parts)
        return points, of_vtk(cells), np.round(255 * palette()[status]).astype(np.uint8)

    def _object(self) -> tuple[Array, NDArray[np.integer]]:
        """Return points (v, 3) and triangles of the object at the current step, the latter in VTK's format."""
        states = self.states
        points = states.object_points @ states.object_rotation[self.step].T + states.object_place[self.step]
        return points, of_vtk(states.object_faces)

    def _front(self) -> tuple[float, float, float]:
        """Return the initial origin of the clip plane, mm, in front of the finger, where it removes nothing."""
        return 0.0, float(self.rest[:, 1].mean()), float(self.rest[:, 2].max()) + 1e-3

    def to_step(self, value: float) -> None:
        """Show a stored step, counted from 1."""
        self.step = min(max(round(value) - 1, 0), len(self.states.step) - 1)
        self.update()

    def to_field(self, name: str) -> None:
        """Show another field."""
        self.field = name
        self.update()

    def update(self) -> None:
        """Apply the displacement and the colours of the current step and field."""
        u = padded(self.states.displacement[self.step])
        self.shown.points = self.rest + u
        self.thing.points = self._object()[0]
        value = values(self.states, self.end, self.field, self.step)
        self.shown["value"] = value
        self.shown.Modified()
        by_zone = self.field == "status"
        if by_zone:
            self.zone_mesh.points, _, self.zone_mesh.cell_data["zone"] = self._zones()
        self.zones.SetVisibility(by_zone)
        self.bar.SetVisibility(not by_zone)
        self.mapper.SetScalarVisibility(not by_zone)
        self._mark(u[:, : self.states.dim])
        highest = float(np.nan_to_num(value).max(initial=0.0)) or 1.0
        self.mapper.scalar_range = (0.0, highest)
        keys = "   ".join(f"{key} {name}" for key, name in zip("12345", FIELDS, strict=True))
        text = f"{captions(self.states)[self.step]}\n{FIELDS[self.field]}\nkeys: {keys}"
        self.plotter.add_text(text, position="upper_left", font_size=10, color="black", name="caption")
        self.plotter.render()

    def _mark(self, u: Array) -> None:
        """Move the lines and the labels of the gauges with the displacement (n, d), mm."""
        for line, mark in zip(self.lines, self.marks, strict=True):
            line.points = padded(mark.of(self.states.points + u))
        if self.marks:
            middles, names = np.array([line.points[1] for line in self.lines]), [mark.label for mark in self.marks]
            look = {"text_color": COLOUR, "font_size": 14, "bold": False, "shape_color": "white", "shape_opacity": 0.8}
            seen = {"show_points": False, "always_visible": True, "reset_camera": False}
            self.plotter.add_point_labels(middles, names, name="gauges", **look, **seen)


def padded(u: Array) -> Array:
    """Append zeros to vectors (n, 2) or (n, 3), so that they have the shape (n, 3)."""
    return np.pad(u, [(0, 0), (0, 3 - u.shape[1])])


def values(states: States, end: pv.UnstructuredGrid, name: str, k: int) -> Array:
    """Return a field at all points, shape (n,).

    Parameters
    ----------
    states : stored steps
    end : fields of the last step
    name : key of `FIELDS`
    k : index of the stored step; the stress is known at the last one only and NaN at the others
    """
    if name == "displacement":
        displacement: Array = np.linalg.norm(states.displacement[k], axis=1)
        return displacement
    if name == "shear":
        parts = [states.on_points(f"shear_{axis}", k) for axis in "xyz"]
        return np.asarray(np.linalg.norm(parts, axis=0))
    if name == "stress":
        if k != len(states.step) - 1:
            return np.full(len(states.points), np.nan)
        xx, yy, zz, xy, yz, xz = np.asarray(end["stress"]).T
        normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
        von_mises: Array = np.sqrt(0.5 * normal + 3.0 * (xy**2 + yz**2 + xz**2))
        return von_mises
    return states.on_points(name, k).astype(float)


def _main(folder: str, picture: str | None = None) -> None:
    window = Window(folder, off_screen=picture is not None)
    if picture is None:
        # If the display cannot be opened, VTK silently renders off-screen.
        if not any(kind in window.plotter.render_window.GetClassName() for kind in ("X", "Win32", "Cocoa", "Wayland")):
            sys.exit("the display cannot be opened")
        window.plotter.show()
        return
    for name in FIELDS:
        window.to_field(name)
    window.to_step(1)
    window.to_field("status")
    window.plotter.screenshot(picture)
    window.plotter.close()


if __name__ == "__main__":
    _main(*sys.argv[1:])
