r"""What was made and tested: the composite of the filament, its stiffness by weights (Fig. 5), swims in the pool.

A soft composite has a core of the same cone angle inside a shell, $\beta$ the ratio of their radii. Rule "EJ" adds
bending stiffnesses in parallel, $E_b \beta^4 + E_s (1 - \beta^4) = E$; rule "EJV" weighs each by its share of the
volume too, $E_b \beta^6 + E_s (1 - \beta^4)(1 - \beta^2) = E$ (Armanini et al., eq. 9, as printed).

Of the swims in the pool (Figs. 9, 10) neither motor speed nor hull drag is printed. The hull drag is calibrated on the
old design, the new one is predicted. The motor is run "at the maximum speed that can be reached": it is taken to work
on its torque-speed line, 0.89 N m at a standstill and 22 rad/s without load. Or a velocity loop, as in its firmware,
keeps both designs at one speed, which is tried at 11 and 12 rad/s: what the motor can give at the battery's 7.4 V.
"""

import math
from collections.abc import Callable
from importlib.resources import files
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.optimize import brentq, least_squares
from scipy.special import stdtrit

from nectosome.core import Status
from nectosome.description import RobotDescription, apply_settings, get_value, parse_robot, with_values
from nectosome.designs import MotorLine
from nectosome.mechanism import Robot, SoftRod
from nectosome.model import bind
from nectosome.solve import load_stepping

from .optimum import MOTOR
from .steady_swims import Swim, Swimmer

Rule = Literal["EJ", "EJV"]
TRUTH = 7.9e6  # Pa: what the paper found
_NOISE = 1e-3  # m, of a marker read off a photograph
_CASES = {"low": 0.5, "middle": 0.3, "high": 0.1}  # N, a weight at one of three places at a time
_MARKERS = (0.4, 0.55, 0.7, 0.85, 1.0)  # fractions of the filament that are seen
_DRAG = "body.loads.hull_drag.drag_area.0"


def young_of(ratio: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Young's modulus [Pa] of a composite whose core has `ratio` times its radius; 0 is all shell, 1 all core.

    Raises ValueError for a ratio outside of [0, 1] and for moduli that are not positive.
    """
    _check(core, shell)
    if not 0 <= ratio <= 1:
        raise ValueError(f"composite: the core's radius is {ratio} of the whole; it must be from 0 to 1.")
    b2 = ratio**2
    if rule == "EJ":
        return core * b2**2 + shell * (1 - b2**2)
    return core * b2**3 + shell * (1 - b2**2) * (1 - b2)


def ratio_of(young: float, core: float, shell: float, rule: Rule = "EJ") -> float:
    """Ratio of radii that gives a composite this Young's modulus [Pa]; the largest, where rule "EJV" has two.

    Raises ValueError where no core of these materials gives it.
    """
    _check(core, shell)
    softest = 0.0 if rule == "EJ" else _softest_ratio(core, shell)
    low, high = sorted((young_of(softest, core, shell, rule), core))
    if not low <= young <= high or low == high:
        raise ValueError(f"composite: {young:.4g} Pa is out of reach: these materials give {low:.4g} to {high:.4g} Pa.")
    if rule == "EJ":
        return ((young - shell) / (core - shell)) ** 0.25
    # monotone from the softest ratio on
    found = brentq(lambda ratio: young_of(ratio, core, shell, rule) - young, softest, 1.0, xtol=1e-16)
    return float(np.asarray(found))


def _softest_ratio(core: float, shell: float) -> float:
    """Ratio at which "EJV" is softest: the root of its derivative in b = ratio^2, 3 (E_b + E_s) b^2 - 2 E_s b - E_s."""
    total = 3 * (core + shell)
    return math.sqrt(min(1.0, (shell + math.sqrt(shell**2 + total * shell)) / total))


def _check(core: float, shell: float) -> None:
    for name, value in (("core", core), ("shell", shell)):
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"composite: Young's modulus of the {name} is {value} Pa; it must be more than 0.")


def stiffness_test(seed: int = 1) -> xr.Dataset:
    """Young's modulus from synthetic photographs of the filament under weights: deflected shapes, measured and fitted.

    Attributes `young`, `young_low` and `young_high` are the estimate [Pa] and its 95 % interval. The photographs are
    made by a finer model (strain order 5, 20 Gauss points) with E = 7.9 MPa and 1 mm of noise. Least squares over log
    E; the interval is that of the linearised fit, residual variance and Student's t.
    """
    text = files("nectosome.papers.flagellum").joinpath("weights_test.yaml").read_text(encoding="utf-8")
    description = parse_robot(text)
    finer = ["limbs.filament.strains={torsion: 3, bending_y: 5, bending_z: 3}", "limbs.filament.points=20"]
    seen = _markers(apply_settings(description, finer))(TRUTH)
    seen = seen + _NOISE * np.random.default_rng(seed).normal(size=seen.shape)
    model = _markers(description)
    fit = least_squares(lambda e: ((model(np.exp(e[0])) - seen) / _NOISE).ravel(), [np.log(3e6)], diff_step=1e-4)
    free = seen.size - 1
    spread = np.sqrt(2 * fit.cost / free / np.sum(fit.jac**2)) * stdtrit(free, 0.975)
    young = float(np.exp(fit.x[0]))
    low, high = (float(np.exp(fit.x[0] + sign * spread)) for sign in (-1, 1))
    return xr.Dataset(
        {
            "measured": (("case", "marker", "axis"), seen, {"units": "m", "source": "synthetic"}),
            "fitted": (("case", "marker", "axis"), model(young), {"units": "m"}),
        },
        coords={
            "case": list(_CASES),
            "marker": list(_MARKERS),
            "axis": ["x", "z"],
            "weight": ("case", [*_CASES.values()]),
        },
        attrs={"young": young, "young_low": low, "young_high": high, "truth": TRUTH, "synthetic": "yes"},
    )


def _markers(description: RobotDescription):
    """Function of E [Pa]: positions of the markers in the plane of bending [case, marker, 2] in the world [m]."""
    paths = ("limbs.filament.young", *(f"limbs.filament.loads.{case}.force.2" for case in _CASES))
    _, from_theta = bind(description, paths)

    @jax.jit
    def positions(theta: Float[Array, "4"]) -> tuple[Array, Array]:
        robot: Robot = from_theta(theta)
        solution = load_stepping(robot)
        q, *_ = robot.tree.complete(jnp.zeros(()), solution.value.q, solution.value.v)
        rod = robot.tree.part("filament")
        body, first = robot.tree.parts[rod].body, robot.tree.layout[rod].stations.start
        if not isinstance(body, SoftRod):
            raise TypeError("static test: the filament is no rod")
        at = [first + int(np.flatnonzero(np.equal(body.nodes, mark))[-1]) for mark in _MARKERS]
        return robot.tree.shape(q).position[np.array(at)][:, np.array([0, 2])], solution.status

    def shapes(young: float) -> np.ndarray:
        out = []
        for case, weight in _CASES.items():
            loads = [-weight if name == case else 0.0 for name in _CASES]
            position, status = positions(jnp.array([young, *loads]))
            if int(status) != Status.SOLVED:
                raise RuntimeError(f"static test: weight {case}, E = {young:.4g} Pa: {Status(int(status)).reason}")
            out.append(np.asarray(position))
        return np.array(out)

    return shapes


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
