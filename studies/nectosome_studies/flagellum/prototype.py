r"""What was made and tested: the composite of the filament, its stiffness by weights (Fig. 5), swims in the pool.

Of the swims in the pool (Figs. 9, 10) neither motor speed nor hull drag is printed. The hull drag is calibrated on the
old design, the new one is predicted. The motor is run "at the maximum speed that can be reached": it is taken to work
on its torque-speed line, 0.89 N m at a standstill and 22 rad/s without load. Or a velocity loop, as in its firmware,
keeps both designs at one speed, which is tried at 11 and 12 rad/s: what the motor can give at the battery's 7.4 V.
"""

import math
from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.optimize import brentq

from nectosome.description import RobotDescription, apply_settings, get_value, parse_robot, with_values
from nectosome.description.variables import read_variable
from nectosome.designs import MotorLine
from nectosome.identification import identify, recordings_of
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build

from .optimum import MOTOR
from .steady_swims import Swim, Swimmer

TRUTH = 7.9e6  # Pa: what the paper found
_NOISE = 1e-3  # m, of a marker read off a photograph
_CASES = {"low": 0.5, "middle": 0.3, "high": 0.1}  # N, a weight at one of three places at a time
_PLACES = {0.4: "0.4", 0.55: "0.55", 0.7: "0.7", 0.85: "0.85", 1.0: "tip"}  # of the filament that are seen
_MARKERS = {f"{at}.{axis}": f"filament.{at}.position.{axis}" for at in _PLACES.values() for axis in "xz"}
_WEIGHTS = {case: f"limbs.filament.loads.{case}.force.2" for case in _CASES}
_YOUNG, _BEGIN = "limbs.filament.young", 3e6  # Pa
_VARY = {_YOUNG: "0.5..100MPa log"}
_DRAG = "body.loads.hull_drag.drag_area.0"


def stiffness_test(seed: int = 1) -> xr.Dataset:
    """Young's modulus from synthetic photographs of the filament under weights: deflected shapes, measured and fitted.

    Attributes `young`, `young_low` and `young_high` are the estimate [Pa] and its 95 % interval, by `identify`. The
    photographs are made by a finer model (strain order 5, 20 Gauss points) with E = 7.9 MPa and 1 mm of noise.
    """
    text = files("nectosome_studies.flagellum").joinpath("weights_test.yaml").read_text(encoding="utf-8")
    description = parse_robot(text)
    finer = ["limbs.filament.strains={torsion: 3, bending_y: 5, bending_z: 3}", "limbs.filament.points=20"]
    seen = _shapes(apply_settings(description, finer), TRUTH)
    seen = seen + _NOISE * np.random.default_rng(seed).normal(size=seen.shape)
    begin = [f"{_YOUNG}={_BEGIN:g} Pa"]
    found = identify(description, [_photographs(seen)], begin, vary=_VARY, compare=_MARKERS, drive=_WEIGHTS, starts=1)
    (interval,) = found.identifiability.intervals()
    return xr.Dataset(
        {
            "measured": (("case", "marker", "axis"), seen, {"units": "m", "source": "synthetic"}),
            "fitted": (("case", "marker", "axis"), found.computed[0].T.reshape(seen.shape), {"units": "m"}),
        },
        coords={
            "case": list(_CASES),
            "marker": [*_PLACES],
            "axis": ["x", "z"],
            "weight": ("case", [*_CASES.values()]),
        },
        attrs={
            "young": float(found.theta[0]),
            "young_low": interval.low,
            "young_high": interval.high,
            "truth": TRUTH,
            "synthetic": "yes",
        },
    )


def _photographs(seen: Float[np.ndarray, "cases markers 2"]) -> dict[str, Any]:
    """A recording of one row a case: the weights, of which one hangs at a time, and what is seen of the markers."""
    each = np.diag([-weight for weight in _CASES.values()])
    hung = {case: (row, "N") for case, row in zip(_CASES, each, strict=True)}
    return {"time": None, **hung, **dict(zip(_MARKERS, seen.reshape(len(_CASES), -1).T, strict=True))}


def _shapes(description: RobotDescription, young: float) -> Float[np.ndarray, "cases markers 2"]:
    """Positions of the markers in the plane of bending [m], in each case."""
    compared = [read_compared(column, place, build(description)) for column, place in _MARKERS.items()]
    nothing = np.zeros((len(_CASES), len(_PLACES), 2))
    trials = robot_trials(
        recordings_of([_photographs(nothing)], dict.fromkeys(_MARKERS, "m")), description, compared, _WEIGHTS
    )
    variables = [read_variable(name, span, description) for name, span in _VARY.items()]
    return RobotMisfit(trials, variables, compared).computed(np.array([young]))[0].T.reshape(nothing.shape)


def on_motor_line(
    description: RobotDescription, extra_drag_area: float = 0.0, motor: MotorLine = MOTOR
) -> tuple[float, Swim]:
    """Motor speed [rad/s] whose torque the motor can give, and the swim at it; extra drag area [m2] on the hull."""
    swimmer = _with_drag(description, extra_drag_area)

    def surplus(rate: float) -> float:
        return motor.stall * (1 - rate / motor.no_load) - swimmer.swim(rate).torque

    rate = float(np.asarray(brentq(surplus, 0.05 * motor.no_load, motor.no_load, xtol=1e-6)))
    return rate, swimmer.swim(rate)


def _with_drag(description: RobotDescription, extra_drag_area: float) -> Swimmer:
    return Swimmer(with_values(description, {_DRAG: float(get_value(description, _DRAG)) + extra_drag_area}))


def at_one_speed(old: RobotDescription, new: RobotDescription, printed: float, rate: float) -> tuple[float, Swim]:
    """Drag area [m2] at which the old design swims at the printed speed [m/s], and the swim of the new one.

    A velocity loop keeps both motors at one speed [rad/s].
    """

    def too_fast(log_area: float) -> float:
        return _with_drag(old, math.exp(log_area)).swim(rate).speed - printed

    area = _least_area(too_fast)
    return area, _with_drag(new, area).swim(rate)


def _least_area(too_fast: Callable[[float], float]) -> float:
    return math.exp(float(np.asarray(brentq(too_fast, math.log(1e-4), math.log(10.0), xtol=1e-6))))


def pool_swims(old: RobotDescription, new: RobotDescription, printed: dict[str, float]) -> xr.Dataset:
    """Old and new design in the pool: the drag area that makes the old one swim as fast as printed, and both swims.

    `printed`: speeds "old" and "new" as simulated in the paper, "old_measured" and "new_measured" [m/s].
    """

    def too_fast(log_area: float) -> float:
        return on_motor_line(old, math.exp(log_area))[1].speed - printed["old"]

    area = _least_area(too_fast)
    swims = [on_motor_line(design, area) for design in (old, new)]
    return xr.Dataset(
        {
            "ours": ("design", [swim.speed for _, swim in swims], {"units": "m/s"}),
            "rate": ("design", [rate for rate, _ in swims], {"units": "rad/s"}),
            "torque": ("design", [swim.torque for _, swim in swims], {"units": "N m"}),
            "printed_simulated": ("design", [printed["old"], printed["new"]], {"units": "m/s"}),
            "printed_measured": ("design", [printed["old_measured"], printed["new_measured"]], {"units": "m/s"}),
            "kind": ("design", ["calibration", "prediction"]),
        },
        coords={"design": ["old", "new"]},
        attrs={"hull_drag_area": area},
    )
