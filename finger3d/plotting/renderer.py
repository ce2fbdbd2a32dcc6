"""Renderer of surfaces, lines and arrows, and the camera of the pictures of a solid.

PyVista renders them. VTK aborts its process if no OpenGL driver works; therefore ``python -m
finger3d.plotting.renderer IN OUT`` renders in a child process. Where that fails, or PyVista is not installed,
matplotlib paints the same parts from back to front. The camera is an oblique parallel projection; the rendered window
is cropped to what it shows.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from finger3d._extras import available
from finger3d._machine import child_environment
from finger3d._types import Float, Int
from finger3d.plotting.layout import DPI, blank

if TYPE_CHECKING:
    import pyvista as pv
    from matplotlib.axes import Axes


WINDOW = (1600, 1200)
"""Width and height of the window that PyVista renders, in pixels."""

_VIEW = np.array([-0.45, 1.05, 1.0])  # direction towards the viewer: in front, above, slightly left
_LIGHT = np.array([-0.2, 0.9, 0.5])  # direction to it
_MARGIN = 1.04  # height of the window over that of its contents
_WHITE = 250  # least grey level of the background, of 255


def viewer_axes(direction: Float) -> Float:
    """Return the axes of a viewer in a direction (3,) from the scene: rows (3, 3) right, up, and towards the viewer."""
    towards = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 1.0, 0.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


AXES = viewer_axes(_VIEW)
"""Orthonormal axes of the viewer, rows (3, 3): right, up, and towards the viewer."""


def flat(points: Float) -> Float:
    """Project points, shape (..., 3), onto the picture plane, shape (..., 2), mm."""
    return points @ AXES[:2].T


def shaded(faces: Float, colours: ArrayLike, towards: Float) -> tuple[Float, Float]:
    """Return the polygons, of (m, k, 3), that face the viewer in a direction (3,), and their shaded RGB colours.

    The light is above the viewer.
    """
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    seen = normal @ towards > 0.0
    brightness = 0.62 + 0.38 * np.clip(normal[seen] @ (_LIGHT / np.linalg.norm(_LIGHT)), 0.0, 1.0)
    every = np.broadcast_to(colours, (len(faces), 3))
    return faces[seen], np.clip(every[seen] * brightness[:, None], 0.0, 1.0)


def half_height(size: Float) -> float:
    """Return half the height of a window, in mm, that holds the given width and height (2,), in mm."""
    return float(0.5 * _MARGIN * max(size[1], size[0] * WINDOW[1] / WINDOW[0]))


def framed(
    images: NDArray[np.uint8], frame: tuple[Float, Float]
) -> tuple[NDArray[np.uint8], tuple[float, float, float, float]]:
    """Crop the common white margins of images.

    Parameters
    ----------
    images : (s, h, w, 3) array
        Images of one window.
    frame : tuple of (3,) and (2,) array, mm
        Centre of the window, and the width and height that it holds.

    Returns
    -------
    images : (s, h', w', 3) array
        Cropped images.
    extent : tuple of four floats, mm
        Left, right, lower and upper edge of the cropped images in the picture plane of `flat`.
    """
    inked = np.min(images, axis=(0, 3)) < _WHITE
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    top, left = int(rows[0]), int(columns[0])
    kept = images[:, top : rows[-1] + 1, left : columns[-1] + 1]
    middle, size = frame
    pixel = 2.0 * half_height(size) / images.shape[1]
    x, y = flat(middle) + pixel * np.array([left - 0.5 * images.shape[2], 0.5 * images.shape[1] - top])
    return kept, (x, x + pixel * kept.shape[2], y - pixel * kept.shape[1], y)


Image = NDArray[np.uint8]
"""Rendered window, shape (h, w, 3)."""

_TIME_LIMIT_S = 180.0  # of a child process that renders
_SHINE = {"ambient": 0.25, "diffuse": 0.8, "specular": 0.1}
_SHARP_ANGLE = 40.0  # between the normals of two triangles whose common edge is not shaded as round, in degrees
_FEATURE_ANGLE = 25.0  # between the normals of two triangles with a visible edge between them, in degrees


@dataclass(frozen=True)
class Camera:
    """Parallel projection.

    Attributes
    ----------
    axes : (3, 3) array
        Orthonormal axes of the viewer, rows: right, up, and towards the viewer.
    middle : (3,) array, mm
        Centre of the window.
    half_height : float, mm
        Half the height of the window.
    window : width and height of the window, in pixels
    """

    axes: Float
    middle: Float
    half_height: float
    window: tuple[int, int]

    def flat(self, points: Float) -> Float:
        """Project points, shape (..., 3), onto the picture plane, shape (..., 2), mm from the centre."""
        return (points - self.middle) @ self.axes[:2].T


@dataclass(frozen=True)
class Polygons:
    """Shaded polygons.

    Attributes
    ----------
    points : (p, 3) array, mm
    cells : (m, k) array
        Indices of the corners.
    colour : one colour, or (p, 3) RGB colours of the points
    opacity : from 0 to 1
    feature_edges : whether to draw the sharp edges
    """

    points: Float
    cells: Int
    colour: str | Image
    opacity: float = 1.0
    feature_edges: bool = False

    def add(self, plotter: pv.Plotter) -> None:
        """Add the polygons to a plotter."""
        import pyvista as pv

        corners, cells = unshared(self.points[self.cells])
        mesh = pv.PolyData(corners, of_vtk(cells))
        whole = mesh.clean(tolerance=1e-6, absolute=True)
        smooth = whole.compute_normals(False, consistent_normals=False, split_vertices=True, feature_angle=_SHARP_ANGLE)
        is_smooth = self.opacity == 1.0 and smooth.n_cells == mesh.n_cells  # not where a cell has no area
        if is_smooth:
            mesh.point_data.active_normals = smooth["Normals"][smooth.regular_faces].reshape(-1, 3)
        how: dict[str, Any] = {"color": self.colour}
        if not isinstance(self.colour, str):
            mesh["colour"], how = self.colour[self.cells.ravel()], {"scalars": "colour", "rgb": True}
        plotter.add_mesh(mesh, opacity=self.opacity, smooth_shading=is_smooth, **how, **_SHINE)
        if self.feature_edges:
            edges = whole.extract_feature_edges(_FEATURE_ANGLE, False, False, True, False)
            if edges.n_points:
                plotter.add_mesh(edges, color="#333333", line_width=1.5)

    def paint(self, axes: Axes, camera: Camera) -> None:
        """Draw the polygons that face the viewer, far ones first."""
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import to_rgb

        colour = self.colour
        colours = to_rgb(colour) if isinstance(colour, str) else colour[self.cells].mean(axis=1) / 255.0
        faces, fill = shaded(self.points[self.cells], colours, camera.axes[2])
        depth = faces.mean(axis=1) @ camera.axes[2]
        far = np.argsort(depth, kind="stable")
        # Edges in the colour of the face close fine seams; a transparent face would show them.
        edges = fill[far] if self.opacity == 1.0 else "none"
        seen = PolyCollection(
            list(camera.flat(faces[far])), facecolors=fill[far], edgecolors=edges, lw=0.3, alpha=self.opacity
        )
        seen.set_zorder(float(depth.mean()) if len(depth) else 0.0)
        axes.add_collection(seen)


@dataclass(frozen=True)
class Polylines:
    """Lines (m, k, 3), mm, of one colour; the width is in pixels."""

    points: Float
    colour: str
    width: float
    opacity: float = 1.0

    def add(self, plotter: pv.Plotter) -> None:
        """Add the lines to a plotter."""
        import pyvista as pv

        points, cells = unshared(self.points)
        lines = pv.PolyData(points, lines=of_vtk(cells))
        plotter.add_mesh(lines, color=self.colour, line_width=self.width, opacity=self.opacity)

    def paint(self, axes: Axes, camera: Camera) -> None:
        """Draw the lines behind all polygons."""
        from matplotlib.collections import LineCollection

        axes.add_collection(LineCollection(list(camera.flat(self.points)), colors=self.colour, lw=0.8, zorder=-np.inf))


@dataclass(frozen=True)
class Arrows:
    """Flat arrows at the centres (a, 3), mm, along the vectors (a, 3), mm."""

    centres: Float
    vectors: Float
    colour: str

    def add(self, plotter: pv.Plotter) -> None:
        """Add the arrows to a plotter."""
        import pyvista as pv

        shape = pv.Arrow(start=(-0.5, 0.0, 0.0), tip_length=0.4, tip_radius=0.13, shaft_radius=0.045)
        points = pv.PolyData(self.centres)
        points["vector"] = self.vectors
        arrows = points.glyph(orient="vector", scale="vector", factor=1.0, geom=shape)
        plotter.add_mesh(arrows, color=self.colour, lighting=False)

    def paint(self, axes: Axes, camera: Camera) -> None:
        """Draw the arrows before all polygons."""
        at, by = camera.flat(self.centres), self.vectors @ camera.axes[:2].T
        arrows = axes.quiver(*at.T, *by.T, color=self.colour, pivot="mid", angles="xy", scale_units="xy", scale=1.0)
        arrows.set(zorder=np.inf)
        arrows.width = 0.002


@dataclass(frozen=True)
class Drawing:
    """What one window shows."""

    camera: Camera
    parts: tuple[Polygons | Polylines | Arrows, ...]


def unshared(corners: Float) -> tuple[Float, Int]:
    """Return points (m k, 3) and cells (m, k) of polygons or lines (m, k, 3) that share no points."""
    count = corners.shape[0] * corners.shape[1]
    return np.ascontiguousarray(corners.reshape(-1, 3)), np.arange(count).reshape(corners.shape[:2])


def of_vtk(cells: Int) -> Int:
    """Return cells (m, k) in VTK's format: each preceded by its number of corners."""
    return np.insert(cells, 0, cells.shape[1], axis=1).ravel()


