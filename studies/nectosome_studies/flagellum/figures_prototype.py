"""Figures of what was made and tested: the composite, its stiffness from a weights test, speeds in the pool."""

from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.view.style import (
    BLACK,
    BLUE,
    CYCLE,
    GREY,
    ORANGE,
    VERMILLION,
    Panel,
    dress,
    plain,
    span,
)

from .axes import LineEnd, label_ends, log_ticks

_RULES = {"EJ": "stiffnesses in parallel (EJ)", "EJV": "weighed by volume, as printed (EJV)"}


def composite_panel(composite: xr.Dataset) -> Panel:
    """Young's modulus of the composite against the ratio of radii, by rule."""
    fig = go.Figure()
    beta, young = composite["beta"].values, 1e-6 * composite["young"].transpose("rule", "beta").values
    target, measured = (1e-6 * composite.attrs.get(name, np.nan) for name in ("target", "measured"))
    finite = np.log10(np.array([*young.ravel(), target, measured]))
    low, high = span([*finite])
    ends, found = [], []
    for rule, curve, colour in zip(composite["rule"].values, young, CYCLE, strict=False):
        hover = "ratio %{x:.3f}: %{y:.3f} MPa"
        style: Any = {"name": plain(_RULES.get(str(rule), str(rule))), "hovertemplate": hover}
        fig.add_scatter(x=beta, y=curve, mode="lines", line={"color": colour, "simplify": False}, **style)
        cross = _crossings(beta, curve, target)
        if cross:
            ring = {"size": 11, "color": "white", "line": {"color": colour, "width": 2.5}}
            fig.add_scatter(x=cross, y=[target] * len(cross), mode="markers", marker=ring, showlegend=False, **style)
            found.append(f"{' and '.join(f'{b:.3f}' for b in cross)} by {rule}")
    level: Any = {"mode": "lines", "hoverinfo": "skip"}
    for value, text, dash in ((target, "target", "dash"), (measured, "measured in the paper", "dot")):
        if np.isfinite(value):
            line = {"color": BLACK, "dash": dash, "width": 1.4}
            fig.add_scatter(x=beta[[0, -1]], y=[value] * 2, line=line, name=text, showlegend=False, **level)
            ends.append(LineEnd(np.log10(value), f"{text}, {value:.3g} MPa", BLACK))
    if "printed_beta" in composite.attrs:
        x, line = composite.attrs["printed_beta"], {"color": GREY, "width": 1.6, "dash": "dashdot"}
        fig.add_scatter(x=[x, x], y=[10**low, 10**high], line=line, name=f"printed ratio, {x:g}", **level)
    fig.update_xaxes(title="radius of the core / radius of the whole", range=(float(beta.min()), float(beta.max())))
    fig.update_yaxes(title="Young's modulus of the composite (MPa)", type="log", range=(low, high))
    fig.update_yaxes(**log_ticks(10**finite))
    height = 420
    dress(fig, height, labels=220).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    label_ends(fig, ends, (low, high), height - 110)
    caption = "Computed from the moduli of core and shell; target, measured modulus and the ratio are printed."
    if found:
        caption += f" The target needs a ratio of {', '.join(found)} (rings)."
    return Panel("The composite's stiffness", caption, fig)


def _crossings(x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], level: float) -> list[float]:
    """Where a line through points takes a value."""
    above = y - level
    at = np.flatnonzero(above[:-1] * above[1:] <= 0)
    at = at[above[at] != above[at + 1]]
    return sorted({round(float(x[i] - above[i] * (x[i + 1] - x[i]) / (above[i + 1] - above[i])), 12) for i in at})


