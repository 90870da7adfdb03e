r"""Steering by strokes of unequal size: how the rowing robot turns when one side rows less, and its heading held.

Its drives are ideal here.

In closed loop, at each turning point of the strokes, the IMU's yaw says how far the sides row next. A half stroke leads
from where the servo stands to the next turning point. With new amplitudes only the next turning point moves: angle and
speed of the servos never jump, and the half cosine between the two points is a stroke with

$$ offset = \tfrac12 (from + to), \quad amplitude = \tfrac12 |to - from|. $$
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.core.programs.remember import remembered
from nectosome.description import ForceLoad, RobotDescription, get_value, resolve, with_values
from nectosome.mechanism import Robot
from nectosome.model import build, instantiate, template_of
from nectosome.robots.beetle import PADDLES
from nectosome.solve import periodic, simulate

from .swim import hull_centre
from .trials import SAMPLE, measured_yaw

_STRAIGHT = 1e-9  # |2 sin(psi/2)| of a cycle, below which a path counts as straight
_PER_HALF = 20  # instants kept of each half stroke
Control = Callable[[float, float, float], tuple[float, float]]
"""From measured yaw [rad], its rate [rad/s] and integral [rad s] to the amplitudes of the left and right side [rad]."""


class Turn(NamedTuple):
    """A motion along a circle, cycle by cycle."""

    rate: float  # of the heading [rad/s], positive to the left
    radius: float  # of the hull centre's path from cycle to cycle [m]; inf where it goes straight
    speed: float  # along it [m/s]
    multiplier: float  # of the disturbance that dies out last, in each cycle; above 1 it grows


def turn(robot: RobotDescription, left: float, right: float) -> Turn:
    r"""Cycle that the planar robot keeps with these amplitudes [rad] on its sides.

    It moves the hull's centre by d and turns it by $\psi$, along a circle of radius $|d| / 2 |\sin(\psi/2)|$. Raises
    RuntimeError where no cycle is found.
    """
    frequency = float(get_value(robot, "f"))
    found = periodic(build(with_values(robot, {"A_left": left, "A_right": right})), 1 / frequency)
    if found.status not in (Status.SOLVED, Status.SETTLED, Status.UNSTABLE):
        raise RuntimeError(f"turn with {left:.3f}, {right:.3f} rad: {Status(int(found.status)).reason}")
    ends = np.asarray(found.value.state.q)[[0, -1], :3]
    psi = float(ends[1, 2] - ends[0, 2])
    chord = float(np.hypot(*np.diff(hull_centre(robot, ends))).item())
    curved = 2 * abs(float(np.sin(0.5 * psi)))
    radius = chord / curved if curved > _STRAIGHT else np.inf
    return Turn(psi * frequency, radius, chord * frequency, float(found.stats["multiplier"]))


def turns(robot: RobotDescription, left: Sequence[float]) -> xr.Dataset:
    """Turns with these amplitudes [rad] on the left side, and on the right that of the robot."""
    full = float(get_value(robot, "A_right"))
    found = [turn(robot, amplitude, full) for amplitude in left]
    units = {"rate": "rad/s", "radius": "m", "speed": "m/s", "multiplier": "1"}
    return xr.Dataset(
        {name: ("left", [getattr(t, name) for t in found], {"units": unit}) for name, unit in units.items()},
        coords={"left": ("left", [*map(float, left)], {"units": "rad"})},
        attrs={"right": full},
    )


class HeadingControl(NamedTuple):
    """Proportional, differential and integral: the side towards which the robot should turn rows less.

    The robot answers late (half a stroke to measure, half a stroke to row), so that gains must be small: 0.6, 0.5 s and
    0.1 1/s hold it at 75 deg and 1.1 Hz, 1 and 1 s make it oscillate.
    """

    amplitude: float  # the largest [rad]
    proportional: float  # [rad/rad]
    differential: float  # [s]
    integral: float  # [1/s]
    least: float  # amplitude [rad]

    def __call__(self, yaw: float, rate: float, total: float) -> tuple[float, float]:
        """Amplitudes of the left and the right side [rad]; with yaw to the left the right side rows less."""
        less = self.proportional * yaw + self.differential * rate + self.integral * total
        left, right = (max(self.amplitude - max(x, 0.0), self.least) for x in (-less, less))
        return left, right


def disturbed(robot: RobotDescription, moment: float = 0.01, share: float = 0.9) -> RobotDescription:
    """The robot with a steady yaw moment [N m] on its hull, and a first left paddle with a share of the others' Cn."""
    steady = ForceLoad(kind="force", force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, moment))
    drags = [path for path in resolve(robot, "Cn") if path.startswith(f"limbs.{PADDLES[0]}_")]
    values = {path: share * get_value(robot, path) for path in drags}
    return with_values(robot.with_part("body", loads=robot.parts["body"].loads | {"disturbance": steady}), values)


