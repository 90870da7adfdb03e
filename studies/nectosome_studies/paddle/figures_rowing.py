"""Figures of the rowing robot: its speed, its yaw as made, how it turns, how it holds its heading.

Data, all in SI units: `speeds` (joints, amplitude, frequency): speed, and dropped (frequency) | drop_slope; `table5`
(row): printed, ours | drag_area, coefficient; `yaw` (row, trial): yaw_mean, speed, and printed_yaw, printed_speed
(row); `servo_yaw` (differ, row, trial): the same of robots on servos; `carried` (drive, joints, share): speed;
`steering` (left): rate, radius, speed, multiplier | right; `heading` (control, ...): yaw, amplitude.
"""

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from nectosome.view.style import BLACK, BLUE, CYCLE, GREEN, VERMILLION, Panel, dress

from ..study import Sets
from .swim import drop_factor


def speeds_panel(sets: Sets) -> Panel:
    """Speed of the robot against frequency, with the printed speeds."""
    speeds, table5, fig = sets["speeds"], sets["table5"], go.Figure()
    for i, n in enumerate(speeds["joints"].values):
        for amplitude, dash in zip(speeds["amplitude"].values, ("dash", "solid"), strict=True):
            name = f"FP{n}JP, {np.degrees(amplitude):.0f} deg"
            line = {"color": CYCLE[i], "dash": dash}
            y = speeds["speed"].sel(joints=n, amplitude=amplitude).values
            fig.add_scatter(x=speeds["frequency"].values, y=y, line=line, mode="lines", name=name)
            own = (table5["joints"].values == n) & np.isclose(table5["amplitude"].values, amplitude)
            filled = "circle" if dash == "solid" else "circle-open"
            marker = {"color": CYCLE[i], "size": 11, "symbol": filled, "line": {"color": CYCLE[i], "width": 2}}
            at = {"x": table5["frequency"].values[own], "y": table5["printed"].values[own]}
            fig.add_scatter(**at, mode="markers", marker=marker, name=f"{name}, measured")
    style: Any = {"line": {"color": BLACK, "dash": "dot"}, "mode": "lines"}
    name = "FP3JP, 75 deg, with a fitted drop"
    fig.add_scatter(x=speeds["frequency"].values, y=speeds["dropped"].values, name=name, **style)
    fig.update_xaxes(title="frequency (Hz)")
    fig.update_yaxes(title="swimming speed (m/s)")
    dress(fig, 460).update_layout(showlegend=True, hovermode="closest", margin_t=84)
    caption = (
        "Simulated speed of the robot with four paddles (lines) and what the paper measured (circles, Table 5), as in "
        f"Fig. 10b. The hull's drag area, {1e4 * table5.attrs['drag_area']:.0f} cm2, is calibrated on FP3JP at 75 deg "
        f"and 1.1 Hz; all other speeds are predictions. The drag coefficient on its frontal area, "
        f"{table5.attrs['coefficient']:.2f}, is not plausible (a plate has 1.2, a spheroid 0.1): the drives are ideal "
        "here and give more thrust than servos can. Plates have no added mass, as in the paper's model. The computed "
        "speed does not drop above 1.1 Hz. At 0.3 Hz and 30 deg the robot does not move; it has the speeds printed for "
        f"that stroke at {_reached(sets)}. Dotted: no prediction; Cn falls evenly above 1.1 Hz, to "
        f"{100 * drop_factor(1.3, speeds.attrs['drop_slope']):.0f} % at 1.3 Hz, fitted to the speed there."
    )
    return Panel("Speed of the robot", caption, fig)


def _reached(sets: Sets) -> str:
    """Frequencies at which the model has the speeds that are printed for 30 deg."""
    small = sets["table5"].isel(row=np.flatnonzero(np.isclose(sets["table5"]["amplitude"], np.radians(30))))
    found = []
    for n, speed in zip(small["joints"].values, small["printed"].values, strict=True):
        line = sets["speeds"]["speed"].sel(joints=n, amplitude=np.radians(30), method="nearest")
        found.append(f"{np.interp(speed, line.values, line['frequency'].values):.2f} Hz (FP{n}JP)")
    return " and ".join(found)


def yaw_panel(sets: Sets) -> Panel:
    """Mean yaw and speed of robots as they may have been made, stroke by stroke of Table 5."""
    made, fig = sets["yaw"], make_subplots(1, 2, horizontal_spacing=0.12)
    rows, count = np.arange(made.sizes["row"]), made.sizes["trial"]
    strokes = zip(*(made[name].values for name in ("joints", "amplitude", "frequency")), strict=True)
    labels = [f"FP{n}JP<br>{np.degrees(a):.0f} deg<br>{f:g} Hz" for n, a, f in strokes]
    beside = 0.5 * (np.arange(count) - 0.5 * (count - 1)) / count
    bar = {"color": VERMILLION, "size": 26, "symbol": "line-ew", "line": {"color": VERMILLION, "width": 3}}
    for column, (own, printed) in enumerate(
        (
            (np.degrees(made["yaw_mean"].values), np.degrees(made["printed_yaw"].values)),
            (made["speed"].values, made["printed_speed"].values),
        ),
        start=1,
    ):
        style: Any = {"mode": "markers", "row": 1, "col": column, "showlegend": column == 1}
        places, dot = np.add.outer(rows, beside).ravel(), {"color": BLUE, "size": 6}
        fig.add_scatter(x=places, y=own.ravel(), marker=dot, name="robots as made, simulated", **style)
        fig.add_scatter(x=rows, y=printed, marker=bar, name="printed", **style)
    fig.update_xaxes(tickvals=rows, ticktext=labels, zeroline=False)
    fig.update_yaxes(title="mean size of the yaw angle (deg)", type="log", tickvals=[0.1, 1, 10], col=1)
    fig.update_yaxes(title="way made good (m/s)", col=2)
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_t=60, margin_b=80)
    caption = (
        "Simulated: ten seconds from rest, a dot for each robot as made: its paddles differ within tolerances set "
        "beforehand, all else is perfect. Yaw comes from these differences alone. Bars: what the paper prints for "
        "its one robot (Table 5); it repeats at 75 deg the yaw with three joints for one, which is left out."
    )
    return Panel("Yaw and speed of robots as made", caption, fig)


