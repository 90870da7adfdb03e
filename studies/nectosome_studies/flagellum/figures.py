"""Figures of the flagellate propeller: shapes, speeds, forces along the filament, powers, strain orders, and searches.

Figures of runs are drawn here. Each dataset has a figure in another file. All numbers are SI; NaN where nothing was
found. After the bar: attributes, each of which may be absent.

- `starts` (solver, seed, start): speed, torque, seconds, evaluations, rejected | printed_speed, printed_seconds
- `history` (solver, iteration): speed, evaluations | printed_speed
- `best` (rank): L, tip_radius, alpha, omega, E, speed, torque; source, which begins with "ours" for ours; perhaps
  above_motor_line
- `map` (design, omega, young): speed, torque; perhaps here_omega, here_young (design) | torque_limit
- `sensitivity` (variable, output): percent, for one percent more of the variable | label
- `trend` (fixed, point): value, young, speed
- `composite` (rule, beta): young | target, measured, printed_beta
- `static_test` (case, marker, axis): measured, fitted; perhaps weight (case) | young, young_low, young_high, truth,
  synthetic
- `pool` (design): printed_simulated, printed_measured, ours, kind
"""

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.view import series
from nectosome.view.scenes import Actor, side_by_side
from nectosome.view.style import (
    BLUE,
    CYCLE,
    GREY,
    VERMILLION,
    Panel,
    Scenes,
    dress,
    readable,
    source_lines,
    span,
)

from ..study import Sets, drawn
from . import figures_landscape as landscape
from . import figures_prototype as prototype
from . import figures_search as search
from .axes import LineEnd, label_ends

DESIGNS = ("row1", "row2", "row3", "row4", "row5")
ORDERS = tuple(f"order{k}" for k in range(6))
ITERATIONS = ("iteration1", "iteration5", "iteration20")
_PICTURES, _SECONDS = 31, 1.5  # of a revolution, and how long it is shown
_HANDLING = "Drag to turn, scroll to come nearer; the scenes at the end of this section show each robot alone."


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """Every figure whose runs or data are there."""
    beside = ("optimum", "old_soft" if "old_soft" in runs else "row1")
    of_runs: list[tuple[tuple[str, ...], Callable[[Sets], Panel]]] = [
        (DESIGNS, shapes_panel),
        (DESIGNS, designs_panel),
        (DESIGNS[:1], thrust_panel),
        (DESIGNS[:1], power_panel),
        (ORDERS, orders_panel),
        (("old_soft", "old_rigid"), reversal_panel),
        (("flagella4",), four_panel),
        (beside, optimum_panel),
        (ITERATIONS, iterations_panel),
    ]
    of_data: list[tuple[str, Callable[[xr.Dataset], Panel]]] = [
        ("starts", search.starts_panel),
        ("history", search.history_panel),
        ("best", search.best_panel),
        ("map", landscape.map_panel),
        ("map", landscape.torque_panel),
        ("sensitivity", landscape.sensitivity_panel),
        ("trend", landscape.trend_panel),
        ("composite", prototype.composite_panel),
        ("static_test", prototype.static_test_panel),
        ("pool", prototype.pool_panel),
    ]
    return drawn(of_runs, runs) + [make(data[name]) for name, make in of_data if name in data]


def shapes_panel(runs: Sets) -> Panel:
    """The five designs side by side over one revolution of the motor."""
    begin, end = series.last_turn(runs["row1"])
    caption = (
        "Simulated shapes during the last revolution of the motor, to scale. The turning filament bends into a helix, "
        "which pushes the canister forward (left). The designs differ little. "
        f"Played about {_SECONDS / (end - begin):.1f} times slower than life. {_HANDLING}"
    )
    labels = {name: _label(runs, name) for name in DESIGNS}
    return Panel("The five designs, swimming", caption, designs_scene(runs, labels))


