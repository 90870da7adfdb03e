"""Figures of paddles: thrust on a load cell over strokes, joints and hinges; cycles and shapes.

Data, all in SI units: `strokes` (joints, amplitude, frequency) and `joints` (joints): thrust, power, thrust_per_power,
servo_speed | servo_speed_limit; `hinges` (thickness, length): thrust, power, stress, front_power, front_stress |
own_thickness, own_length; `best` (chosen), `front_power` and `front_stress` (level): designs between these points.
Runs: cycles `n1_1.1Hz` and so on. Those of swims are in `figures_rowing.py`, of corrections in `figures_transfer.py`.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.view.heatmap import LevelLine, MapAxis, diverging, maps, sequential
from nectosome.view.style import BLACK, BLUE, CYCLE, GREY, VERMILLION, Panel, dress, span

from .. import charts
from ..study import Sets, drawn
from .figures_rowing import heading_panel, servo_yaw_panel, speeds_panel, yaw_panel
from .figures_transfer import errors_panel, maps_panel, plans_panel, recipes_panel, truths_panel

_SERVO, _CELL = "arm.angle", "body.y"
_DASHES = ("solid", "dash", "dot", "dashdot")


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """Every figure whose data or runs are there."""
    makers: list[tuple[tuple[str, ...], Callable[[Sets], Panel]]] = [
        (("n1_1.1Hz", "n2_1.1Hz", "n3_1.1Hz"), series_panel),
        (("strokes",), thrust_panel),
        (("strokes",), differences_panel),
        (("strokes",), per_power_panel),
        (("joints",), joints_panel),
        (("n1_0.6Hz", "n2_0.6Hz", "n3_0.6Hz"), angles_panel),
        (("n3_0.6Hz",), shapes_panel),
        (("hinges",), hinges_panel),
        (("speeds", "table5"), speeds_panel),
        (("carried",), lambda sets: charts.panels("paddle", sets)["Water that the plates carry along"]),
        (("yaw",), yaw_panel),
        (("servo_yaw",), servo_yaw_panel),
        (("steering",), lambda sets: charts.panels("paddle", sets)["Turning by unequal strokes"]),
        (("heading",), heading_panel),
        (("transfer",), recipes_panel),
        (("transfer",), errors_panel),
        (("transfer",), truths_panel),
        (("transfer_maps",), maps_panel),
        (("transfer_plans",), plans_panel),
    ]
    return drawn(makers, {**data, **runs})


def series_panel(sets: Sets) -> Panel:
    """Thrust against time for one, two and three joints, over two cycles."""
    titles = ("load cell", "water on the paddle, without inertia and stops")
    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.09, subplot_titles=titles)
    for i, n in enumerate((1, 2, 3)):
        run = sets[f"n{n}_1.1Hz"]
        water = -run["load_force"].sel(axis="y").sum(("load", "part")).values
        line = {"color": CYCLE[i], "dash": _DASHES[i]}
        for row, force in ((1, run["reaction"].sel(prescribed=_CELL).values), (2, water)):
            x, y = _twice(run["time"].values, force)
            fig.add_scatter(x=x, y=y, line=line, name=_joints(n), showlegend=row == 1, row=row, col=1)
    fig.update_xaxes(title="time (s)", row=2)
    fig.update_yaxes(title="thrust (N)")
    dress(fig, 560).update_layout(showlegend=True, margin_t=70, legend_y=1.06)
    caption = (
        "Simulated thrust at 75 deg and 1.1 Hz, as in Fig. 9a: the cycle that the paddle keeps, drawn twice. In the "
        "power stroke all lie flat against their stops and push alike; in the recovery stroke they fold. The load cell "
        "also feels the segments' inertia and the blow with which they come back to their stops."
    )
    return Panel("Thrust over two cycles", caption, fig)


def _twice(time: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([time[:-1], time[-1] + time]), np.concatenate([y[:-1], y])


def _joints(n: int) -> str:
    return f"FP{n}JP ({n} joint{'s' if n > 1 else ''})"


def thrust_panel(sets: Sets) -> Panel:
    """Mean thrust over amplitude and frequency."""
    strokes = sets["strokes"]
    thrust = strokes["thrust"]
    shown = {_joints(n): thrust.sel(joints=n) for n in thrust["joints"].values}
    fig = _stroke_maps(strokes, shown, sequential, "N", best=True)
    followed = thrust.where(strokes["servo_speed"] <= strokes.attrs["servo_speed_limit"])
    caption = (
        f"Computed mean thrust, as in Figs. 5 and 9b. The largest is {_largest(thrust)}. The model has no drop above "
        f"1.1 Hz, which the paper measured. {_limit(strokes)} Of the strokes below it the best gives "
        f"{_largest(followed)}.{_between(sets)}"
    )
    return Panel("Mean thrust by stroke", caption, fig)


def _between(sets: Sets) -> str:
    """The best strokes between the points of the grid."""
    if "best" not in sets:
        return ""
    own, all_chosen = (sets["best"].sel(chosen=name) for name in ("stroke", "stroke and hinges"))

    def stroke(row: xr.Dataset) -> str:
        at = f"{np.degrees(float(row['A'])):.1f} deg and {float(row['f']):.3g} Hz"
        return f"{float(row['thrust']):.3f} N at {at} for {float(row['power']):.2f} W"

    layer = " and ".join(f"{1e3 * float(all_chosen[name]):.3g} mm {word}" for name, word in _LAYER.items())
    return (
        f" Between the points, by exact derivatives, it is {stroke(own)}; with flexible layers chosen too, "
        f"{stroke(all_chosen)}, with layers {layer}."
    )


_LAYER = {"thickness": "thick", "length": "long"}


def _largest(thrust: xr.DataArray) -> str:
    """Largest thrust and where it is, in words."""
    best = thrust.isel(thrust.argmax(("joints", "amplitude", "frequency")))
    amplitude, frequency = np.degrees(float(best["amplitude"])), float(best["frequency"])
    return f"{float(best):.3f} N, FP{int(best['joints'])}JP at {amplitude:.0f} deg and {frequency:g} Hz"


def _limit(strokes: xr.Dataset) -> str:
    """Meaning of the dotted line."""
    limit = 60 / (2 * np.pi) * strokes.attrs["servo_speed_limit"]
    return f"Above the dotted line the stroke asks for more speed than the servo has without load, {limit:.0f} rpm."


def differences_panel(sets: Sets) -> Panel:
    """Effect of one joint more or less than two on the thrust."""
    strokes = sets["strokes"]
    one, two, three = (strokes["thrust"].sel(joints=n) for n in (1, 2, 3))
    shown = {"FP3JP minus FP2JP": three - two, "FP1JP minus FP2JP": one - two}
    fig = _stroke_maps(strokes, {name: 1e3 * x for name, x in shown.items()}, diverging, "mN")
    against = int((one >= two).sum() + (two >= three).sum())
    caption = (
        "Computed differences of mean thrust, as in Fig. 9c: blue where the paddle thrusts more than the one with two "
        f"joints, orange where less. {'Everywhere' if not against else f'At all but {against} points of the grid'} "
        f"more joints give more thrust. {_limit(strokes)}"
    )
    return Panel("Effect of one joint more or less", caption, fig)


def per_power_panel(sets: Sets) -> Panel:
    """Thrust for each watt of the servo."""
    strokes = sets["strokes"]
    ratio = strokes["thrust_per_power"]
    shown = {_joints(n): ratio.sel(joints=n) for n in ratio["joints"].values}
    fig = _stroke_maps(strokes, shown, sequential, "N/W", best=True)
    caption = (
        "Computed mean thrust for each watt of the servo's mean mechanical power: the efficiency of a paddle that is "
        "held, which does no work on its mount. Slow and small strokes hardly bend the joints against their springs; "
        f"in large and fast ones power outgrows thrust, as the cube of speed its square. {_limit(strokes)}"
    )
    return Panel("Thrust for power", caption, fig)


def _stroke_maps(
    strokes: xr.Dataset,
    shown: Mapping[str, xr.DataArray],
    colours: Callable[[np.ndarray, str], dict[str, Any]],
    unit: str,
    best: bool = False,
) -> go.Figure:
    order = ("amplitude", "frequency")
    values = {title: x.transpose(*order).values for title, x in shown.items()}
    speed = strokes["servo_speed"].isel(joints=0).transpose(*order).values
    limit = LevelLine(speed, strokes.attrs["servo_speed_limit"], "servo's speed without load")
    x = MapAxis(strokes["frequency"].values, "frequency (Hz)")
    y = MapAxis(np.degrees(strokes["amplitude"].values), "amplitude (deg)")
    return maps(x, y, values, colours(np.stack(list(values.values())), unit), [limit], best)


def joints_panel(sets: Sets) -> Panel:
    """Mean thrust against the number of joints; the gain by each one more."""
    thrust = sets["joints"]["thrust"].squeeze()
    n, y = thrust["joints"].values, thrust.values
    fig = make_subplots(1, 2, horizontal_spacing=0.1, subplot_titles=("from a rigid plate on", "with joints, enlarged"))
    for col, keep in ((1, slice(None)), (2, slice(1, None))):
        style = {"mode": "lines+markers", "line_color": BLUE, "marker_size": 9, "hovertemplate": "%{x}: %{y:.4f} N"}
        fig.add_scatter(x=n[keep], y=y[keep], row=1, col=col, **style)
    for k in range(2, len(n)):
        text = f"{100 * (y[k] / y[k - 1] - 1):+.2f} %"
        fig.add_annotation(x=n[k], y=y[k], text=text, showarrow=False, xshift=30, yshift=-9, xref="x2", yref="y2")
    fig.update_xaxes(title="joints", dtick=1)
    fig.update_yaxes(range=span(y[1:].tolist(), 0.15), col=2)
    fig.update_yaxes(title="mean thrust (N)", col=1)
    fig.update_xaxes(range=(0.7, n[-1] + 0.7), col=2)
    dress(fig, 400).update_layout(hovermode="closest", margin_t=60)
    caption = (
        "Computed mean thrust at 75 deg and 1.1 Hz of paddles of one length and mass cut into more and more segments, "
        "and what each joint more adds; section 6.1 reports a slow gain with four and five joints. A rigid plate has "
        "none."
    )
    return Panel("Thrust by number of joints", caption, fig)


def angles_panel(sets: Sets) -> Panel:
    """Joint angles over a cycle at 0.6 Hz and the servo's angle."""
    counts = (1, 2, 3)
    fig = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03, subplot_titles=[_joints(n) for n in counts])
    for col, n in enumerate(counts, start=1):
        run = sets[f"n{n}_0.6Hz"]
        time = run["time"].values
        where: Any = {"row": 1, "col": col}
        servo = {"line": {"color": GREY, "dash": "dashdot"}, "name": "servo", "showlegend": col == 3}
        fig.add_scatter(x=time, y=_servo_angle(run), **servo, **where)
        for i in range(n):
            line = {"color": CYCLE[i], "dash": _DASHES[i]}
            angle = np.degrees(run["q"].values[:, i])
            fig.add_scatter(x=time, y=angle, line=line, name=f"joint {i + 1}", showlegend=col == 3, **where)
    fig.update_xaxes(title="time (s)")
    fig.update_yaxes(dtick=30)
    fig.update_yaxes(title="angle (deg)", col=1)
    dress(fig, 420).update_layout(showlegend=True, margin_t=70, legend_y=1.08)
    caption = (
        "Simulated angles of the joints over a cycle at 0.6 Hz and 75 deg, as in Figs. 4b to 4d, and the servo's "
        "command. Joints bend in the recovery stroke, while the servo's angle falls, and lie against their stops at 0 "
        "deg in the power stroke."
    )
    return Panel("Joint angles over a cycle", caption, fig)


