"""The picture of the README: the flagellum in 3-D, and the speeds of the five printed designs."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from nectosome.view.tubes import tubes

if TYPE_CHECKING:
    import xarray as xr
    from mpl_toolkits.mplot3d import Axes3D

DESIGNS = ("row1", "row2", "row3", "row4", "row5")
# Okabe and Ito's palette; the lightest colours are left out, they vanish on white
BLUE, VERMILLION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE)
INK, GREY, PALE = "#222222", "#6b7077", "#d9dde2"
_FIRST = 1.2  # s of the swim that are drawn
_EARLIER = 5  # ghosts in one revolution


def draw(runs: Mapping[str, "xr.Dataset"], path: Path) -> None:
    """Write the picture of the five designs of Table II as a PNG."""
    import matplotlib.pyplot as plt

    mpl.use("Agg")
    style = {"font.family": "DejaVu Sans", "font.size": 10, "axes.edgecolor": INK, "text.color": INK}
    with plt.rc_context({**style, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK}):
        fig = plt.figure(figsize=(10, 7.6), dpi=160, facecolor="white")
        scene = fig.add_axes((0.0, 0.0, 1.0, 10 / 7.6), projection="3d", zorder=-1)  # square: it clips
        _robot(scene, runs["row1"])
        fig.text(0.03, 0.955, "A soft flagellate propeller, simulated", fontsize=14, weight="bold")
        line = "First printed design: 700 mm filament of 7.4 MPa turned at 14.4 rad/s. Pale: earlier in the same turn."
        fig.text(0.03, 0.918, line, fontsize=10, color=GREY)
        _from_rest(fig.add_axes((0.075, 0.085, 0.385, 0.27)), runs)
        _steady(fig.add_axes((0.60, 0.085, 0.37, 0.27)), runs)
        fig.savefig(path, metadata={"Software": None})
        plt.close(fig)


def forward(run: "xr.Dataset") -> np.ndarray:
    """Swimming speed [m/s] at all times, forward being -x."""
    return -run["velocity"].sel(part="body", axis="x").values


def _robot(ax: "Axes3D", run: "xr.Dataset") -> None:
    """The robot at the end of the run, and where its filament was during the last turn, seen from the canister."""
    end, turn = float(run["time"][-1]), 2 * np.pi / 14.4
    times = end - turn * np.arange(_EARLIER, -1, -1) / (_EARLIER + 1)
    skins = tubes(run, times)
    path = np.interp(times, run["time"].values, run["position"].values[:, 0, 0])
    light = mpl.colors.LightSource(azdeg=315, altdeg=50)
    for name, rings in skins.items():
        soft = name == "filament"
        colour = BLUE if soft else {"body": "#c3c8cf", "shaft": "#4f5660"}.get(name, "#8b929b")
        for k in range(len(times)) if soft else (len(times) - 1,):
            now = k == len(times) - 1
            x, y, z = np.moveaxis(rings[k], -1, 0)
            x, y, z = (np.concatenate([a, a[:, :1]], axis=1) for a in (x - path[k], y, z))  # close the rings
            ax.plot_surface(
                x,
                y,
                z,
                color=colour,
                alpha=1.0 if now else 0.10,
                lightsource=light,
                shade=now,
                linewidth=0,
                antialiased=not now,
                rstride=1,
                cstride=1,
            )
    ax.plot([-0.22, -0.07], [0, 0], [0, 0], color=INK, lw=1.6)
    ax.plot([-0.20, -0.22, -0.20], [0, 0, 0], [0.009, 0, -0.009], color=INK, lw=1.6)
    ax.text(-0.145, 0, 0.022, f"{float(forward(run)[-1]):.3f} m/s", ha="center", fontsize=10, color=INK)
    ax.plot([-0.2, -0.1], [0, 0], [-0.17, -0.17], color=INK, lw=2.5, solid_capstyle="butt")
    ax.text(-0.15, 0, -0.155, "100 mm", ha="center", fontsize=9, color=INK)
    ax.set(xlim=(-0.24, 0.72), ylim=(-0.2, 0.2), zlim=(-0.2, 0.2))
    ax.set_box_aspect((0.96, 0.4, 0.4), zoom=1.0)
    ax.set_proj_type("ortho")
    ax.view_init(elev=16, azim=-78)
    ax.set_axis_off()


def _from_rest(ax: "mpl.axes.Axes", runs: Mapping[str, "xr.Dataset"]) -> None:
    """Speed against time."""
    for k, name in enumerate(DESIGNS):
        run = runs[name]
        early = run["time"].values <= _FIRST
        ax.plot(run["time"].values[early], forward(run)[early], color=COLOURS[k], lw=1.6)
    ax.set(xlabel="time (s)", ylabel="swimming speed (m/s)", xlim=(0, _FIRST))
    ax.axhline(0, color=GREY, lw=0.8)
    ax.set_title("From rest, the five designs", loc="left", fontsize=11, weight="bold", pad=8)
    _plain(ax, "y")


def _steady(ax: "mpl.axes.Axes", runs: Mapping[str, "xr.Dataset"]) -> None:
    """Steady speed of each design, ours and printed."""
    for k, name in enumerate(DESIGNS):
        run, y = runs[name], len(DESIGNS) - 1 - k
        ours, printed = float(forward(run)[-1]), float(run.attrs["printed_speed"])
        ax.plot([printed, ours], [y, y], color=PALE, lw=3, zorder=1)
        ax.plot(printed, y, "o", ms=8, mfc="white", mec=COLOURS[k], mew=1.8)
        ax.plot(ours, y, "o", ms=8.5, color=COLOURS[k])
        ax.text(printed - 0.0008, y, f"{printed:.3f}", ha="right", va="center", fontsize=9.5, color=GREY)
        error = 100 * (ours / printed - 1)
        ax.text(ours + 0.0008, y, f"{ours:.4f}  ({error:+.1f} %)", ha="left", va="center", fontsize=9.5)
        if k == 0:
            ax.text(printed - 0.0002, y + 0.33, "printed", ha="right", va="bottom", fontsize=9, color=GREY)
            ax.text(ours + 0.0002, y + 0.33, "simulated", ha="left", va="bottom", fontsize=9)
    ax.set(xlabel="steady speed (m/s)", xlim=(0.6625, 0.6975), ylim=(-0.6, 4.95))
    ax.set_yticks(range(5), [f"design {5 - y}" for y in range(5)])
    ax.set_title("Steady speed, nothing fitted", loc="left", fontsize=11, weight="bold", pad=8)
    ax.tick_params(axis="y", length=0)
    _plain(ax, "x")


def _plain(ax: "mpl.axes.Axes", grid: str) -> None:
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(axis=grid, color="#e6e8eb", lw=0.8)
    ax.set_axisbelow(True)
