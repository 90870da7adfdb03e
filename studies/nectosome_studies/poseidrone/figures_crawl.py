"""Figures of PoseiDRONE's crawling: searches, identifiability of the parameters, gaits over density and buoyancy.

Data of the study: `crawl_fit_0`, ... as datasets of `identification.GaitResult` have them; `crawl_told`: error (data,
parameter) as shares of the ranges, rank, words; `crawl_profile`: value and rise (data, point), unless it was left out
for time; `crawl_gaits`: speed, feet (density, distance, angle); `crawl_cranks`, `crawl_motors` as `crawl_motors.crawl`
has them.
"""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.fit_pages import history_panel, motion_panel, parameters_panel
from nectosome.view.heatmap import MapAxis, diverging, maps
from nectosome.view.style import BLACK, BLUE, CYCLE, Panel, dress, plain

from .. import charts
from ..study import Sets
from .crawl import OWN, PRINTED
from .crawl_motors import NO_LOAD, PER_TURN, SPEED, STALL, VOLTAGE

if TYPE_CHECKING:
    import xarray as xr

_TURNS_SHOWN = 2  # of the cranks
_THRESHOLD = 3.84  # 95 % quantile of chi-squared, one degree of freedom
_DATA = {
    "features": "four features, 1 %",
    "series": "positions over time, 1 mm",
    "both": "with tilt, 1 deg, and a second density",
}


def panels(sets: Sets) -> list[Panel]:
    """All of them."""
    fits = [sets[name] for name in sorted(name for name in sets if name.startswith("crawl_fit_"))]
    names = [f"search {k + 1}" for k in range(len(fits))]
    motion = motion_panel(fits[0])
    caption = f"{motion.caption} Fitted to the features that the paper prints (Fig. 11); the tracks were not published."
    drawn = charts.panels("poseidrone", sets)
    return [
        history_panel(fits, names, PRINTED)._replace(title="Crawling: searches for Table 3's parameters"),
        parameters_panel(fits, names)._replace(title="Crawling: parameters of equally good fits"),
        drawn["Crawling: identifiability by measurement"],
        *([profile_panel(sets["crawl_profile"])] if "crawl_profile" in sets else []),
        drawn["Crawling: what to measure next"],
        motion._replace(title="Crawling: positions and tilt", caption=caption),
        drawn["Crawling: the density held out"],
        gaits_panel(sets["crawl_gaits"]),
    ]


def motor_panels(sets: Sets) -> list[Panel]:
    """Torque, speed and electrical power of the crank that carries most over some turns, ideal and on its motor."""
    from plotly.subplots import make_subplots

    carries = int(np.argmax(sets["crawl_cranks"]["torque"].mean("time").values))
    rows = (("torque", "torque (mN m)", 1e3), ("rate", "speed (rad/s)", 1.0), ("electrical_power", "power (W)", 1.0))
    fig = make_subplots(len(rows), 1, shared_xaxes=True, vertical_spacing=0.06)
    for key, name, colour in (("crawl_cranks", "ideal drive", BLACK), ("crawl_motors", "motor", BLUE)):
        shown = sets[key].isel(leg=carries, time=slice(-_TURNS_SHOWN * PER_TURN - 1, None))
        time = shown["time"].values - float(shown["time"][0])
        for row, (variable, title, scale) in enumerate(rows, start=1):
            if not np.isnan(shown[variable]).all():
                style = {"line": {"color": colour}, "name": name, "legendgroup": name, "showlegend": row == 1}
                fig.add_scatter(x=time, y=scale * shown[variable].values, mode="lines", **style, row=row, col=1)
            fig.update_yaxes(title=title, row=row, col=1)
    fig.update_xaxes(title="time (s)", row=len(rows), col=1)
    dress(fig, 520).update_layout(showlegend=True, margin_t=60)
    speeds = [1e3 * sets[key].attrs["speed"] for key in ("crawl_cranks", "crawl_motors")]
    leg = sets["crawl_motors"]["leg"].values[carries]
    caption = (
        f"Simulated with Table 3's parameters, one {leg} leg, cranks at {SPEED:g} rad/s. The paper prints no number of "
        f"its motors; assumptions: {NO_LOAD * SPEED:g} rad/s without a load, a stall torque of {STALL:g} times "
        f"the largest torque of the ideal drive, both at {VOLTAGE:g} V, with a velocity loop. Crawling speed: "
        f"{speeds[0]:.2f} mm/s with ideal drives, {speeds[1]:.2f} mm/s on motors. These start from rest, so that their "
        "cranks are behind."
    )
    return [Panel("Crawling: cranks on motors", caption, fig)]


