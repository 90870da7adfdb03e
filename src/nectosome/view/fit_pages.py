"""Pages of fits: of robots, of bodies in surge, of soft actuators, each beside its recordings; of gaits.

Data: as `to_dataset` of `RobotFit`, `SurgeFit`, `HysteresisFit` and `GaitResult` of `identification` has it.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.identification.hysteresis.files import BENCH_UNITS

from .markup import plain
from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREY, VERMILLION, Panel, dress, easy_unit, titled

_MM, _BAR = 1e3, 1e-5
_SHOWN = 3.0  # s of thrust and speed at first: single cycles can be seen
_LINES = {"measured": {"color": BLACK, "width": 3}, "computed": {"color": BLUE, "width": 1.5, "dash": "dash"}}


def show_robot_fit(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    shared = [name for name in found["parameter"].values if _recording_of(found, name) is None]
    scatter = (f" {words[:1].upper()}{words[1:]}." for words in json.loads(found.attrs.get("scatter", "[]")))
    _write(found, path, _parameters(found, shared) + "".join(scatter), robot_panel)


def _recording_of(found: xr.Dataset, parameter: str) -> str | None:
    """The recording whose start or clock a parameter is; None for what all have."""
    whose = parameter.partition(" of ")[2]
    return whose if whose in found["recording"].values else None


def show_surge(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    parameters = _parameters(found, ("added_mass", "drag"))
    _write(found, path, f"By {found.attrs['method']}: {parameters.replace('_', ' ')}", surge_panel)


def show_hysteresis(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with what the displacement is not linear in, and a figure for each recording.

    Raises InputError where it cannot.
    """
    names = [name for name in found["parameter"].values if not name.startswith("slope")]
    _write(found, path, _parameters(found, names, BENCH_UNITS), hysteresis_panel)


def _write(found: xr.Dataset, path: str | Path, sentence: str, panel: Callable[[xr.Dataset, int], Panel]) -> None:
    """The parameters in a sentence, the warnings, a panel for each recording."""
    warnings = [f"<p><b>Beware:</b> {plain(words)}.</p>" for words in json.loads(found.attrs["warnings"])]
    panels = [panel(found, k) for k in range(found.sizes["recording"])]
    write_page(path, str(found.attrs["title"]), [f"<p>{plain(sentence)}</p>", *warnings, *panels])


def _parameters(found: xr.Dataset, names: Iterable[str], units: Mapping[str, tuple[float, str]] | None = None) -> str:
    """Parameters with their intervals; `units` are those shown, with their sizes, by SI unit."""
    parts = []
    for name in names:
        one = found.sel(parameter=name)
        unit = one["unit"].item()
        scale, unit = (1.0, unit) if units is None else units[unit]
        value, low, high = (f"{scale * float(one[key]):.4g}" for key in ("value", "low", "high"))
        known = f" (95 %: {low} to {high})" if np.isfinite(one["low"]) else ""
        parts.append(f"{name} {value} {unit}".strip() + known)
    return f"{', '.join(parts)}."


def _recording(one: xr.Dataset) -> str:
    used = "that was fitted" if one["used"].item() == "train" else "that was not fitted"
    return f"A recording {used}, {one['recording'].item()}"


def robot_panel(found: xr.Dataset, k: int) -> Panel:
    """All columns of a recording over time, or its shapes at rest row by row; below each the error of the computed."""
    count, one = found.sizes["column"], found.isel(recording=k)
    heights = [0.65, 0.35] * count
    fig = make_subplots(2 * count, 1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.2 / (2 * count))
    errors = []
    still = bool(found["time"][found["of"].values == k].isnull().all())
    along, mode, title = ("row", "markers", "row") if still else ("time", "lines", "time (s)")
    for c, column in enumerate(map(str, found["column"].values)):
        part = found.isel(sample=np.flatnonzero((found["of"].values == k) & (found["of_column"].values == c)))
        factor, unit = easy_unit(part["measured"].values, str(found["units_of"].values[c]))
        x = part[along].values
        for name, line in _LINES.items():
            y, look = factor * part[name].values, {"line": line, "marker_color": line["color"], "mode": mode}
            fig.add_scatter(x=x, y=y, **look, name=name, showlegend=c == 0, row=2 * c + 1, col=1)
        error = factor * (part["computed"].values - part["measured"].values)
        line = {"color": BLUE, "width": 1}
        fig.add_scatter(x=x, y=error, mode=mode, line=line, showlegend=False, row=2 * c + 2, col=1)
        fig.update_yaxes(title=titled(column, unit), row=2 * c + 1)
        fig.update_yaxes(title=titled("error", unit), row=2 * c + 2)
        rms, most = (float(one[key][c]) for key in ("e_rmsp", "e_mp"))
        off = f"{rms:.3g} % of its range in the root mean square, {most:.3g} % at most"
        errors.append(f"{column} is off by {off if np.isfinite(rms) else f'{np.abs(error).max():.3g} {unit}'.strip()}")
    fig.update_xaxes(title=title, row=2 * count)
    dress(fig, 120 + 300 * count).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    name = one["recording"].item()
    own = [x for x in found["parameter"].values if _recording_of(found, x) == name]
    said = _parameters(found, own).replace(f" of {name}", "") if own else ""
    return Panel(f"Recording {name}", f"{_recording(one)}: {'; '.join(errors)}. {said}".strip(), fig)