def _servo_angle(run: xr.Dataset) -> Float[np.ndarray, "t"]:
    """Angle of the arm [deg]."""
    arm = int(np.flatnonzero(run["station_part"].values == "arm")[0])
    rotation = run["rotation"].values[:, arm]
    return np.degrees(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]))


def shapes_panel(sets: Sets) -> Panel:
    """Shapes of the paddle with three joints over a cycle: both strokes side by side to scale; later is darker."""
    run, titles = sets["n3_0.6Hz"], ("power stroke (counter-clockwise)", "recovery stroke (clockwise)")
    fig = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.03, subplot_titles=titles)
    points, time = 1e3 * chain(run), run["time"].values
    for col, (instants, colour) in enumerate(zip(strokes(run, _SERVO), (BLUE, VERMILLION), strict=True), start=1):
        where: Any = {"row": 1, "col": col}
        style: Any = {
            "mode": "lines",
            "line": {"color": colour, "width": 3},
            "hovertemplate": "(%{x:.0f}, %{y:.0f}) mm",
        }
        for k, opacity in zip(instants, np.linspace(0.25, 1.0, len(instants)), strict=True):
            x, y = points[k].T
            fig.add_scatter(x=x, y=y, opacity=opacity, name=f"{time[k]:.3f} s", **style, **where)
        x, y = points[instants, -1].T
        dots = {"color": colour, "size": 6}
        fig.add_scatter(x=x, y=y, mode="markers", marker=dots, hoverinfo="skip", **where)
    fig.update_xaxes(title="x (mm)", matches="x", constrain="domain")
    fig.update_yaxes(title="y (mm)", scaleanchor="x", constrain="domain", col=1)
    dress(fig, 600).update_layout(hovermode="closest", margin_t=60)
    caption = (
        "Simulated shapes of FP3JP at 0.6 Hz and 75 deg from above, as in Fig. 4e, at instants evenly spread in time, "
        "the later the darker; dots: the tip. The arm turns about (0, 0); on the mean the paddle pushes its mount "
        "towards -y."
    )
    return Panel("Shapes over a cycle", caption, fig)


