"""What acts on a robot at one instant, at a pose that is given: loads, powers, reactions, and what is missing."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.core.rows import on_device
from nectosome.core.tracers import traced
from nectosome.mechanism import Robot, continuous_loops, diagnose
from nectosome.model import RobotLike, robot_of
from nectosome.units import InputError, count, did_you_mean, read_quantity, shorten

from .results import Run, at_hand, at_one_time, coordinate_unit, results_of

if TYPE_CHECKING:
    import xarray as xr

Values = Mapping[str, float | str] | Sequence[float] | np.ndarray | Array | float

_OF_UNIT = {"rad": ("angle", "angular_speed"), "m": ("length", "speed"), "1": ("number", "number")}


class _AtPose(Run):
    title: ClassVar[str] = "forces at one instant"


def forces(
    robot: RobotLike,
    q: Values | None = None,
    v: Values = 0.0,
    a: Values | None = 0.0,
    *,
    settings: Iterable[str] = (),
    time: float | str = 0.0,
) -> "xr.Dataset":
    """Forces, powers, energies and reactions at one instant, by load and part, as in the dataset of a run.

    - robot: a name, the path of a robot file, a description or a built robot, with `settings` such as "E=3MPa".
    - q, v, a: displacements [rad, m], velocities [rad/s, m/s] and accelerations of the free coordinates, as `q`, `v`
      and `a` of a run's dataset: one number for all, an array in the order of `coordinate`, or those that differ by
      name, `{"arm.angle": "30 deg"}`. Without q the robot is where it starts; names change that, too. What v and a
      do not name is 0. With a = None the accelerations are those of free motion.
    - time: of drives, prescribed joints and the current; seconds or text such as "0.2s".

    `missing_force` [N m, N] is what must act along each free coordinate besides, so that the robot accelerates by a:
    the generalised force of inverse dynamics, with `missing_power`. Loads with a state (legs, jets) are as at the
    start, and loops of servos are continuous. Of a traced robot, q, v or a the dataset holds traced arrays: take
    numbers out of it, as in `ns.forces(robot)["missing_force"].data`. Raises InputError for what is no robot, an
    unknown coordinate, a wrong unit or a wrong count.
    """
    built = continuous_loops(robot_of(robot, settings))
    start = built.initial()
    rest = at_hand(remembered(Robot.displacements, built, start.q))
    shape = start.q
    if q is not None:
        shape = remembered(Robot.coordinates, built, jnp.asarray(_values(built, "q", q, rest, 0)))
    state = State(shape, jnp.asarray(_values(built, "v", v, np.zeros(rest.shape), 1)), start.z)
    t = on_device(read_quantity(time, "time", "time"))
    given = () if a is None else (jnp.asarray(_values(built, "a", a, np.zeros(rest.shape), 2)),)
    d = jax.tree.map(lambda x: at_hand(x)[None], remembered(diagnose, built, t, state, *given))
    run = _AtPose(at_one_time(built, state, t), Status.SOLVED, {}, on_device(0.0))
    data = results_of(run, d).to_dataset().isel(time=0)
    power = d.missing[0] * state.v
    xp = jnp if traced(d) else np
    powers = xp.concatenate([data["load_power"].data.ravel(), d.reaction_power[0], power])
    off = abs(d.energy_rate[0] - powers.sum()) / xp.maximum(xp.abs(powers).sum(), np.finfo(float).tiny)
    return data.assign(
        missing_force=("coordinate", d.missing[0], {"units": "N m or N"}),
        missing_power=("coordinate", power, {"units": "W"}),
        power_balance=((), off, {"units": "1"}),
    )


def _values(robot: Robot, what: str, given: Values, default: Any, order: int) -> Any:
    """Values of all free coordinates [SI]; `order` is that of the time derivative."""
    names, xp = robot.coordinate_names, jnp if traced(given, default) else np
    if not isinstance(given, Mapping):
        try:
            values = xp.asarray(given, dtype=float)
        except (TypeError, ValueError):
            raise InputError(
                f'"{shorten(given)}" is neither numbers nor values by coordinate, as in {{"{names[0]}": 0.1}}.',
                field=what,
            ) from None
        if values.ndim and values.shape != default.shape:
            here = count(len(names), "coordinate")
            raise InputError(f"{values.size} numbers, where the robot has {here} that are free.", field=what)
        return xp.broadcast_to(values, default.shape)
    values = [*default]
    for name, value in given.items():
        if name not in names:
            raise InputError(f'there is no free coordinate "{shorten(name)}".{did_you_mean(name, names)}', field=what)
        kinds = _OF_UNIT[coordinate_unit(name)]
        if order == 2 and isinstance(value, str):
            raise InputError(f'"{shorten(value)}" must be a number in SI units per s2.', field=f"{what}.{name}")
        known = value if traced(value) else read_quantity(value, kinds[min(order, 1)], f"{what}.{name}")
        values[names.index(name)] = known
    return xp.stack([xp.asarray(value, dtype=float) for value in values]) if values else default
