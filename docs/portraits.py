"""Pictures of the gallery: a robot as it swims, in its real proportions, seen from afar, with the way it came."""

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from nectosome.view.tubes import colours_of, hard_colour, triangles, tubes

if TYPE_CHECKING:
    import xarray as xr

INK, GREY, TRAIL = "#222222", "#6b7077", "#D55E00"
_SIZE, _DOTS = (8.0, 4.5), 160  # inches, and pixels in each
_ROOM = 0.12  # around the robot, of the picture's height
_LIGHT = np.array([-0.35, 0.45, 0.82])  # right, up and towards the viewer
_BARS = [m * 10.0**k for k in range(-3, 1) for m in (1, 2, 5)]  # lengths of the scale [m]


def draw(run: "xr.Dataset", seen: tuple[float, float], path: Path, back: float = 0.0) -> None:
    """Write the picture of a run as a PNG, a share `back` of a period before its end.

    It is `seen` from that azimuth and height over the horizon [deg]. The line is the way of the body's middle over the
    last periods, a dot for each.
    """
    import matplotlib.pyplot as plt

    mpl.use("Agg")
    period = float(run.attrs["period"])
    now = float(run["time"][-1]) - back * period
    parts = tubes(run, np.array([now]))
    look = _camera(*np.radians(seen))
    corners = {name: rings[0].reshape(-1, 3) @ look.T for name, rings in parts.items()}
    box = np.concatenate(list(corners.values()))
    low, high = box.min(axis=0)[:2], box.max(axis=0)[:2]
    trail, dots = _trail(run, now, period, 1.5 * float(np.max(high - low)))
    trail, dots = trail @ look.T, dots @ look.T
    low = np.minimum(low, trail[:, :2].min(axis=0))
    high = np.maximum(high, trail[:, :2].max(axis=0))

    with plt.rc_context({"font.family": "DejaVu Sans", "font.size": 10}):
        fig = plt.figure(figsize=_SIZE, dpi=_DOTS, facecolor="white")
        ax = fig.add_axes((0, 0, 1, 1))
        ax.set_axis_off()
        shown = _frame(low, high)
        ax.set(xlim=shown[0], ylim=shown[1], aspect="equal")
        height = shown[1][1] - shown[1][0]
        ax.plot(*trail.T[:2], color=TRAIL, lw=1.6, zorder=1, solid_capstyle="round")
        ax.plot(*dots.T[:2], "o", color=TRAIL, ms=4, zorder=1)
        _skin(ax, corners, {name: rings.shape[1:3] for name, rings in parts.items()}, _colours(colours_of(run, parts)))
        _scale(ax, shown, height)
        fig.savefig(path, metadata={"Software": None})
        plt.close(fig)


def _colours(each: dict[str, str]) -> dict[str, str]:
    """Colours by part, the same for all parts that differ in their numbers only."""
    kinds = {name: name.rstrip("_0123456789") for name in each}
    greys = {hard_colour(k) for k in range(len(each))}
    hard = dict.fromkeys(kinds[name] for name in each if each[name] in greys)
    turn = {kind: hard_colour(k) for k, kind in enumerate(hard)}
    return {name: turn.get(kinds[name], each[name]) for name in each}


def _camera(azimuth: float, height: float) -> np.ndarray:
    """Rows: what is right, up and towards the viewer."""
    c, s, ch, sh = np.cos(azimuth), np.sin(azimuth), np.cos(height), np.sin(height)
    return np.array([[-s, c, 0.0], [-sh * c, -sh * s, ch], [ch * c, ch * s, sh]])


def _trail(run: "xr.Dataset", now: float, period: float, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Way of the body's first station [m] up to now, as far as `longest` from there, and places a period apart."""
    time, place = run["time"].values, run["position"].values[:, 0]

    def at(t: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(t, time, place[:, i]) for i in range(3)], axis=-1)

    way = at(t := np.linspace(0.0, now, 2000))
    far = np.linalg.norm(way - way[-1], axis=-1) > longest
    first = t[np.flatnonzero(far)[-1] + 1] if far.any() else 0.0
    counts = np.arange(1, int((now - first) / period) + 1)
    return way[t >= first], at(now - period * counts)


def _skin(ax: "mpl.axes.Axes", corners: dict, sizes: dict, colours: dict[str, str]) -> None:
    """All triangles of all parts, the nearest last, lit from above and left."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    faces, tints = [], []
    for name, points in corners.items():
        face = points[triangles(*sizes[name])]
        normal = np.cross(face[:, 1] - face[:, 0], face[:, 2] - face[:, 0])
        size = np.linalg.norm(normal, axis=-1, keepdims=True)
        normal = np.where(size > 0, normal / np.maximum(size, 1e-300), 0.0)
        normal *= np.sign(normal[:, 2:])  # what is seen faces the viewer
        light = 0.45 + 0.6 * np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
        faces.append(face)
        tints.append(np.clip(light[:, None] * np.array(to_rgb(colours[name])), 0, 1))
    face, tint = np.concatenate(faces), np.concatenate(tints)
    order = np.argsort(face[..., 2].mean(axis=1))
    skin = PolyCollection(
        face[order][..., :2], facecolors=tint[order], edgecolors=tint[order], linewidths=0.3, zorder=2
    )
    ax.add_collection(skin, autolim=False)


def _frame(low: np.ndarray, high: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of the picture with room around what is in it, and below for the scale."""
    size, middle = high - low, 0.5 * (low + high)
    height = max(size[1] / (1 - 2 * _ROOM - 0.04), size[0] / (1 - _ROOM) * _SIZE[1] / _SIZE[0])
    width = height * _SIZE[0] / _SIZE[1]
    y = middle[1] - 0.02 * height
    return (middle[0] - width / 2, middle[0] + width / 2), (y - height / 2, y + height / 2)


def _scale(ax: "mpl.axes.Axes", shown: tuple[tuple[float, float], tuple[float, float]], height: float) -> None:
    """Scale bar at the lower left."""
    length = max(bar for bar in _BARS if bar <= 0.35 * height)
    x, y = shown[0][0] + 0.06 * height, shown[1][0] + 0.06 * height
    ax.plot([x, x + length], [y, y], color=INK, lw=2.5, solid_capstyle="butt")
    text = f"{1e3 * length:.0f} mm" if length < 0.1 else f"{1e2 * length:.0f} cm"
    ax.text(x + length / 2, y + 0.018 * height, text, ha="center", va="bottom", color=INK)