FAILURES: list[str] = []
"""Reason of the first failure to render. Later calls do not try again, since a driver that crashed will crash again."""


@contextmanager
def rendering(drawings: Sequence[Drawing]) -> Iterator[Callable[[], list[Image]]]:
    """Render drawings in a child process, beside what else is done within the block; at its end the child ends.

    With the environment variable FINGER3D_RENDERER=matplotlib PyVista is not tried.

    Yields
    ------
    function that waits for the images, (h, w, 3) arrays, and returns them
    """

    def painted() -> list[Image]:
        return [_painted(drawing) for drawing in drawings]

    if os.environ.get("FINGER3D_RENDERER") == "matplotlib" or FAILURES or not available("pyvista"):
        yield painted
        return
    with tempfile.TemporaryDirectory(prefix="finger3d-") as folder:
        source, target = Path(folder) / "drawings", Path(folder) / "images"
        source.write_bytes(pickle.dumps(list(drawings)))

        def images() -> list[Image]:
            why = outcome()
            if why is None and target.exists():
                found: list[Image] = pickle.loads(target.read_bytes())
                return found
            FAILURES.append(why or "it wrote no picture")
            return painted()

        command = [sys.executable, "-P", "-m", "finger3d.plotting.renderer", str(source), str(target)]
        with running_child(command) as outcome:
            yield images


