"""The page: sliders, tractions along the contact, and the reading of a gauge; its server on the loopback interface."""

from __future__ import annotations

import logging
import math
import secrets
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from flask import abort, request
from werkzeug.serving import BaseWSGIServer, make_server

from finger3d.app.live_body import LiveBody, LivePress, LiveReading
from finger3d.contact.friction import STATUS_NAMES
from finger3d.errors import Finger3dError
from finger3d.mechanics.readings import Gauge
from finger3d.plotting.gauges import COLOUR
from finger3d.plotting.panels import middle_section
from finger3d.plotting.solid import COLOURS
from finger3d.sensor.curve import NOISE

if TYPE_CHECKING:
    import plotly.graph_objects as go
    from dash import Dash, html


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
        slider = dcc.Slider(
            self.low,
            self.high,
            self.step,
            value=value,
            id=name,
            marks={float(f"{at:.4g}"): f"{at:.3g}" for at in np.linspace(self.low, self.high, 5)},
            updatemode="drag",
            allow_direct_input=False,
        )
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
