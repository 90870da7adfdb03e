"""Figures of the fishtail: loops of displacement over pressure, held-out recordings, areas of loops.

Data, in SI units: as `papers.fishtail.fit` gives it.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from nectosome.identification.hysteresis.files import BENCH_UNITS
from nectosome.view.style import BLACK, BLUE, GREEN, VERMILLION, Panel, dress, plain

if TYPE_CHECKING:
    import xarray as xr

Sets = Mapping[str, "xr.Dataset"]
_LINES = {  # what is drawn, from behind to the front: name, colour, width, dash
    "displacement": ("recorded (synthetic)", BLACK, 3.0, "solid"),
    "ignored": ("valve's limit ignored", VERMILLION, 1.5, "solid"),
    "fitted": ("valve's limit fitted", BLUE, 1.5, "dash"),
}
_MM, _BAR = 1e3, 1e-5
_EVERY = 5  # samples


def panels(sets: Sets) -> list[Panel]:
    """Figs. 3, 5 and 6, and the parameters."""
    return [
        loops_panel(sets["fishtail_train"]),
        held_out_panel(sets["fishtail_held_out"]),
        areas_panel(sets["fishtail_areas"]),
        told_panel(sets["fishtail_told"]),
    ]


def loops_panel(found: "xr.Dataset") -> Panel:
    """Displacement over commanded pressure, a plot a frequency."""
    from plotly.subplots import make_subplots

    names = [str(x) for x in found["recording"].values]
    rows = -(-len(names) // 3)
    fig = make_subplots(rows, 3, subplot_titles=[plain(x) for x in names], shared_yaxes=True, vertical_spacing=0.14)
    for k, name in enumerate(names):
        one = found.sel(recording=name).dropna("time").isel(time=slice(None, None, _EVERY))
        for what, (label, colour, width, dash) in _LINES.items():
            line = {"color": colour, "width": width, "dash": dash}
            fig.add_scatter(
                x=_BAR * one["pressure"].values,
                y=_MM * one[what].values,
                mode="lines",
                line=line,
                name=label,
                showlegend=k == 0,
                legendgroup=what,
                row=k // 3 + 1,
                col=k % 3 + 1,
            )
    fig.update_xaxes(title="pressure (bar)", row=rows)
    fig.update_yaxes(title="displacement (mm)", col=1)
    dress(fig, 620).update_layout(showlegend=True, hovermode="closest", margin_t=80, legend_y=1.07)
    caption = (
        "Fits to six synthetic recordings, as Fig. 5: the command over which the displacement is drawn is steeper than "
        "the valve can follow above 1 Hz. A model that leaves the valve's limit out takes it for slower dynamics."
    )
    return Panel("Loops of displacement over pressure", caption, fig)


def held_out_panel(found: "xr.Dataset") -> Panel:
    """Displacement over time, and errors, of recordings that were not fitted."""
    from plotly.subplots import make_subplots

    names = [str(x) for x in found["recording"].values]
    titles = [plain(x) for x in names] + [""] * len(names)
    fig = make_subplots(2, len(names), subplot_titles=titles, shared_xaxes=True, row_heights=[0.6, 0.4])
    for k, name in enumerate(names, start=1):
        one = found.sel(recording=name).dropna("time").isel(time=slice(None, None, _EVERY))
        time = one["time"].values
        for what, (label, colour, width, dash) in _LINES.items():
            line = {"color": colour, "width": width, "dash": dash}
            y = _MM * one[what].values
            shown = {"mode": "lines", "legendgroup": what, "col": k}
            fig.add_scatter(x=time, y=y, line=line, name=label, showlegend=k == 1, row=1, **shown)
            if what != "displacement":
                error = y - _MM * one["displacement"].values
                fig.add_scatter(x=time, y=error, line={"color": colour, "width": 1}, showlegend=False, row=2, **shown)
    fig.update_xaxes(title="time (s)", row=2)
    fig.update_yaxes(title="displacement (mm)", row=1, col=1)
    fig.update_yaxes(title="error (mm)", row=2, col=1)
    dress(fig, 520).update_layout(showlegend=True, hovermode="closest", margin_t=80, legend_y=1.09)
    caption = (
        "Synthetic recordings at frequencies that were not fitted, as Fig. 6. What is left of the one is the noise."
    )
    return Panel("Held-out recordings", caption, fig)


def areas_panel(found: "xr.Dataset") -> Panel:
    """Area of the loop over frequency."""
    import plotly.graph_objects as go

    line = {"color": GREEN, "width": 2}
    fig = go.Figure(
        go.Scatter(x=found["frequency"].values, y=100 * found["area"].values, mode="lines+markers", line=line)
    )
    fig.update_xaxes(title="frequency (Hz)", type="log", tickvals=[0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 3])
    fig.update_yaxes(title="area of the loop (% of its box)", rangemode="tozero")
    dress(fig, 380)
    caption = (
        "Simulated: sines of 0.6 bar without the valve's limit, as in Fig. 3. Slow loops have the area of the plays; "
        "faster ones grow by the lag of the dynamics, an ellipse covers 79 % of its box."
    )
    return Panel("Area of loops over frequency", caption, fig)


def told_panel(found: "xr.Dataset") -> Panel:
    """Parameters with their intervals."""
    rows = []
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        value, low, high = (scale * float(one[key]) for key in ("value", "low", "high"))
        told = "".join(f'<td class="number">{text}</td>' for text in (f"{value:#.4g}", f"{low:#.4g} to {high:#.4g}"))
        rows.append(f"<tr><td>{plain(name)}</td>{told}<td>{unit}</td></tr>")
    head = '<tr><th>parameter</th><th class="number">value</th><th class="number">95 % interval</th><th>unit</th></tr>'
    caption = (
        "Of the fit with the valve's limit, to synthetic recordings. Slopes are sums of the first weights, in "
        "displacement by pressure; all must be above 0 for the hysteresis to have an inverse. Of the paper's 14 "
        "numbers data tell 11: gains of hysteresis and dynamics are one, and the tenth play never moves."
    )
    body = "\n".join(rows)
    text = f'<div class="wide"><table>\n<thead>{head}</thead>\n<tbody>\n{body}\n</tbody></table></div>'
    return Panel("Parameters of the fishtail", caption, text)
