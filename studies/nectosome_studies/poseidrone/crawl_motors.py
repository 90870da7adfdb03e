"""Crawling with each leg's crank on a DC motor: the torque that cranks take, and the crawl on motors that can give it.

The paper turns each leg by a small DC motor with a gear at a constant speed, about 12.6 rad/s (section 3), and prints
nothing else about it. Here the crawler with Table 3's parameters, in what the paper calls its fastest configuration,
walks twice: with cranks at exactly that speed, and with a velocity loop on motors whose numbers are all assumptions:

- a speed without a load of twice that, a stall torque of three times the largest torque of the ideal cranks, both at
  6 V, the voltage of the supply; nothing is lost in the gear;
- an inertia of rotor and gear with which a motor without a load and a loop starts with a time constant of 20 ms;
- the full voltage from an error of 2 rad/s on, and an integral time of 0.3 s. Without the integral the speed would be
  0.93 rad/s too low without any load: that error gives the share of the voltage that 11.67 of 25.2 rad/s need.
"""

import math
from typing import Any

import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.description import RobotDescription
from nectosome.description.cranks import LegLoad
from nectosome.description.drives import AngularServo, AngularVelocityLoop
from nectosome.description.joints import RevoluteJoint
from nectosome.description.parts import Rigid
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

from ..study import Progress, StudyPart

SPEED = 12.6  # of the cranks [rad/s]
# assumptions
VOLTAGE, FULL_AT, INTEGRAL = 6.0, 2.0, 0.3  # V, rad/s, s
NO_LOAD, STALL = 2.0, 3.0  # over the speed, and over the largest torque at that speed
START = 0.02  # time constant of rotor and gear [s]
TURNS, LAST, PER_TURN = 30, 10, 500  # turns of a crawl, those of which means are taken, samples of each
_WEIGHTLESS = 1e-9  # kg


def legs(robot: RobotDescription) -> dict[str, LegLoad]:
    """The legs of its body, by name."""
    return {name: load for name, load in robot.parts["body"].loads.items() if isinstance(load, LegLoad)}


def servo(torque: float, count: float = 1.0) -> AngularServo:
    """So many of the motors that are chosen for a largest torque of a leg's crank [N m]."""
    stall, no_load = count * STALL * torque, NO_LOAD * SPEED
    return AngularServo(
        rated_voltage=VOLTAGE,
        stall_torque=stall,
        no_load_speed=no_load,
        inertia=START * stall / no_load,
        supply=VOLTAGE,
        velocity_loop=AngularVelocityLoop(full_voltage_at=FULL_AT, integral_time=INTEGRAL),
    )


def on_cranks(robot: RobotDescription, torque: float | None = None) -> RobotDescription:
    """The robot whose legs' cranks ideal drives turn, or motors that are chosen for a largest torque of a crank [N m].

    A leg that stands for two side by side has the motors of both.
    """
    loads, limbs = dict(robot.parts["body"].loads), dict(robot.limbs)
    for name, leg in legs(robot).items():
        drive: dict[str, Any] = {"motion": {"kind": "rate", "rate": SPEED}}
        if torque is not None:
            drive["servo"] = servo(torque, leg.count)
        hinge = RevoluteJoint.model_validate({"kind": "revolute", "axis": (0.0, -1.0, 0.0), **drive})
        crank = f"{name}_crank"
        loads[name] = leg.model_copy(update={"speed": None, "turned_by": crank})
        limbs[crank] = Rigid(kind="rigid", shape="point", mass=_WEIGHTLESS, volume=0.0, joint=hinge)
    return robot.with_part("body", loads=loads).model_copy(update={"limbs": limbs, "aliases": {}})


def crawl(robot: RobotDescription, turns: int = TURNS) -> xr.Dataset:
    """The last turns of a crawl from rest of a robot of `on_cranks`.

    Over time and leg, of one of the `count` legs that it stands for: `torque` that its drive gives [N m], `rate` of the
    crank [rad/s], `electrical_power` [W], NaN of ideal drives. Attribute: the mean `speed` along x [m/s]. Raises
    RuntimeError where the simulation fails.
    """
    first = turns - LAST
    times = np.append(0.0, math.tau / SPEED * np.linspace(first, turns, LAST * PER_TURN + 1))
    run = simulate(build(robot), times[-1], samples=times.tolist(), rtol=1e-6, atol=1e-9)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"crawl on cranks: {Status(int(run.status)).reason}")
    found = run.to_dataset().isel(time=slice(1, None))
    counts = np.array([leg.count for leg in legs(robot).values()])
    cranks = [f"{name}_crank.angle" for name in legs(robot)]
    if "motor_torque" in found:
        moved = found.sel(motor=cranks)
        torque, rate, power = (moved[name].values for name in ("motor_torque", "motor_rate", "electrical_power"))
    else:
        torque = found["reaction"].sel(prescribed=cranks).values
        rate, power = np.full_like(torque, SPEED), np.full_like(torque, np.nan)
    x, time = found["position"].values[:, 0, 0], found["time"].values
    over = ("time", "leg")
    return xr.Dataset(
        {
            "torque": (over, torque / counts, {"units": "N m"}),
            "rate": (over, rate, {"units": "rad/s"}),
            "electrical_power": (over, power / counts, {"units": "W"}),
            "count": ("leg", counts),
        },
        {"time": ("time", time, {"units": "s"}), "leg": [*legs(robot)]},
        {"speed": float(x[-1] - x[0]) / float(time[-1] - time[0])},
    )


def compared(turns: int = TURNS) -> dict[str, xr.Dataset]:
    """The crawl with ideal drives, `crawl_cranks`, and on motors chosen for the torque of these, `crawl_motors`."""
    robot = describe("poseidrone_crawl")
    ideal = crawl(on_cranks(robot), turns)
    return {"crawl_cranks": ideal, "crawl_motors": crawl(on_cranks(robot, largest_torque(ideal)), turns)}


def largest_torque(crawled: xr.Dataset) -> float:
    """Largest torque on the crank of a leg [N m]."""
    return float(np.abs(crawled["torque"]).max())


def numbers(found: dict[str, xr.Dataset]) -> dict[str, float | None]:
    """By scorecard row: mean powers are of all legs; the mean torque is of the leg that has the largest mean."""
    ideal, motors = found["crawl_cranks"], found["crawl_motors"]
    power = ideal["torque"] * ideal["rate"]
    return {
        "poseidrone/crawl/crank/speed": ideal.attrs["speed"],
        "poseidrone/crawl/crank/largest-torque": largest_torque(ideal),
        "poseidrone/crawl/crank/mean-torque": float(ideal["torque"].mean("time").max()),
        "poseidrone/crawl/crank/largest-power": float(power.max()),
        "poseidrone/crawl/crank/mean-power": _of_all(ideal, power),
        "poseidrone/crawl/motor/speed": motors.attrs["speed"],
        "poseidrone/crawl/motor/dip": SPEED - float(motors["rate"].min()),
        "poseidrone/crawl/motor/mean-power": _of_all(motors, motors["electrical_power"]),
    }


def _of_all(crawled: xr.Dataset, power: xr.DataArray) -> float:
    """Mean over time of the power of all legs [W]; the last sample is the first of the next turn."""
    return float((power * crawled["count"]).isel(time=slice(-1)).mean("time").sum())


def part(quick: bool, progress: Progress) -> StudyPart:
    """Cranks and motors, for the study."""
    progress("crawling on motors", 0.0)
    found = compared()
    return StudyPart(numbers(found), found)
