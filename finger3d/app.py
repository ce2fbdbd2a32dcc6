"""Local page with sliders: a press of a condensed body, tractions along the contact, and the reading of a gauge."""

from __future__ import annotations

import logging
import math
import secrets
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from flask import abort, request
from werkzeug.serving import BaseWSGIServer, make_server

from finger3d._types import Array, Float, freeze_arrays
from finger3d.accuracy.changes import changing_numbers, two_digits
from finger3d.accuracy.model_error import judged_large_deformation
from finger3d.analyses.calibrate import GAUGE_PLACES, TOLERANCES
from finger3d.analyses.calibrate.tolerances import displaced_gauges, tolerance_of
from finger3d.analyses.pressed_body import PressedBody, under
from finger3d.contact.friction import STATUS_NAMES
from finger3d.errors import Finger3dError
from finger3d.fem.recovery import displacement
from finger3d.mechanics.discretise.problem import Problem
from finger3d.mechanics.formulations import formulation_of
from finger3d.mechanics.history import StepResult, contact_table, measure
from finger3d.mechanics.march.solve import march
from finger3d.mechanics.model import Leg
from finger3d.mechanics.readings import Gauge, of_kind
from finger3d.plotting.figures import middle_line
from finger3d.plotting.gauges import COLOUR
from finger3d.plotting.panels import middle_section
from finger3d.plotting.solid import COLOURS
from finger3d.progress import QUIET, Progress
from finger3d.sensor.curve import NOISE, ReadingCurve, SensorModel

if TYPE_CHECKING:
    import plotly.graph_objects as go
    from dash import Dash, html

    from finger3d.scene import Scene


STEPS = 10
"""Increments of every press of a scene that slides or turns the object; those of other scenes are the scene's own."""

MU_STEP = 0.02
"""Distance of the values of mu that the strain is calibrated at."""

_KEPT = 64  # presses; a slider that goes back finds them
_ALONG = ("x_mm", "pressure_MPa", "shear_x_MPa", "shear_z_MPa", "status")
_NUMBERS = ("normal_force_N", "friction_sum_N", "contact_half_length_mm", "stick_half_length_mm")


@dataclass(frozen=True)
class LivePress:
    """End of a press.

    Attributes
    ----------
    numbers : normal force, friction sum, half the lengths of contact and stick, as in `steps` of summary.json
    z_mm : place of the line along x that the traction is given on, as in the picture of a press
    x_mm, pressure_MPa, shear_x_MPa, shear_z_MPa : (p,) traction on the finger along that line, ascending in x
    status : (p,) "open", "stick" or "slip"
    displacement : (n, d) mm, of the meshed part
    """

    numbers: dict[str, float]
    z_mm: float
    x_mm: Float
    pressure_MPa: Float
    shear_x_MPa: Float
    shear_z_MPa: Float
    status: Array
    displacement: Float

    def __post_init__(self) -> None:
        freeze_arrays(self)


@dataclass(frozen=True)
class LiveReading:
    """Reading of a gauge, and the standard deviation of mu, as a calibration at three values of mu has them.

    Attributes
    ----------
    strain : of the gauge
    slope : d strain / d mu
    strain_sd : standard deviation of the strain by noise, and by the tolerances of place and direction
    mu_sd : standard deviation of mu, as in a calibration; infinite where the slope is zero
    """

    strain: float
    slope: float
    strain_sd: float
    mu_sd: float


