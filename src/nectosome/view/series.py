"""What a run does over time: its track, speed, forces, powers and energies, as numbers and figures; for any robot."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Bool, Float

from nectosome.description import DIRECTIONS
from nectosome.solve.mean_window import mean_of, mean_window

from .style import BLACK, BLUE, CYCLE, GREEN, ORANGE, PURPLE, VERMILLION, Panel, dress, readable, source_lines, span

_DRIVES = 6  # lines of drives in a figure: more hide each other
_STAYS = 1e-9  # m


def swimming_speed(run: xr.Dataset) -> Float[np.ndarray, "t"]:
    """Speed of the body towards -x [m/s], which is forward."""
    return -run["velocity"].isel(part=0).sel(axis="x").values


def drive_rate(run: xr.Dataset) -> float:
    """Rate of the first prescribed coordinate at the end of the run [rad/s]; NaN where none turns."""
    if run.sizes["prescribed"] == 0 or run["reaction"].values[-1, 0] == 0:
        return float("nan")
    return abs(float(run["reaction_power"].values[-1, 0] / run["reaction"].values[-1, 0]))


def last_turn(run: xr.Dataset) -> tuple[float, float]:
    """Start and end [s] of what means are over (`mean_window`)."""
    return mean_window(run["time"].values, run.attrs).start, float(run["time"].values[-1])


def in_last_turn(run: xr.Dataset) -> Bool[np.ndarray, "t"]:
    """Which saved times lie in it."""
    return run["time"].values >= last_turn(run)[0] - 1e-9


def steady_speed(run: xr.Dataset) -> float:
    """Mean speed of the body towards -x over it [m/s]."""
    return float(np.mean(swimming_speed(run)[in_last_turn(run)]))


def powers(run: xr.Dataset) -> dict[str, Float[np.ndarray, "t"]]:
    """Power into the robot [W] of each drive and of each load that does any work, by name.

    A prescribed strain of a rod is one drive. Of many drives the largest ones have their own, and the others a sum.
    """
    drives = dict[str, np.ndarray]()
    for name, power in zip(map(str, run["prescribed"].values), run["reaction_power"].values.T, strict=True):
        whole, _, last = name.rpartition(".")
        drive = f"drive of {whole if last.isdigit() else name}"
        drives[drive] = drives.get(drive, 0.0) + power
    if len(drives) > _DRIVES:
        least = sorted(drives, key=lambda name: np.nanmax(np.abs(drives[name])))[: len(drives) - _DRIVES + 1]
        drives[f"{len(least)} other drives"] = np.sum([drives.pop(name) for name in least], axis=0)
    loads = {str(name): run["load_power"].values[:, i].sum(axis=1) for i, name in enumerate(run["load"].values)}
    largest = max((np.nanmax(np.abs(p), initial=0.0) for p in (*drives.values(), *loads.values())), default=0.0)
    return drives | {name: p for name, p in loads.items() if np.nanmax(np.abs(p)) > 1e-9 * largest}


def speeds_panel(runs: Mapping[str, xr.Dataset]) -> Panel:
    """Forward speed of several runs against time."""
    fig = go.Figure()
    for i, (name, run) in enumerate(runs.items()):
        label = str(run.attrs.get("label", name))
        line = {"color": CYCLE[i % len(CYCLE)], "dash": ("solid", "dash", "dot")[i // len(CYCLE) % 3]}
        fig.add_scatter(x=run["time"].values, y=swimming_speed(run), name=label, line=line)
    _over_time(fig, "speed forward (m/s)", 400).update_layout(hovermode="closest")
    return Panel("Speed", "Simulated speed of the body towards -x, which is forward.", fig)


def velocity_panel(run: xr.Dataset) -> Panel:
    """Velocity of the body against time, by component."""
    velocity = run["velocity"].isel(part=0)
    fig = go.Figure()
    for axis, colour in zip("xyz", (BLUE, ORANGE, GREEN), strict=True):
        line = {"color": colour, "dash": "dash" if axis == "z" else "solid"}
        fig.add_scatter(x=run["time"].values, y=velocity.sel(axis=axis).values, name=f"along {axis}", line=line)
    _over_time(fig, "velocity (m/s)", 340)
    over = mean_window(run["time"].values, run.attrs).over
    x, y, z = (f"{0.0 if abs(v) < 1e-12 else v:.3g}" for v in mean_of(run, run.attrs, "velocity")[0])
    caption = (
        f"Simulated velocity of the {run['part'].values[0]} in the world frame; mean over {over}: ({x}, {y}, {z}) m/s."
    )
    return Panel("Velocity of the body", caption, fig)


def power_panel(run: xr.Dataset) -> Panel:
    """Power of drives and loads against time, and whether they balance the energy."""
    fig = go.Figure()
    add_powers(fig, run)
    _over_time(fig, "power into the robot (W)", 380)
    return Panel("Power flow", f"{POWER_SIGN} {balance_sentence(run)}", fig)


POWER_SIGN = (
    "Simulated power of each source: positive puts energy into the robot, negative takes it out; what is left over "
    "goes into motion and elastic energy (dotted). Short peaks may leave the scale."
)


def add_powers(fig: go.Figure, run: xr.Dataset, row: int | None = None) -> None:
    """Draw the powers of a run and their sum; `row` is that of the subplot, if there are several."""
    place: dict[str, Any] = {} if row is None else {"row": row, "col": 1}
    flow = powers(run)
    for (name, power), line in zip(flow.items(), source_lines([*flow]), strict=True):
        fig.add_scatter(x=run["time"].values, y=power, name=readable(name), line=line, **place)
    if flow:
        fig.update_yaxes(range=_usual(list(flow.values())), **place)
        total = np.sum(list(flow.values()), axis=0)
        dots = {"color": BLACK, "dash": "dot"}
        fig.add_scatter(x=run["time"].values, y=total, name="stored", line=dots, **place)


def _usual(flow: Sequence[Float[np.ndarray, "t"]]) -> tuple[float, float]:
    """Range that shows all but the most extreme 4 % of each power, and zero."""
    return span([0.0, *np.nanpercentile(np.stack(flow), [2, 98], axis=1).ravel()])


def balance_sentence(run: xr.Dataset) -> str:
    """How well powers and energy balance, in a sentence."""
    worst = float(np.nanmax(run["power_balance"].values))
    return f"Powers and the change of energy balance to {worst:.1e} of the largest power flow at every saved time."


def energy_panel(run: xr.Dataset) -> Panel:
    """Energies against time, by form."""
    fig = go.Figure()
    names = {"kinetic": "motion of the robot", "water": "motion of the water it carries", "elastic": "elastic"}
    forms: Sequence[str] = [str(form) for form in run["form"].values]
    for form, colour in zip(forms, (BLUE, GREEN, VERMILLION, PURPLE), strict=False):
        energy = run["energy"].sel(form=form).values
        fig.add_scatter(x=run["time"].values, y=energy, name=names.get(form, form), line_color=colour)
    _over_time(fig, "energy (J)", 340)
    return Panel("Energies", "Simulated energy stored in the robot and in the water that moves with it.", fig)


def _over_time(fig: go.Figure, y: str, height: int) -> go.Figure:
    fig.update_xaxes(title="time (s)")
    fig.update_yaxes(title=y)
    return dress(fig, height).update_layout(showlegend=True)


def tension_panels(run: xr.Dataset) -> list[Panel]:
    """Tensions of tendons over joints; nothing of a run without."""
    if "tendon" not in run.dims:
        return []
    fig = go.Figure()
    for i, (name, tension) in enumerate(zip(run["tendon"].values, run["tension"].values.T, strict=True)):
        line = {"color": CYCLE[i % len(CYCLE)]}
        fig.add_scatter(x=run["time"].values, y=tension, name=readable(str(name)), line=line)
    _over_time(fig, "tension (N)", 320)
    return [Panel("Tensions", "Simulated tensions of tendons over joints; a slack one has none.", fig)]


def force_panels(run: xr.Dataset) -> list[Panel]:
    """Force of each load on the whole robot along its body's forward axis, against time; nothing without loads."""
    if "load_force" not in run:
        return []
    forward = str(run.attrs.get("forward", "x"))
    ahead = run["rotation"].values[:, 0] @ np.array(DIRECTIONS[forward])
    forces = np.einsum("tlpx,tx->lt", run["load_force"].values, ahead)
    largest = np.nanmax(np.abs(forces), axis=1, initial=0.0)
    acting = {str(run["load"].values[i]): forces[i] for i in np.flatnonzero(largest > 1e-9 * largest.max(initial=0.0))}
    if not acting:
        return []
    fig = go.Figure()
    for (name, force), line in zip(acting.items(), source_lines([*acting]), strict=True):
        fig.add_scatter(x=run["time"].values, y=force, name=readable(name), line=line)
    _over_time(fig, "forward force (N)", 340)
    caption = (
        f"Simulated force of each load on all parts, along the forward axis of the {run['part'].values[0]}, its "
        f"{forward} axis. Positive pushes it forward."
    )
    return [Panel("Forces by load", caption, fig)]


def track_panels(run: xr.Dataset) -> list[Panel]:
    """Path of the body in the plane of its largest travel, to scale; nothing of a body that stays."""
    path = run["position"].values[:, 0]
    travel = np.nanmax(path, axis=0) - np.nanmin(path, axis=0)
    if not travel.max() > _STAYS:
        return []
    x, y = sorted(np.argsort(-travel, kind="stable")[:2])
    fig = go.Figure()
    for name, style, points in (
        ("path", {"mode": "lines", "line": {"color": BLUE}}, path),
        ("start", {"mode": "markers", "marker": {"color": BLACK, "symbol": "circle-open", "size": 9}}, path[:1]),
    ):
        fig.add_scatter(x=points[:, x], y=points[:, y], name=name, **style)
    dress(fig, 380).update_layout(showlegend=True, hovermode="closest")
    fig.update_xaxes(title=f"{'xyz'[x]} (m)")
    fig.update_yaxes(title=f"{'xyz'[y]} (m)", scaleanchor="x")
    seen = "xyz"[3 - x - y]
    caption = f"Simulated path of the {run['part'].values[0]} seen along {seen}; both axes have one scale."
    return [Panel("Track", caption, fig)]
