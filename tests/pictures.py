"""A finger with made-up fields, and what a picture shows, for the tests of plotting."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from finger3d.contact.friction import OPEN, SLIP, STATUS_NAMES, STICK
from finger3d.fem.mesh import CONTACT, Mesh, quadratic
from finger3d.objects import Plane
from finger3d.plotting import solid as render
from finger3d.plotting.deformed import draw_finger
from finger3d.plotting.layout import save
from finger3d.plotting.solid import DeformedFinger
from finger3d.sensor import Calibration, ReadingCurve, Tolerance
from tests.meshes import grid

MU = 0.25
STEPS = [
    {
        "depth_mm": d,
        "normal_force_N": 15.0 * d**1.3,
        "friction_sum_N": 3.0 * d**1.3,
        "contact_half_length_mm": 7.0 * d**0.7,
        "stick_half_length_mm": 5.0 * d**0.7,
    }
    for d in range(1, 11)
]
PLATE = Plane().drawing(60.0)
OBJECT = (PLATE.points + [0.0, 40.0, 0.0])[PLATE.faces]


MUS = np.linspace(0.05, 1.0, 6)
CAUSES = ("depth_mm", "E_percent", "nu", "tilt_deg", "gauge_x_mm", "gauge_y_mm", "gauge_angle_deg", "mesh")
CURVE = Calibration(
    (ReadingCurve(
        "g36", MUS, 0.02 + 0.01 * MUS - 0.004 * MUS**2, 1.5e-4,
        tuple(Tolerance(name, "", 0.5, np.full(6, 2e-3), np.zeros(6)) for name in CAUSES),
    ),),
    0.1, about={"domain": "solid"},
)  # fmt: skip
"""A calibration that nobody pressed, with every cause of uncertainty."""


def top(x: np.ndarray) -> np.ndarray:
    """Height of the Fig. 9 finger, R = 100, mm."""
    return 36.6 + np.sqrt(100.0**2 - x**2) - np.sqrt(100.0**2 - 50.0**2)


def finger(shape: tuple[int, ...]) -> Mesh:
    """Return a coarse Fig. 9 finger of (nx, ny) or (nx, ny, nz) boxes, quadratic, with labelled facets."""
    unit = grid(shape)
    x, y = 100.0 * unit.points[:, 0] - 50.0, unit.points[:, 1]
    points = np.column_stack([x, y * top(x), *(20.0 * z - 10.0 for z in unit.points.T[2:])])
    sides = {"contact": ("y+",), "base": ("y-",), "walls": ("x-", "x+"), "ends": ("z-", "z+")}
    facets = {
        label: np.vstack([unit.facets[side] for side in of]) for label, of in sides.items() if of[0] in unit.facets
    }
    return quadratic(Mesh(points, unit.cells, facets))


def pressed(mesh: Mesh) -> dict[str, Any]:
    """Made-up but likely fields: pressed 10 mm, Hertz's pressure, friction limited by mu p and pointing outward."""
    x, y = mesh.points[:, 0], mesh.points[:, 1]
    push = np.maximum(top(x) - 40.0, 0.0)
    u = np.zeros_like(mesh.points)
    u[:, 1] = -push * (y / top(x)) ** 1.5
    u[:, 0] = 0.05 * x * (y / 50.0) * (1.0 - y / 55.0)
    if mesh.dim == 3:
        u[:, 2] = 0.25 * mesh.points[:, 2] * np.sin(np.pi * np.minimum(y / 48.0, 1.0)) * np.exp(-((x / 45.0) ** 2))
    nodes = np.unique(mesh.facets["contact"][:, : mesh.dim])
    a = 38.0
    inside = np.abs(x[nodes]) < a
    pressure = 0.3 * np.sqrt(np.maximum(1.0 - (x[nodes] / a) ** 2, 0.0))
    along = mesh.points[nodes][:, [0, *range(2, mesh.dim)]] / np.array([a, 10.0][: mesh.dim - 1])
    wanted = 0.09 * along
    size = np.linalg.norm(wanted, axis=1)
    limit = MU * pressure
    shear = wanted * np.minimum(1.0, limit / np.maximum(size, 1e-12))[:, None]
    status = np.where(~inside, OPEN, np.where(size < limit, STICK, SLIP))
    table = {
        "face": ["contact"] * len(nodes),
        "x_mm": x[nodes],
        "z_mm": mesh.points[nodes, 2] if mesh.dim == 3 else np.zeros(len(nodes)),
        "pressure_MPa": pressure,
        "shear_x_MPa": shear[:, 0],
        "shear_y_MPa": np.zeros(len(nodes)),
        "shear_z_MPa": shear[:, 1] if mesh.dim == 3 else np.zeros(len(nodes)),
        "status": [STATUS_NAMES[s] for s in status],
    }
    return {"displacement": u, "table": table, "contact_nodes": nodes}


def deformed(mesh: Mesh, displacement: np.ndarray, table: dict[str, Any], contact_nodes: np.ndarray,
             thing: np.ndarray | None = None, **more: Any) -> DeformedFinger:  # fmt: skip
    """Return the finger of a picture."""
    return DeformedFinger(
        mesh=mesh,
        displacement=displacement,
        pressure=table["pressure_MPa"],
        shear=np.column_stack([table[f"shear_{axis}_MPa"] for axis in "xyz"]),
        status=np.array([STATUS_NAMES.index(name) for name in table["status"]]),
        nodes=contact_nodes,
        faces=np.full(len(contact_nodes), CONTACT),
        thing=thing,
        **more,
    )


def finger_picture(path: Path, mesh: Mesh, **more: Any) -> None:
    """Draw the finger."""
    save(draw_finger(deformed(mesh, **more)), path)


def solid_finger() -> tuple[Mesh, dict[str, Any]]:
    """A solid finger, and the fields of its press."""
    mesh = finger((20, 5, 6))
    return mesh, pressed(mesh)


def pixels(path: Path) -> np.ndarray:
    """The picture as (h, w, 3) in 0 .. 1."""
    from matplotlib.image import imread

    return imread(path)[..., :3]


def share(path: Path, colour: str, within: float = 0.12) -> float:
    """Share of the pixels that have about that colour."""
    from matplotlib.colors import to_rgb

    return float(np.mean(np.all(np.abs(pixels(path) - to_rgb(colour)) < within, axis=-1)))


def orange(image: np.ndarray) -> float:
    """Share of the right half, above the keys, in slip's colour, whatever the light."""
    high, wide = image.shape[:2]
    panel = image[: int(0.75 * high), wide // 2 :]
    return float(((panel[..., 0] - panel[..., 2] > 90) & (panel[..., 0] > panel[..., 1] + 30)).mean())


def marked(image: np.ndarray) -> int:
    """Pixels in the colour of gauges, or in that colour seen through the object."""
    return int((np.abs(image - np.array([0xB0, 0x00, 0x6A])).max(axis=2) < 40).sum())


def rgb(path: Path) -> np.ndarray:
    """The picture as (h, w, 3) in 0 .. 255."""
    from PIL import Image

    return np.asarray(Image.open(path).convert("RGB"), dtype=float)


def assert_shows_the_zones(path: Path) -> None:
    """Both zones cover a visible part of the picture, and the pressure has the colours of a peak and of an edge."""
    assert pixels(path).std() > 0.1
    assert share(path, render.COLOURS[STICK]) > 0.01
    assert share(path, render.COLOURS[SLIP]) > 0.01
    assert share(path, "#dde318", within=0.2) > 0.01
    assert share(path, "#33638d", within=0.2) > 0.003
