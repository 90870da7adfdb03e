"""PoseiDRONE's swimmer in water by published laws, beside the one that was identified from its swims.

Added mass and drag of Table 1 are measurements of the real robot: nothing is better. What laws of shape say of a hull
of the assumed size, the 16 cm by 95 mm of the robot with its module, tells how much of them is not the hull. Its added
mass is that of a spheroid along its axis (Lamb 1932) and the water in the chamber, on average; its drag is that of a
sphere, 0.47 of the frontal area at Reynolds numbers from 1e3 to 1e5 (Hoerner 1965, ch. 3).
"""

import math

import jax.numpy as jnp
import numpy as np

from nectosome.core import Status
from nectosome.description import RobotDescription, get_value, with_values
from nectosome.loads.added_mass import lamb_coefficients
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import periodic

from .recordings import chamber

_BLUNT = 0.47  # drag of a sphere over its frontal area
_ADDED, _DRAG = "body.loads.water.mass.0", "body.loads.drag.drag_area.0"


def numbers() -> dict[str, float]:
    """Mean speed over a pulse and its swing by scorecard row. Raises RuntimeError where no cycle is found."""
    robot, hull = describe("poseidrone_swim"), describe("poseidrone")
    length, radius, volume = (get_value(hull, f"limbs.module.{name}") for name in ("length", "radius", "volume"))
    along, *_ = lamb_coefficients(jnp.asarray(0.5 * length / radius))
    added = get_value(robot, "water.density") * float(along * volume + np.mean(chamber().volume))
    pieces = {"added-mass": {_ADDED: added}, "hull": {_DRAG: _BLUNT * math.pi * radius**2}}
    waters = {"paper": {}, **pieces, "all": pieces["added-mass"] | pieces["hull"]}
    rows: dict[str, float] = {}
    for name, values in waters.items():
        speed, swing = _swim(with_values(robot, values))
        rows |= {f"poseidrone/better-water/{name}/speed": speed, f"poseidrone/better-water/{name}/swing": swing}
    return rows


def _swim(robot: RobotDescription) -> tuple[float, float]:
    """Mean speed over a pulse, and how far it swings [m/s]."""
    frequency = get_value(robot, "body.joint.force.frequency")
    found = periodic(build(robot), 1 / frequency)
    if (status := Status(int(found.status))) not in (Status.SOLVED, Status.SETTLED):
        raise RuntimeError(f"swim of {robot.name}: {status.reason}")
    state = found.value.state
    way, speed = np.asarray(state.q)[:, 0], np.asarray(state.v)[:, 0]
    return float(way[-1] - way[0]) * frequency, float(np.ptp(speed))
