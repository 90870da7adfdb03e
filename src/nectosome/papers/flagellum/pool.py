"""The pool swims (Figs. 9, 10): a hull drag calibrated on the old design, the new one predicted; reactions over a turn.

Neither motor speed nor hull drag is printed. The motor is run "at the maximum speed that can be reached": it is taken
to work on its torque-speed line, 0.89 N m at a standstill and 22 rad/s without load.
"""

import math
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr
from scipy.optimize import brentq

from nectosome.core import State, Status
from nectosome.io import RobotDescription, get_value, with_values
from nectosome.mechanism import Robot
from nectosome.robots import build
from nectosome.solve import steady

STALL, NO_LOAD = 0.89, 22.0  # N m, rad/s
_DRAG = "body.loads.hull_drag.drag_area.0"
_RATE = "limbs.shaft.joint.motion.rate"


class Swim(NamedTuple):
    """A steady swim on the motor's line."""

    rate: float  # [rad/s]
    speed: float  # [m/s]
    torque: float  # [N m]


def on_motor_line(description: RobotDescription, extra_drag_area: float = 0.0) -> Swim:
    """Steady swim at the motor speed whose torque the motor can give; extra drag area [m2] on the hull."""
    area = float(get_value(description, _DRAG)) + extra_drag_area
    state: State | None = None
    last: dict[float, Swim] = {}

    def surplus(rate: float) -> float:
        nonlocal state
        found = steady(build(with_values(description, {_RATE: rate, _DRAG: area})), guess=state)
        if int(found.status) not in (Status.SOLVED, Status.UNSTABLE):
            raise RuntimeError(f"pool: {Status(int(found.status)).reason} at {rate:.3g} rad/s")
        state = found.state
        dataset = found.to_dataset(description)
        speed = -float(dataset["velocity"].sel(part="body", axis="x")[0])
        last[rate] = Swim(rate, speed, float(dataset["reaction"][0, 0]))
        return STALL * (1 - rate / NO_LOAD) - last[rate].torque

    rate = float(np.asarray(brentq(surplus, 0.05 * NO_LOAD, NO_LOAD, xtol=1e-6)))
    surplus(rate)
    return last[rate]


def pool_swims(old: RobotDescription, new: RobotDescription, printed: dict[str, float]) -> xr.Dataset:
    """Old and new design in the pool: the drag area that makes the old one swim as fast as printed, and both swims."""
    target = printed["old"]

    def too_fast(log_area: float) -> float:
        return on_motor_line(old, math.exp(log_area)).speed - target

    area = math.exp(float(np.asarray(brentq(too_fast, math.log(1e-4), math.log(10.0), xtol=1e-6))))
    swims = [on_motor_line(design, area) for design in (old, new)]
    return xr.Dataset(
        {
            "ours": ("design", [swim.speed for swim in swims], {"units": "m/s"}),
            "rate": ("design", [swim.rate for swim in swims], {"units": "rad/s"}),
            "torque": ("design", [swim.torque for swim in swims], {"units": "N m"}),
            "printed_simulated": ("design", [printed["old"], printed["new"]], {"units": "m/s"}),
            "printed_measured": ("design", [printed["old_measured"], printed["new_measured"]], {"units": "m/s"}),
            "kind": ("design", ["calibration", "prediction"]),
        },
        coords={"design": ["old", "new"]},
        attrs={"hull_drag_area": area},
    )


def reaction_over_a_turn(robot: Robot, x: State, parts: tuple[str, ...]) -> xr.Dataset:
    """Wrench that turning parts give to what carries them, in the world about its origin, at 72 angles of one turn.

    A steady motion turns with the shaft about x, so that its wrench at one angle tells all.
    """
    acting = robot.forces(jnp.zeros(()), x, jnp.zeros_like(x.v))
    total = np.zeros((len(robot.tree.parts), 6))
    for i, place in enumerate(robot.tree.layout):
        wrench = np.asarray(acting.fluid - acting.inertia)[place.stations]
        for attached, w in zip(robot.loads, acting.wrenches, strict=True):
            wrench = wrench + (np.asarray(w) if attached.part == i and w is not None else 0.0)
        R, p = (np.asarray(a)[place.stations] for a in (acting.shape.rotation, acting.shape.position))
        moment, force = (np.einsum("nij,nj->ni", R, part) for part in (wrench[:, :3], wrench[:, 3:]))
        total[i] = np.concatenate([(moment + np.cross(p, force)).sum(axis=0), force.sum(axis=0)])
    carried = total[[robot.tree.part(name) for name in parts]].sum(axis=0)
    angle = 2 * np.pi * np.arange(72) / 72
    c, s, one = np.cos(angle), np.sin(angle), np.ones_like(angle)
    turn = np.zeros((72, 3, 3))
    turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2], turn[:, 2, 1], turn[:, 1, 2] = one, c, c, s, -s
    names = ["moment x", "moment y", "moment z", "force x", "force y", "force z"]
    values = np.concatenate([turn @ carried[:3], turn @ carried[3:]], axis=1)
    return xr.Dataset({"wrench": (("angle", "component"), values)}, coords={"angle": angle, "component": names})
