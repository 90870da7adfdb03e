"""Figures of the fishtail: fits to recordings; tracking of references, errors by frequency, margins.

Data, in SI units: as `fit.part` and `control_study.part` give them.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from nectosome.identification.hysteresis.files import BENCH_UNITS
from nectosome.view.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION, Panel, dress, plain

from ..study import Sets

if TYPE_CHECKING:
    import xarray as xr

_LINES = {  # what is drawn of a fit, from behind to the front: name, colour, width, dash
    "displacement": ("recorded (synthetic)", BLACK, 3.0, "solid"),
    "ignored": ("valve's limit ignored", VERMILLION, 1.5, "solid"),
    "fitted": ("valve's limit fitted", BLUE, 1.5, "dash"),
}
_LAWS = {  # name, colour, dash
    "pid": ("PID of the paper", VERMILLION, "solid"),
    "scheduled": ("PID, gains by frequency", ORANGE, "dash"),
    "ff-pid": ("PID beside the inverse", BLUE, "solid"),
    "ilc": ("PID beside a learned feedforward", PURPLE, "dot"),
    "mpc": ("predictive", GREEN, "solid"),
}
_MM, _BAR, _MS, _DEGREES = 1e3, 1e-5, 1e3, 57.29577951308232
_FIT_EVERY, _TRACK_EVERY = 5, 4  # samples


def panels(sets: Sets) -> list[Panel]:
    """Figs. 3, 5, 6, parameters; Figs. 8 to 10, dead bands, errors by frequency, margins; those that have data."""
    drawn = {
        "fishtail_train": loops_panel,
        "fishtail_held_out": held_out_panel,
        "fishtail_areas": areas_panel,
        "fishtail_told": parameters_panel,
        "fishtail_tracks": tracks_panel,
        "fishtail_dead_bands": dead_bands_panel,
        "fishtail_bands": bands_panel,
        "fishtail_margins": margins_panel,
    }
    return [panel(sets[name]) for name, panel in drawn.items() if name in sets]


def loops_panel(found: "xr.Dataset") -> Panel:
    """Displacement over commanded pressure, a plot a frequency."""
    from plotly.subplots import make_subplots

    names = [str(x) for x in found["recording"].values]
    rows = -(-len(names) // 3)
    fig = make_subplots(rows, 3, subplot_titles=[plain(x) for x in names], shared_yaxes=True, vertical_spacing=0.14)
    for k, name in enumerate(names):
        one = found.sel(recording=name).dropna("time").isel(time=slice(None, None, _FIT_EVERY))
        for what, (label, colour, width, dash) in _LINES.items():
            line = {"color": colour, "width": width, "dash": dash}
            shown = {"mode": "lines", "name": label, "showlegend": k == 0, "legendgroup": what}
            x, y = _BAR * one["pressure"].values, _MM * one[what].values
            fig.add_scatter(x=x, y=y, line=line, row=k // 3 + 1, col=k % 3 + 1, **shown)
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
        one = found.sel(recording=name).dropna("time").isel(time=slice(None, None, _FIT_EVERY))
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


def parameters_panel(found: "xr.Dataset") -> Panel:
    """Parameters with their intervals."""
    rows = []
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        scale, unit = BENCH_UNITS[one["unit"].item()]
        value, low, high = (scale * float(one[key]) for key in ("value", "low", "high"))
        rows.append(_row(plain(name), (f"{value:#.4g}", f"{low:#.4g} to {high:#.4g}")) + f"<td>{unit}</td>")
    head = _row("parameter", ("value", "95 % interval"), "th") + "<th>unit</th>"
    caption = (
        "Of the fit with the valve's limit, to synthetic recordings. Slopes are sums of the first weights, in "
        "displacement by pressure; all must be above 0 for the hysteresis to have an inverse. Of the paper's 14 "
        "numbers 11 are identifiable: gains of hysteresis and dynamics are one, and the tenth play never moves."
    )
    return Panel("Parameters of the fishtail", caption, _table(head, rows))


def tracks_panel(found: "xr.Dataset") -> Panel:
    """Displacement, and errors, along each reference."""
    from plotly.subplots import make_subplots

    names = [str(x) for x in found["reference"].values]
    titles = [plain(x) for x in names] + [""] * len(names)
    fig = make_subplots(2, len(names), subplot_titles=titles, row_heights=[0.5, 0.5], vertical_spacing=0.1)
    for k, name in enumerate(names, start=1):
        one = found.sel(reference=name).dropna("time", subset=["target"]).isel(time=slice(None, None, _TRACK_EVERY))
        time, target = one["time"].values, _MM * one["target"].values
        line = {"color": BLACK, "width": 3}
        fig.add_scatter(x=time, y=target, line=line, mode="lines", name="reference", showlegend=k == 1, row=1, col=k)
        for law, (label, colour, dash) in _LAWS.items():
            y = _MM * one["displacement"].sel(controller=law).values
            line = {"color": colour, "width": 1.5, "dash": dash}
            shown = {"mode": "lines", "line": line, "legendgroup": law, "name": label, "col": k}
            if law in ("pid", "ff-pid"):
                fig.add_scatter(x=time, y=y, showlegend=False, row=1, **shown)
            fig.add_scatter(x=time, y=y - target, showlegend=k == 1, row=2, **shown)
    fig.update_xaxes(title="time (s)", row=2)
    fig.update_yaxes(title="displacement (mm)", row=1, col=1)
    fig.update_yaxes(title="error (mm)", row=2, col=1)
    dress(fig, 620).update_layout(showlegend=True, hovermode="closest", margin_t=80, legend_y=1.09)
    caption = (
        "Simulated: the first of the plants whose every number is drawn within 5 % of the model's, true displacement, "
        "as Figs. 8 to 10. Above the reference, the PID of the paper and the PID beside the model's inverse; below the "
        "errors of all. Rates jump where frequencies change, and the paper's PID responds with an oscillation."
    )
    return Panel("Tracking", caption, fig)


def dead_bands_panel(found: "xr.Dataset") -> Panel:
    """Errors of the paper's PID over the dead band of the valve, beside the printed ones."""
    from plotly.subplots import make_subplots

    fig = make_subplots(1, 2, subplot_titles=["rms error", "largest error"], horizontal_spacing=0.1)
    bands = _BAR * found["band"].values
    for name, colour in zip(found["reference"].values, (BLUE, VERMILLION, GREEN), strict=False):
        for col, key in enumerate(("e_rmsp", "e_mp"), start=1):
            one, label = found.sel(reference=name, error=key), plain(name)
            line, shown = {"color": colour, "width": 2}, {"legendgroup": label, "row": 1, "col": col}
            y = one["found"].values
            fig.add_scatter(x=bands, y=y, mode="lines+markers", line=line, name=label, showlegend=col == 1, **shown)
            y, line = [float(one["printed"])] * bands.size, line | {"dash": "dot"}
            label = f"{label}, printed"
            fig.add_scatter(x=bands, y=y, mode="lines", line=line, name=label, showlegend=col == 1, **shown)
    fig.update_xaxes(title="dead band to either side (bar)")
    fig.update_yaxes(title="error (% of the range)", rangemode="tozero")
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_t=90, legend_y=1.14)
    caption = (
        "Simulated: the paper's PID on the paper's model behind a valve whose pressure stays where it is until the "
        "command has gone back by twice the dead band. Where references turn round this adds an error, and brings the "
        "slow sine and the triangle nearer to what the paper measured (dotted); the varying sine gets worse by it."
    )
    return Panel("A dead band of the valve", caption, fig)