def swim(robot: RobotDescription, strokes: int, control: Control | None = None, seed: int = 0) -> xr.Dataset:
    """So many strokes of the planar robot from rest; without a control its sides row as its description says.

    Time [s], true yaw [rad], place of the hull's centre [m] at equal intervals; amplitudes [rad] by half stroke. Raises
    RuntimeError where the simulation fails.
    """
    half, rng = 0.5 / float(get_value(robot, "f")), np.random.default_rng(seed)
    rowing = HalfStrokes(robot)
    amplitudes = [np.array([float(get_value(robot, name)) for name in ("A_left", "A_right")])]
    state, q, total = None, [], 0.0
    for k in range(2 * strokes):
        if k and control is not None:
            seen, rate = _yaw_and_rate(np.concatenate(q), half, rng)
            total += half * seen
            amplitudes.append(np.array(control(seen, rate, total)))
        else:
            amplitudes.append(amplitudes[0])
        run = simulate(rowing.robot(k, *amplitudes[-2:]), half, samples=_PER_HALF + 1, initial=state)
        if int(run.status) != Status.SOLVED:
            raise RuntimeError(f"half stroke {k}: {Status(int(run.status)).reason}")
        state = jax.tree.map(lambda x: x[-1], run.value.state)
        q.append(np.asarray(run.value.state.q)[1 if k else 0 :, :3])
    path = np.concatenate(q)
    x, y, yaw = *hull_centre(robot, path), path[:, 2]
    return xr.Dataset(
        {
            "yaw": ("time", yaw, {"units": "rad"}),
            "x": ("time", x, {"units": "m"}),
            "y": ("time", y, {"units": "m"}),
            "amplitude": (("half_stroke", "side"), np.array(amplitudes[1:]), {"units": "rad"}),
        },
        coords={"time": ("time", np.arange(x.size) * half / _PER_HALF, {"units": "s"}), "side": ["left", "right"]},
    )


def compared(robot: RobotDescription, strokes: int = 24) -> xr.Dataset:
    """The disturbed robot left to itself and under control (control: "none", "PID")."""
    weak, amplitude = disturbed(robot), float(get_value(robot, "A_left"))
    control = HeadingControl(amplitude, 0.6, 0.5, 0.1, np.radians(30))
    both = [swim(weak, strokes), swim(weak, strokes, control)]
    return xr.concat(both, xr.DataArray(["none", "PID"], dims="control", name="control"))


def _yaw_and_rate(q: np.ndarray, half: float, rng: np.random.Generator) -> tuple[float, float]:
    """The IMU's last yaw, and its mean rate over about the last half stroke."""
    times = np.arange(q.shape[0]) * half / _PER_HALF
    last = np.floor(times[-1] / SAMPLE + 1e-9) * SAMPLE
    before = max(last - np.round(half / SAMPLE) * SAMPLE, 0.0)
    seen = measured_yaw(np.interp([before, last], times, q[:, 2]), rng)
    turned = (seen[1] - seen[0] + np.pi) % (2 * np.pi) - np.pi
    return float(seen[1]), float(turned / (last - before))


class HalfStrokes:
    """Robots of one structure in half strokes between any turning points; one program serves them all."""

    def __init__(self, robot: RobotDescription):
        motions = [f"limbs.{place}_arm.joint.motion" for place in PADDLES]
        paths = [[f"{motion}.{name}" for motion in motions] for name in ("amplitude", "offset", "phase")]
        self._template, self._numbers = template_of(robot, also=tuple(path for row in paths for path in row))
        self._at = np.array([[self._template.paths.index(path) for path in row] for row in paths])

    def robot(self, k: int, before: np.ndarray, after: np.ndarray) -> Robot:
        """Robot in half stroke k, a power stroke if even: from the turning point of amplitudes [2] to the next."""
        sign = 1.0 if k % 2 == 0 else -1.0
        start, end = -sign * before, sign * after
        numbers = 0.5 * np.abs(end - start), 0.5 * (start + end), np.full(2, -0.5 * np.pi * sign)
        both_pairs = np.tile(np.array(numbers), 2)
        return remembered(instantiate, self._template, self._numbers.at[self._at].set(jnp.asarray(both_pairs)))
