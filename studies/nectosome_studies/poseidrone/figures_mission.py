"""Figures of PoseiDRONE's missions: that of Fig. 6, and the shortest one across the tank and back.

Data of the study: `mission`, `mission_turning`, `schedule_assumed`, `schedule_shortest` as `solve.mission_data` has
them; `schedule_cranks`: time (speed), best (variable) in words.
"""

from nectosome.view.mission import above_panel, mission_panel, set_panel
from nectosome.view.style import BLUE, VERMILLION, Panel, dress

from .. import charts
from ..study import Sets

_NAMES = {"schedule_assumed": ("assumed", BLUE), "schedule_shortest": ("shortest found", VERMILLION)}


def panels(sets: Sets) -> list[Panel]:
    """Fig. 6, the quantities that its modes set, and a robot that turns round where the study has one."""
    first = mission_panel(sets["mission"])
    out = [first._replace(title=f"{first.title}, as Fig. 6"), set_panel(sets["mission"])]
    if "mission_turning" in sets:
        turned = above_panel(sets["mission_turning"])
        caption = "The crawler, free in space, turns round at the wall: left and right legs go opposite ways. "
        out.append(turned._replace(title="Turning round, seen from above", caption=caption + turned.caption))
    return out


def schedule_panels(sets: Sets) -> list[Panel]:
    """The shortest schedule beside the assumed one, and its time over the speed of the legs."""
    return [path_panel(sets), charts.panels("poseidrone", sets)["Time over the speed of the legs"]]


def path_panel(sets: Sets) -> Panel:
    """Place along the tank and height over time, on both schedules."""
    from plotly.subplots import make_subplots

    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    for key, (name, colour) in _NAMES.items():
        found = sets[key]
        for row, of in enumerate(("x", "z"), start=1):
            label = f"{name}: {float(found['time'][-1]):.1f} s"
            line = {"color": colour, "width": 2}
            x, y = found["time"].values, found["position"].sel(axis=of).values
            fig.add_scatter(x=x, y=y, mode="lines", line=line, name=label, showlegend=row == 1, row=row, col=1)
        ends = found["event_time"].values
        at = found.sel(time=~found.indexes["time"].duplicated()).interp(time=ends)
        shown = {"mode": "markers", "marker": {"color": colour, "size": 8}, "hovertemplate": "%{text} at %{x:.1f} s"}
        words = [f"{mode} ends" for mode in found["event_mode"].values]
        y = at["position"].sel(axis="z").values
        fig.add_scatter(x=ends, y=y, text=words, showlegend=False, row=2, col=1, **shown)
    fig.update_yaxes(title="place along<br>the tank (m)", row=1, col=1)
    fig.update_yaxes(title="height (m)", row=2, col=1)
    fig.update_xaxes(title="time (s)", row=2, col=1)
    best = sets["schedule_cranks"]
    chosen = ", ".join(f"{n} = {x}" for n, x in zip(best["variable"].values, best["best"].values, strict=True))
    caption = (
        f"Across the tank by the jet and back on the legs. The shortest found: {chosen}. Dots are where modes end. "
        "Simulated; jet and times of the assumed schedule are printed nowhere."
    )
    return Panel("Across the tank and back", caption, dress(fig, 460).update_layout(showlegend=True, margin_t=60))
