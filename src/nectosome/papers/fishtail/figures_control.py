"""Figures of controllers: tracking of references, errors by frequency, margins.

Data, in SI units: as `papers.fishtail.tracking` gives it.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from nectosome.view.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION, Panel, dress, plain

if TYPE_CHECKING:
    import xarray as xr

Sets = Mapping[str, "xr.Dataset"]
_LAWS = {  # name, colour, dash
    "pid": ("PID of the paper", VERMILLION, "solid"),
    "scheduled": ("PID, gains by frequency", ORANGE, "dash"),
    "ff-pid": ("PID beside the inverse", BLUE, "solid"),
    "ilc": ("PID beside a learned feedforward", PURPLE, "dot"),
    "mpc": ("predictive", GREEN, "solid"),
}
_MM, _BAR, _MS, _DEGREES = 1e3, 1e-5, 1e3, 57.29577951308232
_EVERY = 4  # samples


def panels(sets: Sets) -> list[Panel]:
    """Figs. 8 to 10, errors by frequency where there are some, and margins."""
    some = [bands_panel(sets["fishtail_bands"])] if "fishtail_bands" in sets else []
    return [tracks_panel(sets["fishtail_tracks"]), *some, margins_panel(sets["fishtail_margins"])]


def tracks_panel(found: "xr.Dataset") -> Panel:
    """Displacement, and errors, along each reference."""
    from plotly.subplots import make_subplots

    names = [str(x) for x in found["reference"].values]
    titles = [plain(x) for x in names] + [""] * len(names)
    fig = make_subplots(2, len(names), subplot_titles=titles, row_heights=[0.5, 0.5], vertical_spacing=0.1)
    for k, name in enumerate(names, start=1):
        one = found.sel(reference=name).dropna("time", subset=["target"]).isel(time=slice(None, None, _EVERY))
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
            cells = "".join(f'<td class="number">{text}</td>' for text in numbers)
            rows.append(f"<tr><td>{plain(_LAWS[str(law)][0])}</td>{cells}</tr>")
    heads = "amplitude (bar)", "gain margin", "phase margin (deg)", "delay margin (ms)"
    head = "<tr><th>controller</th>" + "".join(f'<th class="number">{text}</th>' for text in heads) + "</tr>"
    caption = (
        "Additional gain, lag or delay at which the loop becomes unstable, by first harmonics of the response of the "
        "model to sines of the command, whose hysteresis depends on their amplitude. Learning changes no margins."
    )
    body = "\n".join(rows)
    text = f'<div class="wide"><table>\n<thead>{head}</thead>\n<tbody>\n{body}\n</tbody></table></div>'
    return Panel("Margins of the loops", caption, text)
