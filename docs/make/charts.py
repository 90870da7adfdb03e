"""Pictures of pages: two goals of one filament, the fish over its beat, RExEel's swims, foils beside a vortex lattice,
a foam limb, a policy that learns.

    python docs/make/charts.py out/holding.nc out/fish.nc out/rexeel/data out/vortex/data out/softlimb/data \\
        out/learn_heading.csv

The first file is saved by `examples/holding.py`, the second by `nectosome sweep fish` over f and p; the folders by
`nectosome reproduce rexeel vortex softlimb --out out`; the last by `examples/learn_heading.py`, with another
one beside.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

from nectosome.io import load_dataset
from nectosome_studies.rexeel.figures import CODES

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


def rexeel(swims: "xr.Dataset", pieces: "xr.Dataset", path: Path) -> None:
    """Tracks of the head at four amplitudes, and the distance by amplitude."""
    with figure(11, 5.2, path) as fig:
        grid = fig.add_gridspec(1, 5, width_ratios=(1, 1, 1, 1, 2))
        first: Axes | None = None
        for i, k in enumerate(swims["amplitude"].values):
            ax = fig.add_subplot(grid[i], sharey=first)
            first = first or ax
            one = swims.sel(amplitude=k)
            ax.plot(100 * one["measured_x"].values.T, 100 * one["measured_y"].values.T, color=PALE, lw=0.7)
            ours = one.sel(angles="commanded")
            ax.plot(100 * ours["x"], 100 * ours["y"], color=COLOURS[0], lw=2)
            ax.set(title=f"{k} deg", xlim=(-7, 22), ylim=(-4, 72), aspect="equal", xlabel="across (cm)")
            ax.tick_params(labelleft=i == 0)
            if i == 0:
                ax.set_ylabel("along the tank (cm)")
        ax, x = fig.add_subplot(grid[4]), swims["amplitude"].values
        measured = 100 * swims["measured_distance"]
        bars = measured.std("swim", ddof=1)
        ax.plot(x, 100 * pieces["distance"].sel(piece="instant"), "--", color=COLOURS[1], label="shed at once")
        ax.plot(x, 100 * swims["distance"].sel(angles="commanded"), "o-", color=COLOURS[0], lw=2, label="predicted")
        ax.errorbar(x, measured.mean("swim"), bars, fmt="o", color=INK, capsize=3, label="measured", zorder=3)
        known = CODES["distance"]["Navier-Stokes"]
        ax.plot([*known], [100 * y for y in known.values()], "D", color=GREY, label="Navier-Stokes, as published")
        ax.plot(x, 100 * pieces["distance"].sel(piece="nothing-shed"), ":", color=COLOURS[2], label="nothing shed")
        ax.set(xticks=x, xlabel="amplitude of the motors (deg)", ylabel="distance in 3.97 s (cm)")
        ax.set_ylim(bottom=0)
        ax.legend(frameon=False, fontsize=9)


def foils(cases: "dict[str, xr.Dataset]", path: Path) -> None:
    """Lift over a beat and along the span: foil, vortex lattice, and what was measured."""
    with figure(11, 5.6, path) as fig:
        for k, one in enumerate(cases.values()):
            over, along = fig.add_subplot(2, 3, k + 1), fig.add_subplot(2, 3, k + 4)
            foil, lattice = (one["lift"].sel(model=model).values for model in ("foil", "lattice"))
            over.plot(one["phase"], foil, color=COLOURS[0], lw=2, label="foil")
            over.plot(one["phase"], lattice, "--", color=COLOURS[1], lw=1.8, label="vortex lattice")
            ends = np.append(one["band_from"].values, one["band_to"].values[-1])
            along.stairs(one["band_lift"].sel(model="foil"), 1000 * ends, baseline=None, color=COLOURS[0], lw=2)
            along.plot(1000 * one["strip_at"], one["strip_lift"], "o--", color=COLOURS[1], lw=1.8, ms=3)
            if "measured_lift" in one:
                over.plot(one["phase"], one["measured_lift"], color=INK, lw=1.2, label="measured")
                along.stairs(one["measured_band_lift"], 1000 * ends, baseline=None, color=INK, lw=1.2)
                over.legend(frameon=False, fontsize=9)
            over.axhline(0, color=PALE, lw=0.8, zorder=0)
            over.set_title(one.attrs["title"], fontsize=10)
            over.set(xlabel="share of a beat", xlim=(0, 1))
            along.set(xlabel="along the span (mm)")
            along.set_ylim(bottom=0)
            if k == 0:
                over.set_ylabel("lift (N)")
                along.set_ylabel("amplitude of lift\nper span (N/m)")


def limb(motions: "xr.Dataset", path: Path) -> None:
    """Command and angle of the foam limb in six recordings."""
    with figure(11, 8.6, path) as fig:
        axes = fig.subplots(4, 3, sharex="col", sharey="row", height_ratios=(1, 2, 1, 2))
        fitted = {"water_1": "fitted", "water_2": "slack fitted"}
        for k, name in enumerate(motions["recording"].values):
            one = motions.isel(recording=k)
            told, seen = axes[2 * (k // 3) : 2 * (k // 3) + 2, k % 3]
            title = f"{name}, {fitted.get(str(name), 'predicted')}"
            told.plot(one["time"], 1000 * one["contraction"], color=COLOURS[1], lw=1)
            told.set_title(title, fontsize=10)
            seen.plot(one["time"], np.rad2deg(one["other"]), color=PALE, lw=2, label="measured, other limb")
            seen.plot(one["time"], np.rad2deg(one["measured"]), ".", color=INK, ms=3, label="measured")
            seen.plot(one["time"], np.rad2deg(one["held"]), color=COLOURS[0], lw=2, label="computed, no slack")
            seen.plot(one["time"], np.rad2deg(one["loose"]), color=COLOURS[2], lw=1.5, label="computed, 10 mm of slack")
            if k >= 3:
                seen.set_xlabel("time from the first pull on (s)")
            if k % 3 == 0:
                told.set_ylabel("contraction (mm)")
                seen.set_ylabel("angle from rest (deg)")
            if k == 1:
                seen.legend(frameon=False, fontsize=9, loc="upper left")


def learning(curve: Path, compared: Path, path: Path) -> None:
    """Errors over generations, and those of the policy and of the PID on headings not learned from."""
    rows = np.loadtxt(curve, delimiter=",", skiprows=1)
    table = np.loadtxt(compared, delimiter=",", skiprows=1)
    with figure(10, 4, path) as fig:
        left, right = fig.subplots(1, 2, width_ratios=(1.2, 1))
        left.plot(rows[:, 0], rows[:, 3], "--", color=GREY, label="median of a generation")
        left.plot(rows[:, 0], rows[:, 4], "-", color=COLOURS[0], lw=2, label="mean policy, headings not learned from")
        pid = table[table[:, 0] == 0, 3].mean()
        left.axhline(pid, color=COLOURS[1], ls=":", lw=2, label="PID, the same headings")
        left.set(xlabel="generation (48 episodes of 16 s)", ylabel="mean error of the heading (deg)", yscale="log")
        left.legend(frameon=False, fontsize=9)
        for off, mark, words in ((0, "o", "as modelled"), (3, "^", "joint 3 deg off")):
            own = table[table[:, 0] == off]
            for k, name in enumerate(("policy", "PID")):
                label = f"{name}, {words}"
                fill = {"mfc": COLOURS[k] if off == 0 else "none", "color": COLOURS[k], "ms": 7}
                right.plot(own[:, 1], own[:, 4 + k], mark, label=label, **fill)
        right.set(xlabel="heading asked for (deg)", ylabel="error after the last beat (deg)", yscale="log")
        right.legend(frameon=False, fontsize=8, loc="lower right")


if __name__ == "__main__":
    two_goals(load_dataset(sys.argv[1]), IMAGES / "two_goals.png")
    fish(load_dataset(sys.argv[2]), IMAGES / "fish_map.png")
    folder = Path(sys.argv[3])
    rexeel(load_dataset(folder / "swims.nc"), load_dataset(folder / "pieces.nc"), IMAGES / "rexeel.png")
    folder = Path(sys.argv[4])
    foils({name: load_dataset(folder / f"{name}.nc") for name in ("wing", "heave-pitch", "tuna")}, IMAGES / "foils.png")
    limb(load_dataset(Path(sys.argv[5]) / "limb-motions.nc"), IMAGES / "limb.png")
    curve = Path(sys.argv[6])
    learning(curve, curve.with_name("learn_heading_compared.csv"), IMAGES / "learn_heading.png")