def profile_panel(found: "xr.Dataset") -> Panel:
    """Profile likelihood of one parameter, by what is measured."""
    import plotly.graph_objects as go

    fig = go.Figure()
    for k, (data, words) in enumerate(_DATA.items()):
        one = found.sel(data=data).dropna("point")
        line = {"color": CYCLE[k], "width": 2}
        fig.add_scatter(x=one["value"].values, y=one["rise"].values, mode="lines+markers", line=line, name=words)
    threshold = {"color": BLACK, "dash": "dot", "width": 1}
    fig.add_hline(y=_THRESHOLD, line=threshold, annotation_text="95 %", annotation_position="top left")
    name, unit = plain(found.attrs["parameter"]), found["value"].attrs["units"]
    fig.update_xaxes(title=f"{name} ({unit})")
    fig.update_yaxes(title="rise of chi2", range=(-0.1 * _THRESHOLD, 1.6 * _THRESHOLD))
    dress(fig, 400).update_layout(showlegend=True, margin_t=90)
    intervals = "; ".join(f"{words}: {found['words'].sel(data=data).item()}" for data, words in _DATA.items())
    caption = (
        f"The other nine are fitted anew at each value of {name}, each fit from the last one: these are the least "
        f"misfits found, perhaps not the least of all. Series are those of the first fit (synthetic). {intervals}."
    )
    return Panel(f"Crawling: profile likelihood of {name}", caption, fig)


def gaits_panel(found: "xr.Dataset") -> Panel:
    """Speed over the place of the buoyancy, density by density, and how many feet carry."""
    angles, distances = np.degrees(found["angle"].values), 1e3 * found["distance"].values
    x, y = MapAxis(angles, "beta (deg)"), MapAxis(distances, "b (mm)")
    speeds = {f"{rho:.0f} kg/m3": 1e3 * found["speed"].sel(density=rho).values for rho in found["density"].values}
    fig = maps(x, y, speeds, diverging(np.stack([*speeds.values()]), "mm/s"))
    for col, rho in enumerate(found["density"].values, start=1):
        one = found.sel(density=rho)
        speed, feet = 1e3 * one["speed"].values, one["feet"].values
        dark = np.abs(speed) > 0.5 * np.nanmax(np.abs(1e3 * found["speed"].values))
        at = np.meshgrid(angles, distances)
        words = [str(int(n)) if n else "x" for n in feet.ravel()]
        font = {"color": ["white" if one else BLACK for one in dark.ravel()], "size": 11}
        shown = {"hoverinfo": "skip", "row": 1, "col": col}
        fig.add_scatter(x=at[0].ravel(), y=at[1].ravel(), text=words, mode="text", textfont=font, **shown)
        if rho == OWN[0]:
            marker = {"symbol": "square-open", "size": 24, "color": "white", "line": {"width": 2}}
            fig.add_scatter(x=[OWN[2]], y=[1e3 * OWN[1]], mode="markers", marker=marker, **shown)
    caption = (
        "Simulated speed with the parameters of Table 3 over density and place of the buoyancy, b from the "
        "centre of mass at an angle beta ahead of straight above it; the numbers say how many feet carry (x: it "
        "falls). Framed: what the paper calls its fastest configuration; the others that it tried are not printed."
    )
    dress(fig, 380).update_layout(margin_t=64)
    return Panel("Crawling: gaits over density and buoyancy", caption, fig)