_DIFFER = {"all": ("all", BLACK), "paddles": ("the paddles alone", BLUE), "servos": ("the servos' speeds alone", GREEN)}


def servo_yaw_panel(sets: Sets) -> Panel:
    """Mean yaw of robots on servos as they may have been made: by all that differs, by paddles and servos alone."""
    made, fig = sets["servo_yaw"], go.Figure()
    rows, count, kinds = np.arange(made.sizes["row"]), made.sizes["trial"], made.sizes["differ"]
    strokes = zip(made["amplitude"].values, made["frequency"].values, strict=True)
    labels = [f"{np.degrees(a):.0f} deg, {f:g} Hz" for a, f in strokes]
    width = 0.25
    for k, differ in enumerate(made["differ"].values):
        name, colour = _DIFFER[str(differ)]
        beside = width * (k - 0.5 * (kinds - 1)) + 0.7 * width * (np.arange(count) - 0.5 * (count - 1)) / count
        yaw = np.degrees(made["yaw_mean"].sel(differ=differ).values)
        marker = {"color": colour, "size": 6}
        fig.add_scatter(x=np.add.outer(rows, beside).ravel(), y=yaw.ravel(), mode="markers", marker=marker, name=name)
    printed = np.degrees(made["printed_yaw"].values)
    ends = np.add.outer(rows, [-0.4, 0.4, np.nan]).ravel()  # a gap after each
    line = {"color": VERMILLION, "width": 2}
    fig.add_scatter(x=ends, y=np.repeat(printed, 3), mode="lines", line=line, name="printed")
    fig.update_xaxes(tickvals=rows, ticktext=labels, zeroline=False, range=(-0.5, rows[-1] + 0.5))
    fig.update_yaxes(title="mean size of the yaw angle (deg)", type="log", tickvals=[0.1, 0.3, 1, 3, 10, 30])
    dress(fig, 400).update_layout(showlegend=True, hovermode="closest", margin_t=60)
    mean = made["yaw_mean"].mean("trial")
    every, paddles, servos = (np.degrees(mean.sel(differ=name).values) for name in _DIFFER)
    said = "; ".join(
        f"at {f:g} Hz {every[k]:.1f} deg, {paddles[k]:.1f} deg by the paddles alone, {servos[k]:.1f} deg by the servos "
        f"alone, printed {y:.1f} deg"
        for k, (f, y) in enumerate(zip(made["frequency"].values, printed, strict=True))
    )
    caption = (
        "Simulated: ten seconds from rest of robots with three joints a paddle on servos. Besides the paddles the "
        f"servos' speeds without load differ, within 5 %, an assumption. On the mean: {said}."
    )
    return Panel("Yaw of robots on servos as made", caption, fig)


def heading_panel(sets: Sets) -> Panel:
    """Yaw under a disturbance, left alone and controlled; the strokes of the control."""
    held, fig = sets["heading"], make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.07)
    time = held["time"].values
    for name, label, colour, dash in (("none", "alone", VERMILLION, "dash"), ("PID", "controlled", BLUE, "solid")):
        yaw = np.degrees(held["yaw"].sel(control=name).values)
        fig.add_scatter(x=time, y=yaw, name=label, line={"color": colour, "dash": dash}, mode="lines", row=1, col=1)
    amplitude = np.degrees(held["amplitude"].sel(control="PID").values)
    half = np.append(np.arange(amplitude.shape[0]) * time[-1] / amplitude.shape[0], time[-1])
    for k, (side, dash) in enumerate((("left", "solid"), ("right", "dot"))):
        y = np.append(amplitude[:, k], amplitude[-1, k])
        line = {"color": CYCLE[2 + k], "dash": dash, "shape": "hv"}
        fig.add_scatter(x=half, y=y, name=f"{side} side", line=line, mode="lines", row=2, col=1)
    fig.update_xaxes(title="time (s)", row=2)
    fig.update_yaxes(title="yaw (deg)", row=1)
    fig.update_yaxes(title="amplitude (deg)", row=2)
    dress(fig, 520).update_layout(showlegend=True, margin_t=60)
    late = np.degrees(held["yaw"].sel(control="PID").values[time > 0.5 * time[-1]])
    caption = (
        "Simulated: the robot with one joint a paddle at 1.1 Hz, with a steady moment of 0.01 N m on its hull and one "
        "paddle whose drag is a tenth less. The control sees the IMU every 0.1 s and sets the next half stroke of each "
        f"side. In the second half of the swim its yaw is {late.mean():.1f} deg on the mean and "
        f"{np.abs(late).max():.1f} deg at most."
    )
    return Panel("Heading held by strokes", caption, fig)