@dataclass(frozen=True, eq=False)
class LiveBody:
    """A finger condensed to its contact points, pressed straight down.

    Attributes
    ----------
    title : of the scene
    problem : condensed for the largest depth
    largest_depth_mm : depth that the scene's own press ends at
    steps : increments of every press
    remark : that presses are in small strain, and what large deformation would change at the largest depth
    """

    title: str
    problem: Problem
    largest_depth_mm: float
    steps: int
    remark: str = ""

    @classmethod
    def of(cls, scene: Scene, report: Progress = QUIET) -> LiveBody:
        """Condense the finger of a scene.

        Raises
        ------
        Finger3dError
            If an effect makes the compliance depend on the state or on time, or if there are two fingers.
        """
        model = scene.with_effects(scene.fixed_effects).model()
        if not model.is_linear_elastic or model.inclusions is not None:
            slots = dict(model.filled)
            name = next(slots[slot] for slot in ("hyperelastic_law", "relaxation", "inclusions") if slot in slots)
            raise Finger3dError(f"app: not with effects.{name}, which takes seconds to press; take the effect out")
        if model.centre_of_mass_mm is not None:
            raise Finger3dError("app: not with [grip]; press the scene, or give it [press] for one finger")
        if len(model.legs) > 1 or model.legs[0].moves_sideways:
            model = replace(model, legs=(Leg(model.largest_depth_mm, steps=STEPS),))
        body = PressedBody(model, report)
        steps = body.steps()
        steps[-1].check(f"app: mu = {scene.tables.friction.mu:g}")
        remark = _remark(body.problem, steps[-1])
        return cls(scene.title, body.problem, steps[-1].target.depth_mm, len(steps), remark)

    def press(self, mu: float, depth_mm: float) -> LivePress:
        """Press with a coefficient of friction to a depth; the last presses are kept.

        Raises
        ------
        Finger3dError
            If an increment does not converge.
        """
        return _pressed(self, float(f"{mu:.9g}"), float(f"{depth_mm:.9g}"))

    def read(self, gauge: Gauge, mu: float, depth_mm: float, noise: float) -> LiveReading:
        """Read a gauge.

        Parameters
        ----------
        noise : standard deviation of a reading of the strain

        Raises
        ------
        Finger3dError
            If the gauge is not inside the finger.
        """
        model, mesh, axes = self.problem.model, self.problem.mesh, self.problem.axes
        start = max(mu - MU_STEP, 0.0)
        at = np.array([start, mu, mu + MU_STEP] if start < mu else [0.0, MU_STEP, 2.0 * MU_STEP])
        displacements = np.stack([self.press(float(m), depth_mm).displacement.ravel() for m in at], axis=1)

        def strains(place: Gauge) -> Float:
            return np.asarray((place.row(mesh, axes) @ displacements)[0])

        own, tolerances = strains(gauge), []
        for name in GAUGE_PLACES.values():
            sd = TOLERANCES[name][0]
            if displaced := displaced_gauges(model, gauge, {name: sd}):
                tolerances.append(tolerance_of(name, sd, [(d.step, strains(d.gauge) - own) for d in displaced]))
        curve = ReadingCurve(gauge.name, at, own, noise, tuple(tolerances))
        return LiveReading(
            strain=float(curve.at(mu)),
            slope=float(curve.slope(mu)),
            strain_sd=float(curve.reading_sd([mu])[0]),
            mu_sd=float(SensorModel((curve,)).mu_sd(mu)[0]),
        )


@lru_cache(maxsize=_KEPT)
def _pressed(body: LiveBody, mu: float, depth_mm: float) -> LivePress:
    problem = body.problem
    pressed = under(problem, problem.model.friction.with_mu(mu), (Leg(depth_mm, steps=body.steps),))
    steps = list(march(pressed))
    steps[-1].check(f"app: mu = {mu:g}")
    measured = measure(problem.points, steps[-1])
    table = contact_table(problem.points, steps[-1])
    z_mm, on = middle_line(table, problem.points.band_mm, problem.points.half_width_mm if problem.dim == 3 else None)
    unknowns = next(formulation_of(problem.model).unknowns(problem, [steps[-1].meshed_state]))
    return LivePress(
        numbers={name: measured[name] for name in _NUMBERS},
        z_mm=z_mm,
        displacement=displacement(problem.mesh, unknowns),
        **{name: np.asarray(table[name])[on] for name in _ALONG},
    )


def _remark(problem: Problem, step: StepResult) -> str:
    """Return that presses are in small strain, and what large deformation would change at the end of one."""
    found = judged_large_deformation(problem.model)
    changes = found.estimate.of_press(changing_numbers(problem, step)).changes
    names = [name for name in ("normal_force_N", "friction_sum_N", "stick_area_mm2") if name in changes]
    said = [
        f"{name} by {two_digits(changes[name].change)} ({two_digits(changes[name].low)} to "
        f"{two_digits(changes[name].high)})"
        for name in names + [column.key for column in of_kind(step.readings, "gauge")]
    ]
    told = ", ".join(said) or "every number by an unknown amount"
    return f"Presses are in small strain; at {step.target.depth_mm:.4g} mm large deformation would change {told}."


_COLOURS = {STATUS_NAMES[state]: colour for state, colour in COLOURS.items()}
_LARGEST_MU = 1.5
_LEAST_DEPTH_SHARE = 0.05
_LAYOUT = {
    "template": "plotly_white",
    "margin": {"l": 60, "r": 20, "t": 40, "b": 50},
    "height": 360,
    "uirevision": "kept",
}