@contextmanager
def running_child(command: list[str], window: bool = False) -> Iterator[Callable[[], str | None]]:
    """Run a rendering command in a child process, which isolates crashes of the OpenGL driver, within the block.

    Parameters
    ----------
    command : program and its arguments
    window : whether the command opens a window; if not, there is a time limit

    Yields
    ------
    function that waits for its end, and returns why it failed, in one line; None if it succeeded
    """
    # EGL needs no display; choosing it avoids VTK's warning about a missing X server.
    egl = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
    env = {**(egl if sys.platform.startswith("linux") and not window else {}), **child_environment()}
    try:
        child = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    except OSError as error:
        why = str(error)
        yield lambda: why
        return

    def outcome() -> str | None:
        try:
            _, said = child.communicate(timeout=None if window else _TIME_LIMIT_S)
        except subprocess.TimeoutExpired as error:
            return str(error)
        code = child.returncode
        if code == 0:
            return None
        if code < 0:
            return f"it crashed (signal {-code}); OpenGL may be missing (apt install libegl1 libgl1-mesa-dri)"
        return " ".join(said.strip().splitlines()[-1:]) or f"it ended with code {code}"

    with child:
        try:
            yield outcome
        finally:
            child.kill()


def _image(drawing: Drawing) -> Image:
    """Render one drawing in this process."""
    import pyvista as pv

    camera = drawing.camera
    plotter = pv.Plotter(off_screen=True, window_size=list(camera.window), lighting="three lights")
    plotter.set_background("white")
    for part in drawing.parts:
        part.add(plotter)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_parallel_projection()
    away = 10.0 * camera.half_height * camera.axes[2]
    plotter.camera_position = [tuple(camera.middle + away), tuple(camera.middle), tuple(camera.axes[1])]
    plotter.camera.parallel_scale = camera.half_height
    plotter.reset_camera_clipping_range()
    image: Image = np.asarray(plotter.screenshot(return_img=True))[..., :3].copy()
    plotter.close()
    return image


def _painted(drawing: Drawing) -> Image:
    """Paint one drawing by matplotlib, far parts first."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    camera, (wide, high) = drawing.camera, drawing.camera.window
    figure = blank(wide / DPI, high / DPI)
    figure.set_dpi(DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    for part in drawing.parts:
        part.paint(axes, camera)
    half = camera.half_height * np.array([-1.0, 1.0])
    axes.set(xlim=half * wide / high, ylim=half)
    axes.set_axis_off()
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def _main(source: str, target: str) -> None:
    drawings: list[Drawing] = pickle.loads(Path(source).read_bytes())
    Path(target).write_bytes(pickle.dumps([_image(drawing) for drawing in drawings]))


if __name__ == "__main__":
    _main(*sys.argv[1:])