def surge_panel(found: xr.Dataset, k: int, other: xr.Dataset | None = None, called: str = "measured") -> Panel:
    """Thrust, speed, its residual and the distance, of one recording; `other` is identified in another way."""
    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    time, measured, computed = (one[name].values for name in ("time", "measured", "computed"))
    titles = ("thrust (N)", "speed (m/s)", f"{called} - identified (m/s)", "distance (m)")
    fig = make_subplots(4, 1, vertical_spacing=0.07, row_heights=[0.22, 0.3, 0.2, 0.28])
    thin: dict[str, Any] = {"mode": "lines", "showlegend": False}
    fig.add_scatter(x=time, y=one["thrust"].values, line_color=BLACK, row=1, col=1, **thin)
    curves = [(called, measured, GREY, "solid"), ("identified", computed, BLUE, "solid")]
    if other is not None:
        theirs = other["computed"].values[other["of"].values == k]
        curves.append(("identified as printed", theirs, VERMILLION, "dash"))
    for name, speed, colour, dash in curves:
        line = {"color": colour, "dash": dash, "width": 1.5 if name == called else 2}
        fig.add_scatter(x=time, y=speed, name=name, mode="lines", line=line, row=2, col=1)
        fig.add_scatter(x=time, y=_distance(time, speed), line=line, row=4, col=1, **thin)
    fig.add_scatter(x=time, y=measured - computed, line_color=GREY, row=3, col=1, **thin)
    for row, title in enumerate(titles, start=1):
        fig.update_yaxes(title={"text": title.replace(" (", "<br>("), "font": {"size": 12}}, row=row, col=1)
    start = float(time[0])
    for row in (1, 2, 3):
        fig.update_xaxes(matches="x", range=[start, min(float(time[-1]), start + _SHOWN)], row=row, col=1)
    fig.update_xaxes(title="time (s)", row=4, col=1)
    dress(fig, 760).update_layout(showlegend=True, margin_t=60, margin_l=96)
    mean, std, most = (round(float(one[f"deviation_{name}"]), 2) + 0.0 for name in ("mean", "std", "largest"))
    caption = (
        f"{_recording(one)}. Error of the speed in percent of its root mean square: mean "
        f"{mean:.2f}, standard deviation {std:.3g}, largest {most:.3g}. The first {_SHOWN:g} s are shown; zoom out for "
        "more."
    )
    return Panel(f"Speed, {one['recording'].item()}", caption, fig)


def hysteresis_panel(found: xr.Dataset, k: int) -> Panel:
    """Displacement over pressure and over time, and the error."""
    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    specs = [[{"rowspan": 2}, {}], [None, {}]]
    fig = make_subplots(2, 2, specs=specs, column_widths=[0.4, 0.6], row_heights=[0.6, 0.4], horizontal_spacing=0.1)
    pressure, time = _BAR * one["pressure"].values, one["time"].values
    for name, line in _LINES.items():
        y = _MM * one[name].values
        fig.add_scatter(x=pressure, y=y, mode="lines", line=line, name=name, row=1, col=1)
        fig.add_scatter(x=time, y=y, mode="lines", line=line, showlegend=False, row=1, col=2)
    error = _MM * (one["computed"].values - one["measured"].values)
    fig.add_scatter(x=time, y=error, mode="lines", line={"color": BLUE, "width": 1}, showlegend=False, row=2, col=2)
    fig.update_xaxes(title="pressure (bar)", row=1, col=1)
    fig.update_yaxes(title="displacement (mm)", row=1)
    fig.update_xaxes(title="time (s)", row=2, col=2)
    fig.update_yaxes(title="error (mm)", row=2, col=2)
    dress(fig, 480).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    errors = f"{float(one['e_rmsp']):.3g} % of its range in the root mean square, {float(one['e_mp']):.3g} % at most"
    return Panel(f"Displacement, {one['recording'].item()}", f"{_recording(one)}: it is off by {errors}.", fig)


def show_thruster(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with speed, current and thrust of each table of a thruster. Raises InputError where it cannot."""
    size = f"A propeller of {1e3 * found.attrs['diameter']:.4g} mm: {_parameters(found, found['parameter'].values)}"
    _write(found, path, size, thruster_panel)


def thruster_panel(found: xr.Dataset, k: int) -> Panel:
    """Speed, current and thrust of a table over its command, as measured and as they follow from the command."""
    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    shown = {"thrust": (1.0, "N"), "speed": (30 / np.pi, "rpm"), "current": (1.0, "A")}
    fig = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05)
    looks = {
        "measured": {"mode": "markers", "marker": {"color": BLACK, "size": 6}},
        "computed": {"mode": "lines", "line": {"color": BLUE, "width": 2}},
    }
    for row, (what, (factor, unit)) in enumerate(shown.items(), start=1):
        for name, look in looks.items():
            y = factor * one[f"{name}_{what}"].values
            fig.add_scatter(x=one["duty"].values, y=y, name=name, showlegend=row == 1, row=row, col=1, **look)
        fig.update_yaxes(title=titled(what, unit), row=row, col=1)
    fig.update_xaxes(title="duty cycle", row=3, col=1)
    dress(fig, 640).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    errors = ", ".join(f"{what} {float(one[f'e_{what}']):.3g} %" for what in shown)
    return Panel(f"Table {one['recording'].item()}", f"Root mean square of the error, of the largest: {errors}.", fig)


def _distance(time: Float[np.ndarray, "n"], speed: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Distance from the first sample on: trapezoids [m]."""
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1]))])