def page(body: LiveBody, mu: float) -> Dash:
    """Return the page of a body, at an address that cannot be guessed.

    Parameters
    ----------
    mu : where its slider begins; that of depth begins at the scene's depth, those of the gauge at the scene's first
    """
    import plotly.graph_objects as go
    from dash import Dash, Input, Output, dcc, html

    secret = f"/{secrets.token_urlsafe(24)}/"
    app = Dash(__name__, title=f"finger3d: {body.title}", update_title="", url_base_pathname=secret)
    design = body.problem.model.design
    half, high, deepest = design.half_length_mm, design.height_mm, body.largest_depth_mm
    first = next(iter(body.problem.model.gauges), Gauge("gauge", 0.5 * half, 0.7 * high, angle=math.radians(30.0)))
    turned = math.degrees(first.angle) % 180.0  # a strain is the same in the opposite direction
    sliders = {
        "mu": Slider("coefficient of friction mu", 0.0, max(_LARGEST_MU, mu), 0.01, mu),
        "depth": Slider("depth (mm)", _LEAST_DEPTH_SHARE * deepest, deepest, deepest / 100.0, deepest),
        "x": Slider("gauge x (mm)", -half, half, 0.1, first.x_mm),
        "y": Slider("gauge y (mm)", 0.0, high, 0.1, first.y_mm),
        "angle": Slider("gauge angle (degrees)", 0.0, 180.0, 1.0, turned),
    }
    app.layout = html.Div(
        [
            html.H1(body.title),
            html.Div([slider.drawn(name) for name, slider in sliders.items()], style={"maxWidth": "50rem"}),
            html.P(id="numbers"),
            html.P(id="reading"),
            html.P(body.remark, id="remark"),
            html.P(id="mistake", style={"color": "#a00"}),
            dcc.Graph(id="traction"),
            dcc.Graph(id="section"),
        ],
        style={"fontFamily": "sans-serif", "margin": "1.5rem auto", "maxWidth": "60rem"},
    )

    for name, slider in sliders.items():
        both = (name, f"{name}-typed")
        app.clientside_callback(  # type: ignore[no-untyped-call]
            slider.clamped(name), [Output(at, "value") for at in both], [Input(at, "value") for at in both]
        )

    @app.callback(
        [Output(name, "children") for name in ("numbers", "reading", "mistake")],
        [Output(name, "figure") for name in ("traction", "section")],
        [Input(name, "value") for name in sliders],
    )
    def answer(*positions: object) -> tuple[str, str, str, go.Figure, go.Figure]:
        try:
            values = [slider.checked(value) for slider, value in zip(sliders.values(), positions, strict=True)]
        except Finger3dError as error:
            return "", "", str(error), go.Figure(), go.Figure()
        mu, depth, x, y, angle = values
        at = f"mu = {mu:.4g}, {depth:.4g} mm deep: "
        gauge = replace(first, x_mm=x, y_mm=y, angle=math.radians(angle))
        section = section_figure(body, gauge)
        try:
            press = body.press(mu, depth)
        except Finger3dError as error:
            return "", "", str(error), go.Figure(), section
        traction = traction_figure(press, mu)
        try:
            reading = body.read(gauge, mu, depth, NOISE)
        except Finger3dError as error:
            return at + numbers_of(press), "", str(error), traction, section
        place = f"gauge at x = {x:.4g}, y = {y:.4g} mm, {angle:.4g} degrees: "
        return at + numbers_of(press), place + text_of(reading), "", traction, section

    return app


@dataclass(frozen=True)
class Slider:
    """A number that the page asks for, and the range of it."""

    label: str
    low: float
    high: float
    step: float
    value: float

    def checked(self, value: object) -> float:
        """Return a value that a browser has sent, as a number.

        Raises
        ------
        Finger3dError
            If it is no number, or out of range.
        """
        room = 1e-6 * (self.high - self.low)
        if isinstance(value, int | float) and self.low - room <= value <= self.high + room:
            return float(value)
        raise Finger3dError(f"{self.label}: must be a number from {self.low:g} to {self.high:g}")

    def clamped(self, name: str) -> str:
        """Return a function, in JavaScript, of slider and box: both get the value that was changed, within the range.

        The box of Dash's own slider leaves the slider where it is if the typed number is out of range.
        """
        return f"""(slid, typed) => {{
            const changed = window.dash_clientside.callback_context.triggered_id;
            const clamped = Math.min({self.high!r}, Math.max({self.low!r}, typed));
            const value = changed === "{name}-typed" ? clamped : slid;
            return [changed === "{name}" ? window.dash_clientside.no_update : value, value];
        }}"""

    def drawn(self, name: str) -> html.Div:
        """Return the label, a box to type in, and the slider."""
        from dash import dcc, html

        value = float(f"{self.value:.6g}")
        box = dcc.Input(value, "number", id=f"{name}-typed", step="any", debounce=True)
        marks = {float(f"{at:.4g}"): f"{at:.3g}" for at in np.linspace(self.low, self.high, 5)}
        scale = self.low, self.high, self.step
        slider = dcc.Slider(*scale, marks=marks, value=value, id=name, updatemode="drag", allow_direct_input=False)
        label = html.Label(self.label, htmlFor=f"{name}-typed")
        return html.Div([label, box, slider], style={"marginBottom": "0.5rem"})


