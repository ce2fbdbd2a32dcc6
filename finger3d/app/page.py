"""The page: sliders, tractions along the contact, and the reading of a gauge."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from finger3d.app.live_body import LiveBody, LivePress, LiveReading
from finger3d.errors import Finger3dError
from finger3d.mechanics.gauges import Gauge
from finger3d.sensor.curve import NOISE

if TYPE_CHECKING:
    import plotly.graph_objects as go
    from dash import Dash, html

_COLOURS = {"open": "#c4c4c4", "stick": "#1f3f77", "slip": "#f28e2b"}
_LARGEST_MU = 1.5
_LEAST_DEPTH_SHARE = 0.05
_GAUGE = "#b0006e"
_LAYOUT = {
    "template": "plotly_white",
    "margin": {"l": 60, "r": 20, "t": 40, "b": 50},
    "height": 360,
    "uirevision": "kept",
}


def page(body: LiveBody, mu: float) -> Dash:
    """Return the page of a body; `mu` is where its slider begins."""
    import plotly.graph_objects as go
    from dash import Dash, Input, Output, dcc, html

    app = Dash(__name__, title=f"finger3d: {body.title}", update_title="")
    design = body.problem.model.design
    deepest = body.largest_depth_mm
    sliders = [
        _slider("mu", "coefficient of friction mu", 0.0, _LARGEST_MU, 0.01, mu),
        _slider("depth", "depth (mm)", _LEAST_DEPTH_SHARE * deepest, deepest, deepest / 100.0, deepest),
        _slider("x", "gauge x (mm)", -design.half_length_mm, design.half_length_mm, 0.1, 0.5 * design.half_length_mm),
        _slider("y", "gauge y (mm)", 0.0, design.height_mm, 0.1, 0.7 * design.height_mm),
        _slider("angle", "gauge angle (degrees)", 0.0, 180.0, 1.0, 30.0),
    ]
    app.layout = html.Div(
        [
            html.H1(body.title),
            html.Div(sliders, style={"maxWidth": "50rem"}),
            html.P(id="numbers"),
            html.P(id="reading"),
            html.P(id="mistake", style={"color": "#a00"}),
            dcc.Graph(id="traction"),
            dcc.Graph(id="section"),
        ],
        style={"fontFamily": "sans-serif", "margin": "1.5rem auto", "maxWidth": "60rem"},
    )

    @app.callback(
        [Output(name, "children") for name in ("numbers", "reading", "mistake")],
        [Output(name, "figure") for name in ("traction", "section")],
        [Input(name, "value") for name in ("mu", "depth", "x", "y", "angle")],
    )
    def answer(mu: float, depth: float, x: float, y: float, angle: float) -> tuple[str, str, str, go.Figure, go.Figure]:
        gauge = Gauge("gauge", x, y, angle=math.radians(angle))
        section = section_figure(body, gauge)
        try:
            press = body.press(mu, depth)
        except Finger3dError as error:
            return "", "", str(error), go.Figure(), section
        traction = traction_figure(press, mu)
        try:
            reading = body.read(gauge, mu, depth, NOISE)
        except Finger3dError as error:
            return numbers_of(press), "", str(error), traction, section
        return numbers_of(press), text_of(reading), "", traction, section

    return app


def _slider(name: str, label: str, low: float, high: float, step: float, value: float) -> html.Div:
    from dash import dcc, html

    marks = {float(f"{at:.4g}"): f"{at:.3g}" for at in np.linspace(low, high, 5)}
    slider = dcc.Slider(
        low, high, step, value=round(value, 2), id=name, marks=marks, updatemode="drag", tooltip={"placement": "bottom"}
    )
    return html.Div([html.Label(label, htmlFor=name), slider], style={"marginBottom": "0.5rem"})


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
    """Return pressure, friction and its limit along the middle of the contact, with stick and slip."""
    import plotly.graph_objects as go

    figure = go.Figure()
    figure.add_scatter(x=press.x_mm, y=press.pressure_MPa, name="pressure", mode="lines", line_color="#222222")
    limit = mu * press.pressure_MPa
    figure.add_scatter(
        x=press.x_mm, y=limit, name="friction limit mu p", mode="lines", line={"dash": "dot", "color": "#777777"}
    )
    for status in ("stick", "slip"):
        on = press.status == status
        figure.add_scatter(
            x=press.x_mm[on],
            y=press.shear_MPa[on],
            name=f"friction, {status}",
            mode="markers",
            marker={"color": _COLOURS[status], "size": 6},
        )
    title, x, y = "traction on the finger at z = 0", "x at rest (mm)", "traction (MPa)"
    figure.update_layout(_LAYOUT, title=title, xaxis_title=x, yaxis_title=y)
    return figure


def section_figure(body: LiveBody, gauge: Gauge) -> go.Figure:
    """Return the outline of the middle section and the gauge."""
    import plotly.graph_objects as go

    x, y = body.outline()
    along = 0.06 * float(np.ptp(x)) * gauge.direction
    ends = np.stack([gauge.middle - along, gauge.middle + along])
    figure = go.Figure()
    figure.add_scatter(x=x, y=y, fill="toself", fillcolor="#e8e5de", line_color="#8d8a84", mode="lines", name="finger")
    figure.add_scatter(
        x=ends[:, 0], y=ends[:, 1], mode="lines+markers", line={"color": _GAUGE, "width": 3}, name="gauge"
    )
    title = "gauge in the middle section, at rest"
    figure.update_layout(_LAYOUT, title=title, xaxis_title="x (mm)", yaxis_title="y (mm)")
    figure.update_yaxes(scaleanchor="x", scaleratio=1.0)
    return figure
