"""Figures of measurements: friction of actuators on strokes out and back, swimming of fish against speed."""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.style import BLUE, GREEN, GREY, VERMILLION, Panel, dress, plain, span

from .. import charts
from ..study import Sets

if TYPE_CHECKING:
    import xarray as xr

_MODELS = {
    "dahl": ("Dahl, over the distance", VERMILLION, "dash"),
    "dahl-pressure": ("Dahl, with the pressure", BLUE, "solid"),
}


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """All figures.

    `pneumatic_*` (run, stroke, place), `friction_*` (model, sample), `catshark` (speed_class, quartile).
    """
    tests = {name.removeprefix("pneumatic_"): d for name, d in data.items() if name.startswith("pneumatic_")}
    fits = {name.removeprefix("friction_"): d for name, d in data.items() if name.startswith("friction_")}
    return [_friction(tests, data), _fitted(fits), *charts.panels("measure", data).values()]


def _friction(tests: Sets, data: Sets) -> Panel:
    """Pull against distance, every run; friction and lost work by run beside it."""
    from plotly.subplots import make_subplots

    fig = make_subplots(
        rows=len(tests),
        cols=2,
        column_widths=[0.62, 0.38],
        horizontal_spacing=0.11,
        vertical_spacing=0.16,
        subplot_titles=[title for name in tests for title in (f"{plain(name)}: every run", f"{plain(name)}: friction")],
    )
    words = []
    for k, (name, test) in enumerate(tests.items(), start=1):
        x = 1e3 * test["place"].values
        for w, (stroke, colour) in enumerate((("out", BLUE), ("back", VERMILLION))):
            for i, y in enumerate(test["pull"].values[:, w]):
                style = {"color": colour, "width": 1.2, "dash": "solid" if stroke == "out" else "dash"}
                shown = i == 0 and k == 1
                fig.add_scatter(x=x, y=y, line=style, name=f"stroke {stroke}", showlegend=shown, row=k, col=1)
        runs, friction = np.arange(1, test.sizes["run"] + 1), test["friction"].values
        marks = {"color": GREEN, "size": 8}
        fig.add_scatter(x=runs, y=friction, mode="markers", marker=marks, showlegend=False, row=k, col=2)
        mean = {"x": runs[[0, -1]], "y": [friction.mean()] * 2, "line": {"color": GREY, "dash": "dot"}}
        fig.add_scatter(**mean, mode="lines", showlegend=False, row=k, col=2)
        fig.update_yaxes(title="pull (N)", row=k, col=1)
        fig.update_yaxes(title="friction (N)", rangemode="tozero", row=k, col=2)
        loss = test["loop_area"].values
        words.append(
            f"{name}: friction {friction.mean():.2f} N (standard deviation of the runs {friction.std(ddof=1):.2f} N), "
            f"work lost in a run {1e3 * loss.mean():.0f} mJ ({1e3 * loss.std(ddof=1):.0f} mJ), "
            f"{_calibrated(data[f'calibration_{name}'])}"
        )
    fig.update_xaxes(title="drawn out (mm)", row=len(tests), col=1)
    fig.update_xaxes(title="run", dtick=1, row=len(tests), col=2)
    dress(fig, 300 * len(tests) + 80).update_layout(showlegend=True, hovermode="closest", margin_t=64)
    fig.update_layout(legend={"yref": "container", "y": 1.0, "yanchor": "top"})
    caption = (
        "Measured by E. Zillen: pull on a pneumatic actuator at 3 bar against how far it is drawn out, ten runs. Half "
        "of the difference between both strokes is friction. " + " ".join(words)
    )
    return Panel("Friction of pneumatic actuators", caption, fig)


def _fitted(fits: Sets) -> Panel:
    """A run held out, and the predictions of the models."""
    from plotly.subplots import make_subplots

    titles = [f"{plain(name)}: run {fit.attrs['run']}, held out" for name, fit in fits.items()]
    fig = make_subplots(rows=1, cols=len(fits), horizontal_spacing=0.09, subplot_titles=titles)
    words = []
    for col, (name, fit) in enumerate(fits.items(), start=1):
        x = 1e3 * fit["distance"].values
        first = {"showlegend": col == 1, "mode": "lines", "row": 1, "col": col}
        fig.add_scatter(x=x, y=fit["measured"], name="measured", line={"color": GREY, "width": 4}, **first)
        for model, (label, colour, dash) in _MODELS.items():
            line = {"color": colour, "width": 2, "dash": dash}
            fig.add_scatter(x=x, y=fit["predicted"].sel(model=model), name=label, line=line, **first)
        fig.update_xaxes(title="drawn out (mm)", range=span(x.tolist()), row=1, col=col)
        limit, half = fit["value"].sel(parameter="limit").values, fit["half"].sel(parameter="limit").values
        left = fit["held_out"].values
        words.append(
            f"{name}: sliding friction {limit[0]:.2f} ± {half[0]:.2f} N, with the pressure's pull separate "
            f"{limit[1]:.2f} ± {half[1]:.2f} N; error on the runs held out {left[0]:.1f} % and {left[1]:.1f} % of the "
            f"range of the pull, {fit.attrs['curve']:.0f} % without friction, {fit.attrs['repeat']:.1f} % by the mean "
            "of the other runs."
        )
    fig.update_yaxes(title="pull (N)", row=1, col=1)
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_t=72)
    fig.update_layout(legend={"yref": "container", "y": 1.0, "yanchor": "top"})
    correlation = min(float(fit["correlation"].min()) for fit in fits.values())
    caption = (
        "Dahl's friction fitted to runs 1, 3, 5, 7 and 9 of the measured pull, the others held out. Over the distance "
        "alone a straight line stands beside it; with the measured pressure, which is higher on the stroke out, an "
        f"area does. Residuals of neighbouring samples correlate ({correlation:.2f} and more): intervals (95 %) are "
        "the scatter of the runs, each fitted alone. " + " ".join(words)
    )
    return Panel("Friction identified, runs held out", caption, fig)


def _calibrated(sensors: "xr.Dataset") -> str:
    """How well volts and physical columns go together."""
    k = list(sensors["sensor"].values).index("force_sensor")
    one = sensors.isel(sensor=k)
    return f"load cell {float(one['gain']):.2f} N/V with {1e3 * float(one['residual_rms']):.0f} mN rms left."
