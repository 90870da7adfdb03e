"""Four soft flagella roll, swim straight or turn: the cycles of a robot that is free to go where it likes."""

from pathlib import Path

import numpy as np
from plotly.subplots import make_subplots

import nectosome as ns
from nectosome.solve import screw_of
from nectosome.view.page import write_page
from nectosome.view.style import BLUE, VERMILLION, Panel, dress

FULL = 14.4  # rad/s


# describe: the mirror image of a flagellum where it turns the other way, in a model that is quick to solve
def swimmer(senses, speeds):
    """Four flagella that turn one way (1) or the other (-1) at those speeds [rad/s]."""
    robot = ns.flagella(4)
    limbs = dict(robot.limbs)
    settings = []
    for k, (sense, speed) in enumerate(zip(senses, speeds, strict=True), start=1):
        coarse = {"strains": {"bending_y": 0, "bending_z": 0}, "points": 3}
        limbs[f"filament{k}"] = limbs[f"filament{k}"].model_copy(update=coarse)
        settings.append(f"limbs.shaft{k}.joint.motion.rate={sense * speed} rad/s")
        settings += [f"limbs.{part}{k}.loads.drag.lift={-0.1 * sense}" for part in ("hook", "filament")]
    return ns.apply_settings(robot.model_copy(update={"limbs": limbs}), settings)


# run: a cycle lasts until all motors are where they were; place and heading go on
def cycle(senses, speeds, turns=1):
    """Numbers of a cycle of so many turns at full speed."""
    robot = swimmer(senses, speeds)
    found = ns.periodic(robot, 2 * np.pi * turns / FULL)
    return found.to_dataset()


def mean(run, values):
    """Mean over a cycle."""
    return np.trapezoid(values, run["time"].values, axis=0) / run["time"].values[-1]


def balance(run):
    """Difference of the mean powers that drives give and loads take, relative to them."""
    drives, loads = mean(run, run["reaction_power"].values).sum(), mean(run, run["load_power"].values).sum()
    return abs(drives + loads) / drives


def screw(run):
    """How the canister moves in a cycle."""
    return screw_of(*((run["rotation"].values[i, 0], run["position"].values[i, 0]) for i in (0, -1)))


# print: roll against how many flagella turn the other way
print("turning the other way   roll (rad/s)   speed (m/s)   mean powers differ by   status")
rolls = []
for senses in ((1, 1, 1, 1), (1, -1, 1, 1), (1, -1, 1, -1)):
    run = cycle(senses, [FULL] * 4)
    rolls.append(abs(mean(run, run["v"].sel(coordinate="body.wx").values)))
    way = np.diff(run["position"].values[[0, -1], 0], axis=0)
    speed = np.linalg.norm(way) / float(run["time"][-1])
    print(f"{senses.count(-1)} of 4 {rolls[-1]:30.3f} {speed:13.3f} {balance(run):15.0e} {run.attrs['status']:>15}")

# print: turning where two neighbours are slower than the other two; each pair has both senses
print("slower pair at   turn (deg/s)   radius (m)   pitch (m)   mean powers differ by   status")
ratios, rates, radii = [1.0], [np.degrees(screw(run).angle) / float(run["time"][-1])], [np.inf]  # the last run
for ratio, period in ((0.5, 2), (0.0, 1)):
    run = cycle((1, -1, 1, -1), [FULL, FULL, ratio * FULL, ratio * FULL], turns=period)
    circle = screw(run)
    ratios.append(ratio)
    rates.append(np.degrees(circle.angle) / float(run["time"][-1]))
    radii.append(circle.radius(run["position"].values[0, 0]))
    pitch = 2 * np.pi * circle.along / circle.angle
    print(
        f"{ratio:.1f} {rates[-1]:22.2f} {radii[-1]:12.2f} {pitch:12.0e} {balance(run):15.0e} {run.attrs['status']:>15}"
    )

# save: numbers of the last cycle, and a figure of all
Path("out").mkdir(exist_ok=True)
ns.save_dataset(run, "out/turning.nc")
figure = make_subplots(1, 2, horizontal_spacing=0.14)
dots = {"mode": "lines+markers", "marker_size": 9}
figure.add_scatter(x=[0, 1, 2], y=rolls, line={"color": BLUE, "dash": "dot"}, row=1, col=1, **dots)
labels = ["", *(f"radius {radius:.2f} m" for radius in radii[1:])]
texts = {"mode": "lines+markers+text", "text": labels, "textposition": "middle right", "marker_size": 9}
figure.add_scatter(x=ratios, y=rates, line={"color": VERMILLION, "dash": "dot"}, row=1, col=2, **texts)
figure.update_xaxes(title="flagella that turn the other way, of 4", tickvals=[0, 1, 2], row=1, col=1)
figure.update_yaxes(title="rate of roll (rad/s)", row=1, col=1)
figure.update_xaxes(title="speed of the slower pair / of the faster pair", row=1, col=2)
figure.update_yaxes(title="rate of turning (deg/s)", row=1, col=2)
caption = (
    f"Simulated cycles of four flagella at {FULL} rad/s on one free canister, in a coarse model whose filaments bend "
    "evenly. Left: mean rate of roll. Right: two turn one way and two the other, and one pair of neighbours is slower. "
    "Only the dots are computed."
)
panel = Panel("Rolling and turning", caption, dress(figure, 400))
write_page("out/turning.html", panel.title, [panel])