def show_gait(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with all figures. Raises InputError where it cannot."""
    known = "".join(f"<li>{plain(words)}</li>" for words in json.loads(found.attrs["words"]))
    shown = [history_panel([found]), parameters_panel([found]), motion_panel(found)]
    write_page(path, str(found.attrs["title"]), [f"<p>Identifiability by the features:</p><ul>{known}</ul>", *shown])


def history_panel(fits: Sequence[xr.Dataset], names: Sequence[str] = ("",), printed: float | None = None) -> Panel:
    """The lowest discrepancy so far, and the printed one."""
    fig = go.Figure()
    for k, (fit, name) in enumerate(zip(fits, names, strict=True)):
        best = np.minimum.accumulate(fit["discrepancy"].values)
        line = {"color": CYCLE[k % len(CYCLE)], "shape": "hv"}
        fig.add_scatter(x=np.arange(1, best.size + 1), y=best, mode="lines", line=line, name=plain(name or "lowest"))
    if printed is not None:
        most = max(fit.sizes["evaluation"] for fit in fits)
        line = {"color": BLACK, "dash": "dot"}
        fig.add_scatter(x=[1, most], y=[printed, printed], mode="lines", line=line, name="printed")
    fig.update_xaxes(title="walks")
    fig.update_yaxes(title="lowest discrepancy (eq. 13)", type="log", exponentformat="power")
    dress(fig, 360).update_layout(showlegend=len(fits) > 1 or printed is not None, margin_t=60)
    return Panel("Search", "Sum of the squared relative errors of the features, of the best candidate so far.", fig)


def parameters_panel(fits: Sequence[xr.Dataset], names: Sequence[str] = ("",)) -> Panel:
    """Where in their ranges parameters are found, and where candidates that are as good lie."""
    fig = go.Figure()
    for k, (fit, name) in enumerate(zip(fits, names, strict=True)):
        low, size = fit["low"].values, (fit["high"] - fit["low"]).values
        place = {key: 100 * (fit[key].values - low) / size for key in ("value", "good_low", "good_high")}
        bars = {"array": place["good_high"] - place["value"], "arrayminus": place["value"] - place["good_low"]}
        rows = np.arange(fit.sizes["parameter"]) + 0.12 * (k - (len(fits) - 1) / 2)
        marker = {"color": CYCLE[k % len(CYCLE)], "size": 8}
        hover = [f"{x:.4g} {unit}" for x, unit in zip(fit["value"].values, fit["unit"].values, strict=True)]
        style = {"mode": "markers", "marker": marker, "text": hover, "hovertemplate": "%{text}<extra></extra>"}
        error = {**bars, "thickness": 2, "width": 3}
        fig.add_scatter(x=place["value"], y=rows, error_x=error, name=plain(name or "best"), **style)
    labels = [plain(str(name)) for name in fits[0]["parameter"].values]
    fig.update_yaxes(tickvals=list(range(len(labels))), ticktext=labels, autorange="reversed", zeroline=False)
    fig.update_xaxes(title="place in the range (percent)", range=(-3, 103))
    dress(fig, 140 + 34 * len(labels)).update_layout(showlegend=len(fits) > 1, margin_l=130, margin_t=60)
    caption = "Dots: the best of each search. Bars: between them lie candidates that are as good."
    return Panel("Parameters found", caption, fig)


def motion_panel(found: xr.Dataset) -> Panel:
    """Positions and tilt of the best candidate in the window, trial by trial."""
    titles = ("position z (mm)", "position x (mm)", "tilt (deg)")
    fig = make_subplots(1, 3, subplot_titles=titles, horizontal_spacing=0.07)
    for trial in range(found.sizes["trial"]):
        line = {"color": (BLUE, VERMILLION, GREY, BLACK)[trial % 4], "width": 1.5}
        one = found.isel(trial=trial)
        values = 1e3 * one["position.z"].values, 1e3 * one["position.x"].values, np.degrees(one["tilt"].values)
        for col, y in enumerate(values, start=1):
            name = f"trial {trial + 1}"
            x = found["time"].values
            fig.add_scatter(x=x, y=y, line=line, name=name, showlegend=col == 1, row=1, col=col)
    fig.update_xaxes(title="time in the window (s)")
    dress(fig, 350).update_layout(showlegend=found.sizes["trial"] > 1, margin_t=64)
    return Panel("Motion of the best candidate", "Simulated, in the last part of the walk.", fig)
