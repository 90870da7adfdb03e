"""Trials of section 6.2 with robots as they may have been made: ten seconds from rest, yaw by IMU, way made good.

How far the paddles of one robot may differ is a recipe fixed before the first robot of its kind swam. Nobody printed
how well the robot was made. Numbers printed twice for one thing, last digits, and the makers' sheets of its parts say
something of it:

| of each | differs by | since |
|---|---|---|
| joint | stiffness, normal, 1.84 % | 0.032, 0.031, 0.031 N m/rad of Table 2: their standard deviation by their mean |
| paddle | mass, normal, 2.40 % | 3 x 10 g of Table 2, 29 g of Table 4: the same |
| paddle | Cn, even within 1.25 % | the width of 0.040 m is printed to a millimetre, and drag goes with Cn w |
| paddle | amplitude, even within 0.169 deg | XW540-T140: half a step of 360/4096 deg, half a backlash of 0.25 deg |
| paddle | lag, even from 0 to 8.3 ms | goals go one after another to four servos: 0 to 3 packets of 16 bytes (below) |
| servo | speed without load, even within 5 % | an assumption, since its maker prints no tolerance; see below |
| yaw sample | noise, normal, 0.1 deg | JY61: accuracy while moving; its yaw drifts, not printed by how much: left out |

A packet that sets a goal has 16 bytes of 10 bits each, at 57 600 baud unless set otherwise (ROBOTIS, Protocol 2.0).
The speed of a DC motor at a voltage goes with its magnets and its winding, which differ by a few per cent from one to
the next. For one servo ROBOTIS prints 67, 72 and 88 rev/min at 11.1, 12 and 14.8 V: these alone differ by 0.8 % in
their ratio to the voltage. Only robots on servos differ in it.
All are independent of each other. Other parts, the hull and the way it is trimmed are taken to be perfect.
"""

import math
from collections.abc import Iterable

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import RobotDescription, get_value, numeric_paths, resolve, with_values
from nectosome.model import build
from nectosome.robots import beetle
from nectosome.robots.beetle import PADDLES
from nectosome.solve import simulate

from .swim import SPEEDS, YAWS, Swim, hull_centre, strokes, with_ideal_drives

_SECONDS, SAMPLE = 10.0, 0.1  # s
_RTOL = 1e-4  # moves yaw by 1e-6 rad and the way by 1e-6 m in ten seconds, compared with 1e-6


def _spread(*printed: float) -> float:
    """Sample standard deviation of numbers printed for one thing, relative to their mean."""
    return float(np.std(printed, ddof=1) / np.mean(printed))


STIFFNESS = _spread(0.032, 0.031, 0.031)
MASS = _spread(30.0, 29.0)
CN = 0.5 / 40
AMPLITUDE = math.radians(0.5 * 360 / 4096 + 0.5 * 0.25)  # rad
LAG = 3 * 16 * 10 / 57600  # s
SERVO_SPEED = 0.05
YAW_NOISE = math.radians(0.1)  # rad
DIFFER = {"all": ("paddles", "servos"), "paddles": ("paddles",), "servos": ("servos",)}
SERVO_SWIMS: tuple[Swim, ...] = tuple((3, math.radians(75), f) for f in (1.1, 1.3))


def made(robot: RobotDescription, rng: np.random.Generator, differ: str = "all") -> RobotDescription:
    """One robot as it may have been made from its description; only what `DIFFER` has by this name differs."""
    drawn = {"paddles": _of_paddles(robot, rng), "servos": _of_servos(robot, rng)}  # all, so that seeds mean the same
    return with_values(robot, {path: value for name in DIFFER[differ] for path, value in drawn[name].items()})


def _of_servos(robot: RobotDescription, rng: np.random.Generator) -> dict[str, float]:
    """Speeds without load of the servos that there are."""
    paths = [f"limbs.{place}_arm.joint.servo.no_load_speed" for place in PADDLES]
    known = set(numeric_paths(robot))
    return {path: get_value(robot, path) * (1 + SERVO_SPEED * rng.uniform(-1, 1)) for path in paths if path in known}


def _of_paddles(robot: RobotDescription, rng: np.random.Generator) -> dict[str, float]:
    """Stiffness, masses, Cn, amplitudes and lags of the paddles."""
    frequency = get_value(robot, "f")
    values: dict[str, float] = {}
    for place in PADDLES:
        mass, cn = 1 + MASS * rng.normal(), 1 + CN * rng.uniform(-1, 1)
        for segment in (name for name in robot.limbs if name.startswith(f"{place}_segment")):
            factors = {"joint.flexure.young": 1 + STIFFNESS * rng.normal(), "mass": mass, "loads.drag.normal": cn}
            paths = {f"limbs.{segment}.{name}": by for name, by in factors.items()}
            values |= {path: get_value(robot, path) * by for path, by in paths.items()}
        amplitude, phase = f"limbs.{place}_arm.joint.motion.amplitude", resolve(robot, f"phase_{place}")[0]
        values[amplitude] = get_value(robot, amplitude) + AMPLITUDE * rng.uniform(-1, 1)
        values[phase] = get_value(robot, phase) - 2 * math.pi * frequency * LAG * rng.uniform()
    return values


