"""Pictures of the pages on design and on the gallery: two goals of one filament, and the fish over its beat.

    python docs/make/charts.py out/holding.nc out/fish.nc

The first file is saved by `examples/holding.py`, the second by `nectosome sweep fish` over f and p.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from nectosome.io import load_dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

IMAGES = Path(__file__).parents[1] / "img"
COLOURS = ("#0072B2", "#D55E00", "#009E73")  # of Okabe and Ito's palette
INK, GREY, PALE = "#222222", "#6b7077", "#b4bec8"
BAR = 25.0  # mm, radius


@contextmanager
def figure(width: float, height: float, path: Path) -> "Iterator[Figure]":
    """A figure of that size [inches], written as a PNG when it is drawn."""
    import matplotlib.pyplot as plt

    mpl.use("Agg")
    style = {"font.family": "DejaVu Sans", "font.size": 10, "axes.edgecolor": INK, "text.color": INK}
    with plt.rc_context({**style, "axes.labelcolor": INK, "xtick.color": INK, "ytick.color": INK}):
        fig = plt.figure(figsize=(width, height), dpi=130, facecolor="white", layout="constrained")
        yield fig
        fig.savefig(path, metadata={"Software": None})
        plt.close(fig)


def two_goals(found: "xr.Dataset", path: Path) -> None:
    """Speed and pull of all designs with their front, and the chosen ones round the bar."""
    with figure(10, 6.2, path) as fig:
        grid = fig.add_gridspec(3, 2, width_ratios=(1.1, 1))
        ax = fig.add_subplot(grid[:, 0])
        ax.plot(*found["goals"].values.T, "o", color=PALE, ms=4, label="designs tried")
        ax.plot(*found["goals"].values[found["front"].values].T, "-", color=INK, lw=1, label="front of these")
        for k, name in enumerate(found["name"].values):
            one = found.sel(name=name)
            ax.plot(*found["goals"].values[int(one["chosen"])], "o", color=COLOURS[k], ms=9, label=str(name))
            ax.plot(*one["fine"].values, "o", mfc="none", mew=1.6, color=COLOURS[k], ms=11)
            numbers = found["design"].values[int(one["chosen"])]
            _holding(fig.add_subplot(grid[k, 1]), one, numbers, COLOURS[k])
        ax.plot([], [], "o", mfc="none", mew=1.6, color=GREY, ms=11, label="computed more finely")
        ax.set(xlabel="steady speed (m/s)", ylabel="pull that two filaments hold (N)")
        ax.set_ylim(bottom=0)
        ax.legend(frameon=False, fontsize=9)


def _holding(ax: "Axes", one: "xr.Dataset", numbers: np.ndarray, colour: str) -> None:
    """A filament round the bar, as it begins to be drawn out."""
    part = one["station_part"].values
    own = part == "filament"
    middle = 1e3 * one["position"].values[own, :2]
    side = 1e3 * one["half_width"].sel(across="y").values[own, None] * one["rotation"].values[own, :2, 1]
    ax.fill(*np.concatenate([middle + side, (middle - side)[::-1]]).T, color=colour, alpha=0.85, lw=0)
    x, y = 1e3 * one["position"].values[part == "bar", :2][0]
    ax.add_patch(mpl.patches.Circle((x, y), BAR, color=GREY))
    ax.annotate("", (x + 85, y), (x + BAR + 3, y), arrowprops={"arrowstyle": "-|>", "color": INK})
    length, tip, young, tension = numbers
    ax.set_title(
        f"{one['name'].item()}: {1e3 * length:.0f} mm, tip {1e3 * tip:.1f} mm, {young / 1e6:.2f} MPa, {tension:.0f} N",
        fontsize=9,
        color=colour,
        loc="left",
    )
    ax.set(xlim=(-10, 470), ylim=(-50, 320), aspect="equal", yticks=[0, 100, 200, 300])
    ax.set_ylabel("mm")


def fish(found: "xr.Dataset", path: Path) -> None:
    """Speed, thrust, power and cost of transport over frequency and pressure."""
    thrust = -found["load_force"].sel(part="tail", axis="x", load="wake")
    shown = {
        "speed (mm/s)": 1e3 * found["speed"],
        "thrust of the wake (mN)": 1e3 * thrust,
        "power (mW)": 1e3 * found["power"],
        "cost of transport (1/1000)": 1e3 * found["cost_of_transport"],
    }
    with figure(10, 6.4, path) as fig:
        for k, (title, values) in enumerate(shown.items()):
            ax = fig.add_subplot(2, 2, k + 1)
            f, p, z = found["f"].values, 1e-5 * found["p"].values, values.transpose("p", "f").values
            drawn = ax.contourf(f, p, z, 12, cmap="cividis")
            ax.plot(*(x.ravel() for x in np.meshgrid(f, p)), ".", color="white", ms=3, clip_on=False)
            fig.colorbar(drawn, ax=ax)
            ax.set_title(title, fontsize=10)
            ax.set(xlabel="frequency (Hz)" if k > 1 else "", ylabel="pressure (bar)" if k % 2 == 0 else "")


if __name__ == "__main__":
    two_goals(load_dataset(sys.argv[1]), IMAGES / "two_goals.png")
    fish(load_dataset(sys.argv[2]), IMAGES / "fish_map.png")