def chain(run: xr.Dataset) -> Float[np.ndarray, "t n 2"]:
    """Points of a chain in the plane [m] from root to tip: its stations in the order of parts and along them."""
    parts = [str(part) for part in run["part"].values]
    stations = zip(run["station_part"].values, run["station_x"].values, strict=True)
    places = [(parts.index(str(part)), x) for part, x in stations]
    return run["position"].values[:, sorted(range(len(places)), key=places.__getitem__), :2]


def strokes(run: xr.Dataset, drive: str, most: int = 7) -> list[np.ndarray]:
    """Samples of the stroke in which a drive goes forward, and of the stroke back; at most so many of each."""
    forward = run["drive_velocity"].sel(prescribed=drive).values[:-1] > 0
    found = []
    for stroke in (forward, ~forward):
        first = int(np.flatnonzero(stroke & ~np.roll(stroke, 1))[0])
        steps = np.linspace(0, int(stroke.sum()) - 1, most).round().astype(int)
        found.append((first + np.unique(steps)) % forward.size)
    return found


def hinges_panel(sets: Sets) -> Panel:
    """Thrust against power and stress over hinges, with the fronts: designs that no other one beats in both.

    Designs that a search found between the points of the grid make the front where they are given.
    """
    hinges = sets["hinges"].stack(design=("thickness", "length"))
    thickness, length = (1e3 * hinges[name].values for name in ("thickness", "length"))
    names, thrust = _layers(hinges), hinges["thrust"].values
    own = [np.isclose(1e3 * hinges[name], 1e3 * hinges.attrs[f"own_{name}"]) for name in ("thickness", "length")]
    published = np.flatnonzero(np.all(own, axis=0))
    fig = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.05)
    for col, (cost, title, unit) in enumerate(_COSTS, start=1):
        where: Any = {"row": 1, "col": col, "showlegend": col == 1, "hovertemplate": "%{text}<br>%{x:.4g}, %{y:.4g}"}
        x, dots = unit * hinges[cost].values, {"color": "#9fb4c7", "size": 6}
        fig.add_scatter(x=x, y=thrust, mode="markers", marker=dots, text=names, name="designs", **where)
        front = sets.get(f"front_{cost}", hinges.isel(design=hinges[f"front_{cost}"].values)).sortby(cost)
        style = {"line": {"color": VERMILLION, "width": 1.6}, "marker": {"color": VERMILLION, "size": 8}}
        style |= {"mode": "lines+markers", "text": _layers(front), "name": "front"}
        fig.add_scatter(x=unit * front[cost].values, y=front["thrust"].values, **style, **where)
        if published.size:
            star = {"symbol": "star", "size": 16, "color": "white", "line": {"color": BLACK, "width": 1.5}}
            here = {"x": x[published], "y": thrust[published], "text": names[published]}
            fig.add_scatter(**here, mode="markers", marker=star, name="as published", **where)
        fig.update_xaxes(title=title, row=1, col=col)
    fig.update_yaxes(title="mean thrust (N)", col=1)
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", legend_y=1.02, margin_t=60)
    most = int(np.argmax(thrust))
    lead = f"{thrust[most]:.3f} N at {hinges['power'].values[most]:.2f} W"
    caption = (
        f"Computed: FP3JP at 75 deg and 1.1 Hz with {len(names)} flexible layers, {thickness.min():g} to "
        f"{thickness.max():g} mm thick and {length.min():g} to {length.max():g} mm long, all joints alike. On the red "
        "line no other layer thrusts more for as little power (left) or stress (right). Thrust and power depend on the "
        "joints' stiffness alone (eq. 16); of layers of one stiffness the thick and long bear the least stress. Most "
        f"thrust: {lead}, {names[most]}."
    )
    return Panel("Thrust, power and stress by hinge", caption, fig)


_COSTS = (("power", "mean power of the servo (W)", 1.0), ("stress", "largest stress in a hinge (kPa)", 1e-3))


def _layers(designs: xr.Dataset) -> np.ndarray:
    """Flexible layers of designs in words."""
    sizes = zip(1e3 * designs["thickness"].values, 1e3 * designs["length"].values, strict=True)
    return np.array([f"{thickness:.3g} mm thick, {length:.4g} mm long" for thickness, length in sizes])