def designs_scene(runs: Sets, labels: Mapping[str, str]) -> Scenes:
    """Sets with a label for each, in rows of three, at the same motor angles of their last revolution."""
    actors = [
        Actor(runs[name], _revolution(runs[name]), label, colour)
        for (name, label), colour in zip(labels.items(), CYCLE, strict=False)
    ]
    return side_by_side(actors, _SECONDS)


def four_panel(runs: Sets) -> Panel:
    """Four flagella on one canister over one revolution of the motors."""
    run = runs["flagella4"]
    scene = side_by_side([Actor(run, _revolution(run), "")], _SECONDS)
    caption = (
        "Simulated robot with four flagella on one canister that is free to move and turn, during the last "
        f"revolution of its motors. It swims at {series.steady_speed(run):.3f} m/s."
    )
    return Panel("Four flagella on one canister", caption, scene)


def optimum_panel(runs: Sets) -> Panel:
    """The optimum beside the old design and the printed optimum, in 3-D."""
    caption = "Simulated shapes during the last revolution of the motor, to scale and at the same motor angle. "
    if "row1" in runs:
        caption += "The printed optimum is row 1 of Table II, its speed computed here. "
    if "on_battery" in runs:
        caption += "The best design for the paper's motor keeps within its torque-speed line at the battery's 7.4 V. "
    labels = {
        "old_soft": "old design",
        "row1": "printed optimum",
        "on_battery": "for the motor at 7.4 V",
        "optimum": "for 0.5 N m at any speed",
    }
    return _with_speeds("The optimum beside the old design", f"{caption}{search.ANY_SPEED} ", runs, labels)


def iterations_panel(runs: Sets) -> Panel:
    """Designs of a search for an optimum (Fig. 4), in 3-D."""
    caption = (
        "Simulated shapes of the designs at the 1st, 5th and 20th iteration of one search, as in Fig. 4 of the paper, "
        f"during the last revolution of the motor, to scale and at the same motor angle. {search.ANY_SPEED} "
    )
    labels = {name: f"iteration {name.removeprefix('iteration')}" for name in ITERATIONS}
    return _with_speeds("Designs of one search", caption, runs, labels)


def _with_speeds(title: str, caption: str, runs: Sets, labels: Mapping[str, str]) -> Panel:
    """Scene of the runs that are there, labelled with their steady speeds."""
    shown = [name for name in labels if name in runs]
    speeds = {name: f"{labels[name]}: {series.steady_speed(runs[name]):.3f} m/s" for name in shown}
    return Panel(title, f"{caption}Forward is left. {_HANDLING}", designs_scene(runs, speeds))


def _revolution(run: xr.Dataset) -> Float[np.ndarray, "t"]:
    return np.linspace(*series.last_turn(run), _PICTURES)


def _label(runs: Sets, name: str) -> str:
    return str(runs[name].attrs.get("label", name))


def designs_panel(runs: Sets) -> Panel:
    """Speed of the five designs against time, with the printed speeds."""
    fig = make_subplots(1, 2, subplot_titles=("from rest", "the last second, enlarged"), horizontal_spacing=0.1)
    ends, seen, errors = [], [], []
    for i, name in enumerate(DESIGNS):
        run, label, colour = runs[name], _label(runs, name), CYCLE[i]
        time, speed, steady = run["time"].values, series.swimming_speed(run), series.steady_speed(run)
        printed = float(run.attrs.get("printed_speed", np.nan))
        late = time >= time[-1] - 1
        for column, keep in ((1, slice(None)), (2, late)):
            trace = {"name": label, "line": {"color": colour}, "row": 1, "col": column}
            fig.add_scatter(x=time[keep], y=speed[keep], hovertemplate="%{y:.4f}", **trace)
        text = f"{label}: {steady:.3f}"
        if np.isfinite(printed):
            line = {"color": colour, "dash": "dash", "width": 1.2}
            trace = {"mode": "lines", "name": f"{label}, printed", "hovertemplate": "%{y:.3f}", "row": 1, "col": 2}
            fig.add_scatter(x=[max(time[0], time[-1] - 1), time[-1]], y=[printed] * 2, line=line, **trace)
            text += f" (printed {printed:.3f})"
            errors.append(100 * abs(steady / printed - 1))
        ends.append(LineEnd(steady, text, colour))
        seen += [*speed[late], printed]
    fig.update_xaxes(title="time (s)")
    fig.update_yaxes(title="swimming speed (m/s)", col=1)
    low, high = span(seen, 0.15)
    fig.update_yaxes(range=(low, high), col=2)
    height = 420
    dress(fig, height, labels=270)
    label_ends(fig, ends, (low, high), height - 86, "2")
    caption = "Simulated swimming speed (solid) of the five designs of Table II and the speeds printed there (dashed)."
    if errors:
        caption += f" The largest difference in steady speed is {max(errors):.2g} %."
    return Panel("Swimming speed of the five designs", caption, fig)