def static_test_panel(test: xr.Dataset) -> Panel:
    """Deflected shapes of the weights test, and the modulus that they tell."""
    titles = ("markers on the filament", "Young's modulus")
    fig = make_subplots(1, 2, column_widths=[0.62, 0.38], horizontal_spacing=0.12, subplot_titles=titles)
    axes = [str(a) for a in test["axis"].values]
    sideways = next(a for a in axes if a != "z")
    for i, colour in zip(range(test.sizes["case"]), CYCLE, strict=False):
        own = test.isel(case=i)
        name = f"weight {plain(str(own['case'].item()))}"
        if "weight" in own.coords:
            name += f", {float(own['weight']):g} N"
        dots = {"color": colour, "size": 8}
        for kind, style in (("fitted", {"line_color": colour}), ("measured", {"marker": dots, "showlegend": False})):
            x, z = (1e3 * own[kind].sel(axis=a).values for a in (sideways, "z"))
            style |= {"mode": "lines" if kind == "fitted" else "markers", "name": name}
            hover = f"{name}, {kind}<br>%{{x:.1f}}, %{{y:.1f}} mm"
            fig.add_scatter(x=x, y=z, hovertemplate=hover, row=1, col=1, **style)
    key: Any = {"x": [None], "y": [None], "row": 1, "col": 1}
    fig.add_scatter(mode="markers", marker={"color": GREY, "size": 8}, name="markers", **key)
    fig.add_scatter(mode="lines", line_color=GREY, name="fitted model", **key)
    young, low, high, truth = (1e-6 * test.attrs.get(k, np.nan) for k in ("young", "young_low", "young_high", "truth"))
    bar = {"type": "data", "symmetric": False, "array": [high - young], "arrayminus": [young - low]}
    bar |= {"width": 10, "thickness": 2}
    one: Any = {"mode": "markers", "showlegend": False, "hovertemplate": "%{x}: %{y:.3f} MPa", "row": 1, "col": 2}
    mark = {"color": BLUE, "size": 11}
    fig.add_scatter(x=["estimate"], y=[young], error_y=bar, marker=mark, name="estimate", **one)
    mark = {"color": VERMILLION, "size": 12, "symbol": "diamond"}
    fig.add_scatter(x=["truth"], y=[truth], marker=mark, name="truth", **one)
    fig.update_xaxes(title="sideways (mm)", row=1, col=1)
    fig.update_yaxes(title="up (mm)", scaleanchor="x", constrain="domain", row=1, col=1)
    fig.update_xaxes(range=(-0.7, 1.7), type="category", row=1, col=2)
    fig.update_yaxes(title="Young's modulus (MPa)", range=span([young, low, high, truth], 0.35), row=1, col=2)
    dress(fig, 460).update_layout(showlegend=True, hovermode="closest", legend_y=1.085, margin_t=76)
    fig.update_xaxes(zeroline=False, row=1, col=2)
    synthetic = str(test.attrs.get("synthetic", "")).lower() in ("yes", "true", "1")
    seen = "Synthetic markers, made by a finer model with noise" if synthetic else "Markers"
    caption = f"{seen} (dots), and the model's shapes with the modulus fitted to them (lines through its markers)."
    if np.isfinite([young, low, high]).all():
        caption += f" The estimate is {young:.2f} MPa, its 95 % interval {low:.2f} .. {high:.2f} MPa."
    if np.isfinite(truth):
        caption += f" The modulus behind the markers is {truth:.2f} MPa."
    return Panel(f"Stiffness from the weights test{' (synthetic data)' if synthetic else ''}", caption, fig)


def pool_panel(pool: xr.Dataset) -> Panel:
    """Speeds in the pool: printed as simulated and as measured, and ours."""
    fig = go.Figure()
    names = [f"{plain(d)}<br>({plain(k)})" for d, k in zip(pool["design"].values, pool["kind"].values, strict=True)]
    bars: Any = {"textposition": "outside", "cliponaxis": False}
    for key, text, colour in (
        ("printed_simulated", "printed, simulated", ORANGE),
        ("printed_measured", "printed, measured", GREY),
        ("ours", "ours, simulated", BLUE),
    ):
        value = pool[key].values
        bars |= {"text": [f"{v:.3f}" if np.isfinite(v) else "" for v in value]}
        hover = f"{text}: %{{y:.4f}} m/s"
        fig.add_bar(x=names, y=value, name=text, marker_color=colour, hovertemplate=hover, **bars)
    fig.update_layout(barmode="group", bargap=0.35)
    fig.update_yaxes(title="swimming speed (m/s)")
    dress(fig, 400).update_layout(showlegend=True, hovermode="closest", margin_t=56)
    fig.update_xaxes(showgrid=False)
    caption = (
        "Speeds in the pool, as the paper prints them and as computed here. A calibration was fitted to a printed "
        "speed; a prediction was not. No bar where there is no number."
    )
    return Panel("Speeds in the pool", caption, fig)
