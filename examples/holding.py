"""Two goals: filaments that swim fast when motors turn them, and hold a bar firmly when their tendons are pulled."""

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

import nectosome as ns
from nectosome.core import Status
from nectosome.description.variables import read_variable
from nectosome.designs import Limit, MotionDesign
from nectosome.search import Evaluation, Gradient, Nsga2, Task, front, minimise, multistart

WINCH, STRAIN = 30.0, 0.3  # what the winch gives [N] and the material takes [1]: both assumed
RATES = np.linspace(4.0, 22.0, 10)  # of the motor [rad/s]
CLOSED, END = 2.0, 3.5  # s: when the filament has closed, and when the bar is 60 mm further out
HULL = 0.5 * math.pi * 0.09**2  # m2: each of two flagella pushes half of the hull of `flagella2`
FINE = 2  # how many times as fine the chosen designs are computed once more

# describe: the swimmer is a flagellum on a rail, its tendon slack; what it holds with has a file of its own
half = [f"body.loads.hull_drag.drag_area=[{HULL} m2, 0 m2, 0 m2]", "limbs.filament.radius=12.5mm", "alpha=45deg"]
swimmer = ns.apply_settings(ns.describe("flagellum"), half)
holder = ns.describe(str(Path(__file__).with_name("holding.yaml")))

# change: three numbers of the filament that both goals share, and the motor's speed, which is free
ranges = {"L": "300..600mm", "tip_radius": "4..10mm", "E": "0.5..10MPa log"}
ranges["omega"] = "3..22rad/s"
variables = tuple(read_variable(name, text, swimmer) for name, text in ranges.items())
motion = MotionDesign(swimmer, variables, constraints=(Limit("torque", True, 0.5),), forward="-x")
swim = motion.prepare()


def design(u):
    """Length [m], tip radius [m], Young's modulus [Pa], and tension [N] of a design in the unit box.

    The tension is the winch's, or what strains the bent free tip as much as it takes: T 0.7 r = E J strain/r.
    """
    length, tip, young, _ = motion.box.values(np.append(u, 0.0))
    return length, tip, young, min(WINCH, STRAIN * young * 0.25 * math.pi * tip**2 / 0.7)


def settings(u, part, finer):
    """Settings of a filament, with strain orders and points so many times as fine."""
    length, tip, young, _ = design(u)
    orders = ", ".join(f"{name}: {finer * order}" for name, order in part.strains.items())
    fine = [f"limbs.filament.strains={{{orders}}}", f"limbs.filament.points={finer * part.points}"]
    return [f"L={length} m", f"tip_radius={tip} m", f"E={young} Pa", *fine]


def fastest(u):
    """Speed of the fastest steady swim within the motor's 0.5 N m [m/s], and its motor speed [rad/s]; None if none."""
    found, memory = [], None
    for rate in RATES:
        e = swim(np.append(u, (rate - 3.0) / 19.0), False, memory)
        memory = e.memory if e.solved else memory
        if e.feasible(0.0):
            found.append((e.outputs["speed"], float(rate)))
    return max(found, default=None)


def held(u, finer=1):
    """Run in which the filament closes round the bar, which is drawn out, and the largest pull of two of them [N]."""
    *_, tip, _, tension = design(u)
    pulled = [f"tension={tension} N", f"tip_tendon={0.7 * tip} m"]
    described = ns.apply_settings(holder, [*settings(u, holder.limbs["filament"], finer), *pulled])
    run = ns.simulate(described, END, samples=351, rtol=1e-4 / finer, atol=1e-6 / finer)
    data = run.to_dataset()
    pull = -2.0 * data["reaction"].sel(prescribed="bar.position")
    return data, float(pull[data["time"] >= CLOSED].max())


def finely(u, rate):
    """Speed [m/s], how the steady swim was solved, and pull [N], computed more finely."""
    described = [*settings(u, swimmer.limbs["filament"], FINE), f"omega={rate} rad/s"]
    found = ns.steady(ns.apply_settings(swimmer, described))
    speed = -float(found.to_dataset()["velocity"].sel(part="body", axis="x")[0])
    return speed, Status(int(found.status)).name, held(u, FINE)[1]


class SwimAndHold(Task):
    """Speed and pull of a design as two objectives, negative, since a search makes things low."""

    names, objectives = ("length", "tip_radius", "young"), 2

    def key(self):
        """Name of the task."""
        return "swim and hold"

    def prepare(self):
        """Return what evaluates a design."""

        def evaluate(u, derivatives, memory):
            (data, pull), best = held(u), fastest(u)
            if data.attrs["status"] != "SOLVED":
                return Evaluation.unsolved(u, 0, data.attrs["status_reason"])
            if best is None:
                return Evaluation.unsolved(u, 0, "no steady swim within the motor's torque")
            return Evaluation(u, -best[0], np.zeros(0), others=np.array([-pull]), outputs={"rate": best[1]})

        return evaluate


# run: the fastest swimmer, by derivatives, and from there a search for the front
with ThreadPoolExecutor(1) as one:
    best = multistart(motion, Gradient(objective_tolerance=0), 6, seed=1, executor=one).best()[0].best
optimiser = Nsga2(population=16, evaluations=320)
designs = minimise(SwimAndHold(), optimiser, best.u[:3], seed=1, progress=lambda made, _: print(f"{made} designs"))
members = front(designs.evaluations)
goals = np.array([-e.objectives for e in members])
halfway = int(np.argmin(np.abs(goals[:, 1] - goals[[0, -1], 1].mean())))
chosen = {"fastest": 0, "between": halfway, "firmest": len(members) - 1}

# print: the three, and what they give when computed more finely
fine, shapes = [], []
for name, k in chosen.items():
    u, rate = members[k].u, members[k].outputs["rate"]
    length, tip, young, tension = design(u)
    speed, status, pull = finely(u, rate)
    size = f"{1e3 * length:.0f} mm, tip {1e3 * tip:.1f} mm, {young / 1e6:.2f} MPa"
    print(f"{name}: {size}, {tension:.1f} N, {rate:.0f} rad/s")
    print(f"    {goals[k][0]:.3f} m/s, {goals[k][1]:.2f} N; more finely {speed:.3f} m/s ({status}), {pull:.2f} N")
    fine.append((speed, pull))
    shapes.append(held(u)[0][["position", "rotation", "half_width"]].sel(time=CLOSED, method="nearest"))

# save: all designs, and the shapes of the three as they begin to be drawn out
solved = [e for e in designs.evaluations if e.solved]
table = {
    "design": (("number", "variable"), [design(e.u) for e in solved]),
    "goals": (("number", "goal"), [-e.objectives for e in solved]),
    "front": ("member", [solved.index(e) for e in members]),
    "chosen": ("name", [solved.index(members[k]) for k in chosen.values()]),
    "fine": (("name", "goal"), fine),
}
found = xr.Dataset(table, coords={"name": [*chosen], "goal": ["speed", "pull"]})
found = found.assign_coords(variable=["length", "tip_radius", "young", "tension"])
Path("out").mkdir(exist_ok=True)
ns.save_dataset(found.merge(xr.concat(shapes, "name"), compat="override"), "out/holding.nc")
