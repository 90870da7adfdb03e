"""Steering by strokes of unequal size: how fast and how tightly the rowing robot turns when one side rows less."""

from typing import NamedTuple

import jax
import numpy as np

from nectosome.core import Status
from nectosome.io import RobotDescription, get_value, with_values
from nectosome.robots import build
from nectosome.solve import simulate

_WAIT = 10  # times eight cycles


class Turn(NamedTuple):
    """A motion along a circle."""

    rate: float  # of the heading [rad/s], positive to the left
    radius: float  # of the hull centre's path from cycle to cycle [m]; inf where it goes straight
    speed: float  # along it [m/s]


def turn(robot: RobotDescription, left: float, right: float) -> Turn:
    r"""Steady turn of the planar robot with these amplitudes [rad] on its sides.

    A cycle moves the hull's centre by d and turns it by $\psi$, along a circle of radius $|d| / 2 |\sin(\psi/2)|$. The
    robot swims from rest until two cycles agree to 1e-4. Raises RuntimeError where they do not.
    """
    frequency, length = (float(get_value(robot, name)) for name in ("f", "body.length"))
    built, state = build(with_values(robot, {"A_left": left, "A_right": right})), None
    ends = [0.0, 6 / frequency, 7 / frequency, 8 / frequency]
    for _ in range(_WAIT):
        run = simulate(built, ends[-1], samples=ends, initial=state)
        if int(run.status) != Status.SOLVED:
            raise RuntimeError(f"turn with {left:.3f}, {right:.3f} rad: {Status(int(run.status)).reason}")
        state = jax.tree.map(lambda x: x[-1], run.value.state)
        x, y, yaw = np.asarray(run.value.state.q)[1:, :3].T
        psi = np.diff(yaw)
        way = np.hypot(*np.diff([x + 0.5 * length * np.cos(yaw), y + 0.5 * length * np.sin(yaw)]))
        if max(abs(psi[1] - psi[0]), abs(way[1] - way[0]) / length) < 1e-4 * (0.01 + abs(psi[1])):
            curved = 2 * abs(float(np.sin(0.5 * psi[1])))
            radius = float(way[1]) / curved if curved > 1e-9 else np.inf
            return Turn(float(psi[1]) * frequency, radius, float(way[1]) * frequency)
    raise RuntimeError(f"turn with {left:.3f}, {right:.3f} rad: still changing after {8 * _WAIT} cycles")
