"""A robot in 3-D that turns in the browser and plays its motion; for any run."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .series import drive_rate
from .style import BLACK, BLUE, Panel
from .tubes import triangles, tubes

if TYPE_CHECKING:
    import plotly.graph_objects as go
    import xarray as xr

HARD = ("#9aa1aa", "#4f5660", "#c9ced4")  # rigid parts, in turn
_REPEATS = 20  # how often the play button shows a motion that repeats
_PAUSE = 50  # ms between frames
_ROOM = (4.6, 1.5)  # width and height that the scene has, in units of the aspect ratio
_STEPS = [m * 10.0**k for k in range(-4, 4) for m in (1, 2, 5)]  # of the grid [m]
_CAMERA = {"eye": {"x": 0.2, "y": -1.6, "z": 0.5}, "projection": {"type": "orthographic"}}


class Actor(NamedTuple):
    """A robot on the stage."""

    label: str
    parts: dict[str, Float[np.ndarray, "t rings around 3"]]  # [m]
    colours: dict[str, str]  # by part


def actor(
    run: "xr.Dataset",
    times: Float[np.ndarray, "t"],
    label: str = "",
    soft: str = BLUE,
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Actor:
    """Robot of a run at `times` [s], seen by an observer who goes along with its body, which is put at `at` [m]."""
    parts = tubes(run, times)
    place = run["position"].values[:, 0]
    path = np.stack([np.interp(times, run["time"].values, place[:, i]) for i in range(3)], axis=-1)
    away = path[:, None, None, :] - np.asarray(at)
    return Actor(label, {name: rings - away for name, rings in parts.items()}, colours_of(run, parts, soft))


def colours_of(run: "xr.Dataset", parts: Collection[str], soft: str = BLUE) -> dict[str, str]:
    """Colours of parts by name: `soft` of rods, greys of rigid ones."""
    rods = {name for name in parts if _is_rod(run, name)}
    hard = {name: HARD[i % len(HARD)] for i, name in enumerate(n for n in parts if n not in rods)}
    return hard | dict.fromkeys(rods, soft)


def _is_rod(run: "xr.Dataset", part: str) -> bool:
    return float(run["station_x"].values[run["station_part"].values == part][0]) == 0


def stage(
    actors: Sequence[Actor], moments: Sequence[str], repeats: bool, counted: str, height: int = 520
) -> "go.Figure":
    """Figure with all actors in one scene of equal axes, a play button, and a slider over the named moments.

    Of one moment there is nothing to play. `counted` stands before the moment on the slider. With more than one actor,
    a menu picks one.
    """
    import plotly.graph_objects as go

    pieces = [(a, name, rings) for a in actors for name, rings in a.parts.items()]
    fig = go.Figure([_mesh(a, name, rings) for a, name, rings in pieces])
    fig.frames = [
        go.Frame(name=str(k), data=[_place(rings[k]) for _, _, rings in pieces], traces=list(range(len(pieces))))
        for k in range(len(moments))
    ]
    names = [a for a in actors if a.label]
    if names:
        tops = np.array([_box([a])[:, 1] for a in names])
        nose = [_box([a])[0, 0] for a in names]
        middle = [float(np.mean(next(iter(a.parts.values()))[..., 1])) for a in names]
        text = [a.label for a in names]
        style: dict[str, Any] = {
            "mode": "text",
            "textposition": "middle right",
            "textfont": {"size": 12},
            "hoverinfo": "skip",
        }
        fig.add_scatter3d(x=nose, y=middle, z=tops[:, 2] + 0.03, text=text, **style)
    fig.update_layout(
        height=height,
        margin={"l": 0, "r": 0, "t": 10, "b": 10},
        font={"family": "system-ui, sans-serif", "size": 12},
        scene={**_axes(actors), "camera": _CAMERA},
        showlegend=False,
        sliders=[_slider(moments, counted)] if len(moments) > 1 else [],
        updatemenus=[
            *([_buttons(len(moments), repeats)] if len(moments) > 1 else []),
            *([_menu(actors, bool(names))] if len(actors) > 1 else []),
        ],
    )
    return fig


def robot_panel(run: "xr.Dataset") -> Panel:
    """The whole run of one robot, in at most 60 frames."""
    saved = run["time"].values
    times = np.linspace(saved[0], saved[-1], min(60, len(saved)))
    figure = stage([actor(run, times)], [f"{t:.3f} s" for t in times], repeats=False, counted="time ")
    turns = drive_rate(run) * (times[1] - times[0]) / (2 * np.pi) if len(times) > 1 else 0.0
    caption = "Simulated motion seen by an observer who goes along with the body; drag to turn, scroll to come closer."
    if turns > 0.2:
        caption += f" Frames are {turns:.2g} revolutions of the drive apart, so the turning looks slower than it is."
    return Panel("The robot in motion", caption, figure)


def still_panel(run: "xr.Dataset") -> Panel:
    """The first moment of a run, where it is in the world."""
    saved = run["time"].values[:1]
    x, y, z = (float(v) for v in run["position"].values[0, 0])
    figure = stage([actor(run, saved, at=(x, y, z))], [""], repeats=False, counted="")
    return Panel("The robot", "Drag to turn, scroll to come closer. z is up.", figure)


def _mesh(who: Actor, name: str, rings: np.ndarray) -> "go.Mesh3d":
    import plotly.graph_objects as go

    i, j, k = triangles(rings.shape[1], rings.shape[2]).astype(np.int32).T
    title = f"{who.label}: {name}" if who.label else name
    return go.Mesh3d(
        **_coordinates(rings[0]),
        i=i,
        j=j,
        k=k,
        color=who.colours[name],
        name=title,
        hovertemplate="%{x:.3f}, %{y:.3f}, %{z:.3f} m",
        lighting={"ambient": 0.5, "diffuse": 0.6, "specular": 0.1, "roughness": 0.7},
        lightposition={"x": 0, "y": 100000, "z": -100000},
    )


def _place(rings: np.ndarray) -> "go.Mesh3d":
    import plotly.graph_objects as go

    return go.Mesh3d(**_coordinates(rings))


def _coordinates(rings: np.ndarray) -> dict[str, np.ndarray]:
    """Vertices in single precision, which is all a screen shows."""
    return dict(zip("xyz", rings.reshape(-1, 3).astype(np.float32).T, strict=True))


def _box(actors: Sequence[Actor]) -> Float[np.ndarray, "3 2"]:
    """Least and largest coordinates that the actors ever take [m]."""
    points = np.concatenate([rings.reshape(-1, 3) for a in actors for rings in a.parts.values()])
    return np.stack([points.min(axis=0), points.max(axis=0)], axis=-1)


def _axes(actors: Sequence[Actor]) -> dict[str, Any]:
    """Axes with equal scales around the actors."""
    box = _box(actors) + np.array([-1, 1]) * 0.04
    size = box[:, 1] - box[:, 0]
    scale = size * min(_ROOM[0] / size[0], _ROOM[1] / (size[2] + 0.3 * size[1]))
    alone = len(actors) == 1
    step = min((s for s in _STEPS if s > np.max(size) / (5 if alone else 8)), default=_STEPS[-1])
    look = {
        "showticklabels": alone,
        "backgroundcolor": "#f4f6f8",
        "gridcolor": "#d5dade",
        "showbackground": True,
        "zeroline": False,
    }
    axes: dict[str, Any] = {
        f"{name}axis": {
            "title": {"text": f"{name} (m)" if alone else ""},
            "range": list(map(float, box[i])),
            "dtick": step,
            **look,
        }
        for i, name in enumerate("xyz")
    }
    return {**axes, "aspectmode": "manual", "aspectratio": dict(zip("xyz", map(float, scale), strict=True))}


def _slider(moments: Sequence[str], counted: str) -> dict[str, Any]:
    now = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
    return {
        "steps": [{"method": "animate", "label": m, "args": [[str(k)], now]} for k, m in enumerate(moments)],
        "currentvalue": {"prefix": counted, "font": {"size": 13, "color": BLACK}},
        "x": 0.12,
        "len": 0.84,
        "y": 0,
        "pad": {"t": 0, "b": 10},
        "ticklen": 0,
        "minorticklen": 0,
        "font": {"color": "rgba(0,0,0,0)"},
    }


def _buttons(frames: int, repeats: bool) -> dict[str, Any]:
    each = {"mode": "immediate", "frame": {"duration": _PAUSE, "redraw": True}, "transition": {"duration": 0}}
    order = [str(k) for k in range(frames)] * (_REPEATS if repeats else 1)
    stop = {"mode": "immediate", "frame": {"duration": 0, "redraw": False}, "transition": {"duration": 0}}
    return {
        "type": "buttons",
        "direction": "left",
        "showactive": False,
        "x": 0.1,
        "xanchor": "right",
        "y": 0,
        "yanchor": "top",
        "pad": {"t": 18},
        "buttons": [
            {"label": "▶", "method": "animate", "args": [order, each]},
            {"label": "❚❚", "method": "animate", "args": [[None], stop]},
        ],
    }


def _menu(actors: Sequence[Actor], labelled: bool) -> dict[str, Any]:
    """Menu that shows all actors, or one of them up close."""

    def choice(title: str, shown: Sequence[Actor], text: bool) -> dict[str, Any]:
        visible = [any(a is b for b in shown) for a in actors for _ in a.parts] + [text] * labelled
        axes = _axes(shown)
        layout = {f"scene.{key}.range": axes[key]["range"] for key in ("xaxis", "yaxis", "zaxis")}
        layout |= {f"scene.{key}.dtick": axes[key]["dtick"] for key in ("xaxis", "yaxis", "zaxis")}
        return {
            "label": title,
            "method": "update",
            "args": [{"visible": visible}, {**layout, "scene.aspectratio": axes["aspectratio"]}],
        }

    one = [choice(a.label, [a], False) for a in actors]
    return {"buttons": [choice("all", actors, True), *one], "x": 0.01, "xanchor": "left", "y": 0.99}
