"""How far the paddles of one robot may differ: a recipe fixed before the first robot of its kind swam.

Nobody printed how well the robot was made. Numbers printed twice for one thing, last digits, and the makers' sheets of
its parts say something of it:

| of each | differs by | since |
|---|---|---|
| joint | stiffness, normal, 1.84 % | 0.032, 0.031, 0.031 N m/rad of Table 2: their standard deviation by their mean |
| paddle | mass, normal, 2.40 % | 3 x 10 g of Table 2, 29 g of Table 4: the same |
| paddle | Cn, even within 1.25 % | the width of 0.040 m is printed to a millimetre, and drag goes with Cn w |
| paddle | amplitude, even within 0.169 deg | XW540-T140: half a step of 360/4096 deg, half a backlash of 0.25 deg |
| paddle | lag, even from 0 to 8.3 ms | goals go one after another to four servos: 0 to 3 packets of 16 bytes (below) |
| yaw sample | noise, normal, 0.1 deg | JY61: accuracy while moving; its yaw drifts, not printed by how much: left out |

A packet that sets a goal has 16 bytes of 10 bits each, at 57 600 baud unless set otherwise (ROBOTIS, Protocol 2.0).
All are independent of each other. Other parts, the hull and the way it is trimmed are taken to be perfect.
"""

import math

import numpy as np

from nectosome.description import RobotDescription, get_value, resolve, with_values
from nectosome.robots.beetle import PADDLES


def _spread(*printed: float) -> float:
    """Sample standard deviation of numbers printed for one thing, relative to their mean."""
    return float(np.std(printed, ddof=1) / np.mean(printed))


STIFFNESS = _spread(0.032, 0.031, 0.031)
MASS = _spread(30.0, 29.0)
CN = 0.5 / 40
AMPLITUDE = math.radians(0.5 * 360 / 4096 + 0.5 * 0.25)  # rad
LAG = 3 * 16 * 10 / 57600  # s
YAW_NOISE = math.radians(0.1)  # rad


def made(robot: RobotDescription, rng: np.random.Generator) -> RobotDescription:
    """One robot as it may have been made from its description."""
    frequency = get_value(robot, "f")
    values: dict[str, float] = {}

    def scale(path: str, by: float) -> None:
        values[path] = get_value(robot, path) * by

    for place in PADDLES:
        mass, cn = 1 + MASS * rng.normal(), 1 + CN * rng.uniform(-1, 1)
        for segment in (name for name in robot.limbs if name.startswith(f"{place}_segment")):
            scale(f"limbs.{segment}.joint.flexure.young", 1 + STIFFNESS * rng.normal())
            scale(f"limbs.{segment}.mass", mass)
            scale(f"limbs.{segment}.loads.drag.normal", cn)
        amplitude, phase = f"limbs.{place}_arm.joint.motion.amplitude", resolve(robot, f"phase_{place}")[0]
        values[amplitude] = get_value(robot, amplitude) + AMPLITUDE * rng.uniform(-1, 1)
        values[phase] = get_value(robot, phase) - 2 * math.pi * frequency * LAG * rng.uniform()
    return with_values(robot, values)
