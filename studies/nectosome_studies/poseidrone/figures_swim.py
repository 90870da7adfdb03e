"""Figures of PoseiDRONE's swimming: estimators of mass and drag; its jet, held still and swimming free.

Data, in SI units: `swim` as a dataset of `identification.SurgeFit` has it; `swim_as_printed`, by the printed estimator;
`swim_draws` as `swim.draws` and `static_free` as `static_free.compared` give them.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.view.fit_pages import surge_panel
from nectosome.view.style import BLACK, BLUE, CYCLE, GREEN, GREY, ORANGE, VERMILLION, Panel, dress, plain, readable

from .. import charts
from ..study import Sets

if TYPE_CHECKING:
    import xarray as xr

_MOST = 50.0  # percent, of errors that are shown
_SHOWN = 4  # turns of the crank
_ROWS = (
    ("speed", "speed (rad/s)", 1.0, VERMILLION),
    ("current", "current (A)", 1.0, ORANGE),
    ("thrust", "thrust (N)", 1.0, BLUE),
    ("volume", "volume (mL)", 1e6, GREEN),
)


def panels(sets: Sets) -> list[Panel]:
    """Figs. 9 and 10 on synthetic recordings, and the estimators."""
    found, other = sets["swim"], sets["swim_as_printed"]
    shown = [surge_panel(found, k, other, "synthetic") for k in range(found.sizes["recording"])]
    note = " The paper published no recordings: this one is synthetic."
    named = zip(shown, ("Fig. 9", "Fig. 10"), strict=True)
    shown = [panel._replace(title=f"{panel.title}, as {f}", caption=panel.caption + note) for panel, f in named]
    return [*shown, estimators_panel(sets["swim_draws"])]


def estimators_panel(made: "xr.Dataset") -> Panel:
    """Errors of each estimator over many draws of noise, and the coverage of its intervals."""
    from plotly.subplots import make_subplots

    names = [str(name) for name in made["parameter"].values]
    estimators = [str(estimator) for estimator in made["estimator"].values]
    fig = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03, column_widths=[0.37, 0.37, 0.26])
    off = 100 * (made["value"] / made["truth"] - 1)
    for col, name in enumerate(names, start=1):
        for k, estimator in enumerate(estimators):
            x = off.sel(parameter=name, estimator=estimator).values
            box: dict[str, Any] = {"boxpoints": False, "boxmean": True, "line_color": CYCLE[k % len(CYCLE)]}
            fig.add_box(x=x, y=[plain(estimator)] * x.size, orientation="h", **box, row=1, col=col)
        fig.update_xaxes(title=f"error of {readable(name)} (percent)", row=1, col=col)
        fig.update_xaxes(range=[-15, _MOST], row=1, col=col)
    for name, colour, symbol in zip(names, (BLUE, ORANGE), ("circle", "diamond"), strict=True):
        marker = {"color": colour, "size": 10, "symbol": symbol}
        x, y = made["coverage"].sel(parameter=name).values, [plain(estimator) for estimator in estimators]
        fig.add_scatter(x=x, y=y, mode="markers", marker=marker, name=f"coverage, {readable(name)}", row=1, col=3)
    fig.add_vline(x=95, line={"color": BLACK, "dash": "dash", "width": 1}, row=1, col=3)  # pyright: ignore[reportArgumentType]
    fig.update_xaxes(title="coverage (percent)", range=[-4, 104], row=1, col=3)
    fig.update_yaxes(autorange="reversed")
    beyond = [
        f" Not shown: a mean error of {readable(name)} of {x:.0f} % ({estimator})."
        for estimator in estimators
        for name in names
        if (x := float(made["bias"].sel(estimator=estimator, parameter=name))) > _MOST
    ]
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_l=170, margin_t=50)
    fig.for_each_trace(lambda trace: trace.update(showlegend=trace.type == "scatter"))
    caption = (
        f"Synthetic recordings, {made.sizes['draw']} draws of noise: errors of the estimates (half of them in the box, "
        "dashed: the mean), and coverage, the share of 95 % intervals that contain the true value. As printed: eqs. 4 "
        f"to 9 behind a Savitzky-Golay filter on the speed alone.{''.join(beyond)}"
    )
    return Panel("Errors of the estimators", caption, fig)


def jet_panels(sets: Sets) -> list[Panel]:
    """Fig. 8, and the comparison of section 5."""
    return [motor_panel(sets), charts.panels("poseidrone", sets)["Thrust held still and swimming free"]]


def motor_panel(sets: Sets) -> Panel:
    """Motor speed, current, thrust and volume over time, as in Fig. 8."""
    from plotly.subplots import make_subplots

    found = sets["static_free"]
    turns = found["motor_angle"].values / (2 * np.pi)
    last = turns >= np.floor(turns[-1]) - _SHOWN
    time = found["motor_time"].values[last]
    fig = make_subplots(len(_ROWS), 1, shared_xaxes=True, vertical_spacing=0.04)
    for row, (name, title, scale, colour) in enumerate(_ROWS, start=1):
        y = scale * found[f"motor_{name}"].values[last]
        fig.add_scatter(x=time, y=y, mode="lines", line={"color": colour}, row=row, col=1)
        fig.update_yaxes(title=title, row=row)
    for half in np.arange(np.ceil(2 * turns[last][0]), 2 * turns[-1]):
        x, dash = np.interp(0.5 * half, turns, found["motor_time"].values), "dot" if half % 2 else "solid"
        fig.add_vline(x=x, line={"color": GREY, "dash": dash, "width": 1})
    fig.update_xaxes(title="time (s)", row=len(_ROWS))
    dress(fig, 640)
    thrust, angle = found["motor_thrust"].values[last], np.degrees(found["motor_angle"].values[last]) % 360
    caption = (
        "Simulated: the robot held still, its crank turned by a motor, as in Fig. 8. Lines at 0 deg, dotted at 180 "
        "deg. The chamber is synthetic, made for a thrust that fits what the paper prints; the numbers of motor and "
        f"shell are assumptions. Thrust peaks at {angle[np.argmax(thrust)]:.0f} deg, the motor is slowest at "
        f"{angle[np.argmin(found['motor_speed'].values[last])]:.0f} deg; while the chamber fills, thrust is negative."
    )
    return Panel("Motor, chamber and thrust of the held robot", caption, fig)