def numbers_of(press: LivePress) -> str:
    """Return forces and lengths in one line."""
    n = press.numbers
    return (
        f"normal force {n['normal_force_N']:.4g} N, friction sum {n['friction_sum_N']:.4g} N, contact "
        f"{2.0 * n['contact_half_length_mm']:.4g} mm long, stick {2.0 * n['stick_half_length_mm']:.4g} mm"
    )


def text_of(reading: LiveReading) -> str:
    """Return the strain, its standard deviation and that of mu in one line."""
    mu = "cannot be told" if reading.mu_sd > _LARGEST_MU else f"is told to +- {reading.mu_sd:.2g}"
    return (
        f"strain {reading.strain:.5f} +- {reading.strain_sd:.1g} (noise {NOISE:g}, place and angle), "
        f"d strain / d mu = {reading.slope:.3g}: mu {mu}"
    )


def traction_figure(press: LivePress, mu: float) -> go.Figure:
    """Return pressure, friction and its limit along the middle of the contact, as the picture of a press shows them."""
    import plotly.graph_objects as go

    figure = go.Figure()
    figure.add_scatter(x=press.x_mm, y=press.pressure_MPa, name="pressure", mode="lines", line_color="#222222")
    for sign in (1.0, -1.0):
        figure.add_scatter(
            x=press.x_mm, y=sign * mu * press.pressure_MPa, name="friction limit ± mu p", mode="lines",
            line={"dash": "dot", "color": "#777777"}, showlegend=sign > 0.0,
        )  # fmt: skip
    parts = {"x": press.shear_x_MPa}
    if np.any(np.abs(press.shear_z_MPa) > 1e-6 * np.abs(press.pressure_MPa).max(initial=0.0)):
        parts["z"] = press.shear_z_MPa
    for axis, shear in parts.items():
        for status in ("stick", "slip"):
            on = press.status == status
            figure.add_scatter(
                x=press.x_mm[on], y=shear[on], name=f"friction along {axis}, {status}", mode="markers",
                marker={"color": _COLOURS[status], "size": 6, "symbol": "circle" if axis == "x" else "circle-open"},
            )  # fmt: skip
    title = f"traction on the finger at z = {press.z_mm:.3g} mm"
    figure.update_layout(_LAYOUT, title=title, xaxis_title="x at rest (mm)", yaxis_title="traction (MPa)")
    return figure


def section_figure(body: LiveBody, gauge: Gauge) -> go.Figure:
    """Return the outline of the middle section and the gauge."""
    import plotly.graph_objects as go

    x, y = middle_section(body.problem.model.design).T
    along = 0.06 * float(np.ptp(x)) * gauge.direction
    ends = np.stack([gauge.middle - along, gauge.middle + along])
    figure = go.Figure()
    figure.add_scatter(x=x, y=y, fill="toself", fillcolor="#e8e5de", line_color="#8d8a84", mode="lines", name="finger")
    figure.add_scatter(
        x=ends[:, 0], y=ends[:, 1], mode="lines+markers", line={"color": COLOUR, "width": 3}, name="gauge"
    )
    title = "gauge in the middle section, at rest"
    figure.update_layout(_LAYOUT, title=title, xaxis_title="x (mm)", yaxis_title="y (mm)")
    figure.update_yaxes(scaleanchor="x", scaleratio=1.0)
    return figure


HOST = "127.0.0.1"


def local_server(page: Dash, port: int = 0) -> tuple[str, BaseWSGIServer]:
    """Return the address of a page on 127.0.0.1, and the server that answers there once it is told to.

    The address of the page is secret, and requests for another host name (DNS rebinding) are refused. Nothing is kept
    in the browser: cookies of one port would be sent to every other port of this machine.

    Parameters
    ----------
    port : 0 chooses a free one

    Raises
    ------
    Finger3dError
        If the port is taken, or cannot be one.
    """
    if not 0 <= port < 2**16:
        raise Finger3dError(f"app: port {port}: must be from 1 to 65535, or 0 for a free one")
    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # it would print every request, with the secret
    page.server.before_request(_refuse_other_hosts)
    try:
        server = make_server(HOST, port, page.server, threaded=True)
    except (OSError, SystemExit):
        raise Finger3dError(f"app: port {port} is not free; name another with --port, or none") from None
    return f"http://{HOST}:{server.port}{page.config.requests_pathname_prefix}", server


def _refuse_other_hosts() -> None:
    if request.host.partition(":")[0] != HOST:
        abort(403)
