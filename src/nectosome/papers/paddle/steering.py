"""Steering by strokes of unequal size: how fast and how tightly the rowing robot turns when one side rows less."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from nectosome.core import State, Status
from nectosome.io import RobotDescription, get_value, with_values
from nectosome.robots import build
from nectosome.solve import periodic


class Turn(NamedTuple):
    """A motion along a circle."""

    rate: float  # of the heading [rad/s], positive to the left
    radius: float  # of the hull centre's path from cycle to cycle [m]; inf where it goes straight
    speed: float  # along it [m/s]
    state: State  # at the start of a cycle


def turn(robot: RobotDescription, left: float, right: float, guess: State | None = None) -> Turn:
    r"""Steady turn of a robot that is free in all directions, with these amplitudes [rad] on its sides.

    A cycle moves the hull's centre by d and turns it by $\psi$, along a circle of radius $|d| / 2 |\sin(\psi/2)|$. That
    the free robot would pitch away, since nothing rights it, does not matter here: its cycle lies in the plane. Raises
    RuntimeError with the reason where no cycle is found.
    """
    frequency = float(get_value(robot, "f"))
    built = build(with_values(robot, {"A_left": left, "A_right": right}))
    cycle = periodic(built, 1 / frequency, guess=guess, samples=2, rtol=1e-4, atol=1e-6)
    if int(cycle.status) not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
        raise RuntimeError(f"turn with amplitudes {left:.3f}, {right:.3f} rad: {Status(int(cycle.status)).reason}")
    q = np.asarray(cycle.value.state.q)
    turned = Rotation.from_quat(q[:, 3:7], scalar_first=True)
    centres = q[:, :3] + turned.apply([0.5 * float(get_value(robot, "body.length")), 0.0, 0.0])
    psi = float((turned[1] * turned[0].inv()).as_rotvec()[2])
    way = float(np.linalg.norm(centres[1] - centres[0]))
    curved = 2 * abs(np.sin(0.5 * psi))
    return Turn(psi * frequency, way / curved if curved > 1e-9 else np.inf, way * frequency, cycle.state)