def bands_panel(found: "xr.Dataset") -> Panel:
    """Error by frequency."""
    import plotly.graph_objects as go

    fig = go.Figure()
    for law, (label, colour, dash) in _LAWS.items():
        y = found["error"].sel(controller=law).values
        line = {"color": colour, "width": 2, "dash": dash}
        fig.add_scatter(x=found["frequency"].values, y=y, mode="lines+markers", line=line, name=label)
    fig.update_xaxes(title="frequency (Hz)", type="log", tickvals=found["frequency"].values)
    fig.update_yaxes(title="rms error (% of the range)", type="log", tickvals=[0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50])
    dress(fig, 440).update_layout(showlegend=True, hovermode="closest", margin_t=60, legend_y=1.1)
    best = {
        f"{float(f):g} Hz": _LAWS[str(found["controller"].values[int(row.argmin())])][0]
        for f, row in zip(found["frequency"].values, found["error"].transpose("frequency", ...).values, strict=True)
    }
    caption = (
        "Simulated: sines of 6 mm that grow from rest, mean over the plants. Least error: "
        f"{_ranking(best)}. One set of gains serves slow references only; controllers with a model track fast ones too."
    )
    return Panel("Which controller at which frequency", caption, fig)


def _ranking(best: dict[str, str]) -> str:
    """Who is best where, in words."""
    if len(set(best.values())) == 1:
        return f"{next(iter(best.values()))} throughout"
    return "; ".join(
        f"{name} at {', '.join(f for f, one in best.items() if one == name)}" for name in dict.fromkeys(best.values())
    )


def margins_panel(found: "xr.Dataset") -> Panel:
    """Margins of gain, phase and delay."""
    sizes = [float(x) for x in found["amplitude"].values]
    rows = []
    for law in found["controller"].values:
        for k, size in enumerate(sizes):
            gain, phase, delay = (float(found[what].sel(controller=law)[k]) for what in ("gain", "phase", "delay"))
            numbers = f"{_BAR * size:g}", f"{gain:.2f}", f"{_DEGREES * phase:.0f}", f"{_MS * delay:.0f}"
            rows.append(_row(plain(_LAWS[str(law)][0]), numbers))
    heads = "amplitude (bar)", "gain margin", "phase margin (deg)", "delay margin (ms)"
    caption = (
        "Additional gain, lag or delay at which the loop becomes unstable, by first harmonics of the response of the "
        "model to sines of the command, whose hysteresis depends on their amplitude. Learning changes no margins."
    )
    return Panel("Margins of the loops", caption, _table(_row("controller", heads, "th"), rows))


def _row(name: str, numbers: Iterable[str], tag: str = "td") -> str:
    """Cells of a name and of numbers."""
    return f"<{tag}>{name}</{tag}>" + "".join(f'<{tag} class="number">{text}</{tag}>' for text in numbers)


def _table(head: str, rows: Sequence[str]) -> str:
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'