def measured_yaw(yaw: Float[np.ndarray, "n"], rng: np.random.Generator) -> Float[np.ndarray, "n"]:
    """Reading of the IMU at a true yaw [rad]: with noise, and wrapped to -pi..pi."""
    noisy = yaw + YAW_NOISE * rng.normal(size=yaw.shape)
    return (noisy + np.pi) % (2 * np.pi) - np.pi


def trial(robot: RobotDescription, seed: int, differ: str = "all") -> dict[str, float]:
    """Means of one trial of the robot `made` with this seed: yaw_mean, yaw_max of |yaw| [rad], speed [m/s].

    The speed is the way made good along the heading at the start, by the hull's centre, over the time from rest.
    Raises RuntimeError where the simulation fails.
    """
    rng = np.random.default_rng(seed)
    robot = made(robot, rng, differ)
    samples = round(_SECONDS / SAMPLE) + 1
    run = simulate(build(robot), _SECONDS, samples=samples, rtol=_RTOL, atol=1e-2 * _RTOL)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"trial {seed}: {Status(int(run.status)).reason}")
    path = np.asarray(run.value.state.q)[:, :3]
    centre, _ = hull_centre(robot, path)
    seen = np.abs(measured_yaw(path[1:, 2], rng))
    return {"yaw_mean": seen.mean(), "yaw_max": seen.max(), "speed": (centre[-1] - centre[0]) / _SECONDS}


def trials(swims: Iterable[Swim], drag_area: float, count: int) -> xr.Dataset:
    """Trials of so many robots with ideal drives in each of these swims (row, trial), and what is printed (row).

    Seeds are 0, 1, ...
    """
    swims, found = list(swims), []
    for joints, amplitude, frequency in swims:
        robot = with_values(with_ideal_drives(beetle(joints)), {"A": amplitude, "f": frequency, "drag_area": drag_area})
        found.append([trial(robot, seed) for seed in range(count)])
    own = {
        name: (("row", "trial"), [[one[name] for one in row] for row in found], {"units": unit})
        for name, unit in (("yaw_mean", "rad"), ("yaw_max", "rad"), ("speed", "m/s"))
    }
    printed = {
        "printed_yaw": ("row", [math.radians(YAWS.get(swim, math.nan)) for swim in swims], {"units": "rad"}),
        "printed_speed": ("row", [SPEEDS[swim] for swim in swims], {"units": "m/s"}),
    }
    return xr.Dataset(own | printed, coords=strokes(swims))


def servo_trials(drag_area: float, count: int) -> xr.Dataset:
    """Trials on servos (differ, row, trial): all that differs, the paddles alone, the servos' speeds alone.

    yaw_mean [rad] and speed [m/s] of so many robots with three joints at 75 deg, and what is printed (row).
    """
    found = {}
    for joints, amplitude, frequency in SERVO_SWIMS:
        robot = with_values(beetle(joints), {"A": amplitude, "f": frequency, "drag_area": drag_area})
        for differ in DIFFER:
            found[differ, frequency] = [trial(robot, seed, differ) for seed in range(count)]
    units, dims = {"yaw_mean": "rad", "speed": "m/s"}, ("differ", "row", "trial")
    own = {
        name: (dims, [[[t[name] for t in found[d, f]] for *_, f in SERVO_SWIMS] for d in DIFFER], {"units": unit})
        for name, unit in units.items()
    }
    printed = {
        "printed_yaw": ("row", [math.radians(YAWS[swim]) for swim in SERVO_SWIMS], {"units": "rad"}),
        "printed_speed": ("row", [SPEEDS[swim] for swim in SERVO_SWIMS], {"units": "m/s"}),
    }
    return xr.Dataset(own | printed, coords=strokes(SERVO_SWIMS) | {"differ": list(DIFFER)})


def numbers(found: xr.Dataset) -> dict[str, float]:
    """Mean yaw on servos [deg] by scorecard row."""
    yaw = found["yaw_mean"].mean("trial")
    return {
        f"paddle/servo/yaw/75-{f:g}{'' if d == 'all' else f'/{d}'}": math.degrees(yaw.sel(differ=d)[k])
        for k, f in enumerate(found["frequency"].values)
        for d in DIFFER
    }