def along_filament(
    run: xr.Dataset, part: str = "filament"
) -> tuple[Float[np.ndarray, "n"], dict[str, Float[np.ndarray, "n 3"]]]:
    """Place along a part [m] and force per length of each load that acts along it [N/m], mean over the last turn.

    The components are: thrust, along world -x; radial, away from the motor's axis; tangential, about it with +x.
    """
    strips = (run["station_part"].values == part) & (run["station_weight"].values > 0)
    late = run.isel(time=series.in_last_turn(run))
    force = np.einsum("tnij,tlnj->ltni", late["rotation"].values[:, strips], late["line_force"].values[:, :, strips])
    out = late["position"].values[:, strips, 1:] - late["position"].values[:, :1, 1:]
    out /= np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-12)
    y, z = force[..., 1], force[..., 2]
    radial, tangential = y * out[..., 0] + z * out[..., 1], z * out[..., 0] - y * out[..., 1]
    mean = np.mean(np.stack([-force[..., 0], radial, tangential], axis=-1), axis=1)
    names = [str(name) for name in run["load"].values]
    return run["station_x"].values[strips], {n: f for n, f in zip(names, mean, strict=True) if np.any(np.abs(f) > 1e-9)}


def total_thrust(run: xr.Dataset, part: str = "filament") -> float:
    """Mean force of all loads on a part along world -x over the last turn [N]."""
    force = run["load_force"].sel(part=part, axis="x").values[series.in_last_turn(run)]
    return -float(force.sum(axis=1).mean())


def thrust_panel(runs: Sets) -> Panel:
    """Forces along the filament of the first design, by load."""
    run = runs["row1"]
    x, forces = along_filament(run)
    titles = ("thrust, along -x", "outwards from the motor's axis", "around the motor's axis")
    fig = make_subplots(1, 3, subplot_titles=titles, horizontal_spacing=0.07)
    for (name, force), line in zip(forces.items(), source_lines([*forces]), strict=True):
        for col, y in enumerate(force.T, start=1):
            style = {"line": line, "mode": "lines+markers", "showlegend": col == 1}
            fig.add_scatter(x=1e3 * x, y=y, name=readable(name), row=1, col=col, **style)
    fig.update_xaxes(title="position along the filament (mm)")
    fig.update_yaxes(title="force per length (N/m)", col=1)
    dress(fig, 400).update_layout(showlegend=True, legend_y=1.1, margin_t=70)
    caption = (
        f"Simulated forces of the water on the filament of {_label(runs, 'row1')}, mean over the last revolution; "
        f"its thrust is {total_thrust(run):.2f} N in all. Drag includes lift. Around the axis, positive is the sense "
        "in which the motor turns, so that negative forces are what it works against."
    )
    return Panel("Forces along the filament", caption, fig)


def power_panel(runs: Sets) -> Panel:
    """Torque of the motor and where its power goes, for the first design."""
    run = runs["row1"]
    time, torque = run["time"].values, run["reaction"].values[:, 0]
    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.08, row_heights=[0.36, 0.64])
    fig.add_scatter(x=time, y=torque, name="motor torque", line_color=BLUE, showlegend=False, row=1, col=1)
    series.add_powers(fig, run, row=2)
    fig.update_xaxes(title="time (s)", row=2)
    fig.update_yaxes(title="motor torque (N m)", row=1)
    fig.update_yaxes(title="power into the robot (W)", row=2)
    dress(fig, 560).update_layout(showlegend=True)
    steady = float(np.mean(torque[series.in_last_turn(run)]))
    caption = f"{_label(runs, 'row1')}; steady torque {steady:.3f} N m. {series.POWER_SIGN} "
    return Panel("Motor torque and power flow", caption + series.balance_sentence(run), fig)


def orders_panel(runs: Sets) -> Panel:
    """Steady speed against the order of the strain polynomials, with the increments."""
    speeds = [series.steady_speed(runs[name]) for name in ORDERS]
    gains = [100 * (b / a - 1) for a, b in pairwise(speeds)]
    fig = go.Figure(go.Scatter(x=list(range(6)), y=speeds, mode="lines+markers", line_color=BLUE, marker_size=9))
    low, high = span(speeds, 0.3)
    for k, gain in enumerate(gains, start=1):
        fig.add_annotation(x=k, y=speeds[k], text=f"{gain:+.2f} %", showarrow=False, xshift=16, yshift=18, font_size=12)
    fig.update_xaxes(title="order of the strain polynomials", dtick=1)
    fig.update_yaxes(title="steady swimming speed (m/s)", range=(low, high))
    dress(fig, 380).update_layout(hovermode="closest")
    late = 100 * (speeds[5] / speeds[3] - 1)
    caption = (
        "Simulated steady speed for the short thin filament of Fig. 3 (300 mm, tip 1 mm) with strains that are "
        "polynomials of rising order, and its increment from one order to the next; from cubic to fifth "
        f"order it changes by {late:+.2f} %."
    )
    return Panel("Convergence with the strain order", caption, fig)


def reversal_panel(runs: Sets) -> Panel:
    """Speed and thrust of the old design with a soft and with a rigid filament."""
    titles = ("swimming speed", "thrust along the filament")
    fig = make_subplots(1, 2, subplot_titles=titles, horizontal_spacing=0.1)
    speeds = {}
    for name, text, colour in (("old_soft", "soft", BLUE), ("old_rigid", "rigid (ABS)", VERMILLION)):
        run = runs[name]
        speeds[name] = series.steady_speed(run)
        x, forces = along_filament(run)
        thrust = np.sum([force[:, 0] for force in forces.values()], axis=0)
        line = {"name": text, "line": {"color": colour}}
        fig.add_scatter(x=run["time"].values, y=series.swimming_speed(run), row=1, col=1, **line)
        fig.add_scatter(x=1e3 * x, y=thrust, mode="lines+markers", showlegend=False, row=1, col=2, **line)
    for column in (1, 2):
        fig.add_hline(y=0, line={"color": GREY, "width": 1}, row=1, col=column)  # pyright: ignore
    fig.update_xaxes(title="time (s)", col=1)
    fig.update_xaxes(title="position along the filament (mm)", col=2)
    fig.update_yaxes(title="speed forward (m/s)", col=1)
    fig.update_yaxes(title="thrust per length (N/m)", col=2)
    dress(fig, 400).update_layout(showlegend=True, legend_y=1.1, margin_t=70)
    soft, rigid = speeds["old_soft"], speeds["old_rigid"]
    outcome = "the rigid one pulls it backwards" if rigid < 0 < soft else "both push it the same way"
    caption = (
        f"Simulated: with the soft filament the old 300 mm design swims at {soft:+.3f} m/s, with the rigid one at "
        f"{rigid:+.3f} m/s; {outcome}. Thrust: all loads of the water, mean over the last revolution."
    )
    return Panel("Thrust reversal: soft against rigid", caption, fig)
