"""What the studio shows of a robot: its lasting motion, as instants of one period, and its numbers."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from nectosome import solve
from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import DIRECTIONS, RobotDescription, drive_period
from nectosome.designs.quantities import AT_REST, QUANTITIES, PeriodicSwim
from nectosome.mechanism import Diagnosis, Robot, diagnose
from nectosome.model import build
from nectosome.solve import CycleMeans, Periodic, Results, Run, Steady, Trajectory
from nectosome.units import InputError

TIMES = 65  # of a period that are shown
_FINER = 4  # by so much are those finer that numbers of a cycle are means of: as many as a sweep takes
_BEGINNING = 5.0  # s, of a robot that keeps no motion
_STANDS = 1e-8  # m/s: a body that is slower is held
_OF_TRAVEL = ("speed", "forward_speed", "efficiency", "cost_of_transport")  # what a body that is held has not
Direction = tuple[float, float, float]  # of the world
_LASTING = (Status.SOLVED, Status.SETTLED)
_SHOWN = (*_LASTING, Status.UNSTABLE)


class Answer(NamedTuple):
    """A motion to look at.

    It is periodic with `period` [s], but for the distance that the body moves in it; 0 where it is not. `numbers` are
    `QUANTITIES` [SI]; a run has none. The run does not carry its robot: that takes longest to write. `warning` is
    empty, or says why not to trust the motion.
    """

    run: xr.Dataset
    robot: RobotDescription
    kind: str
    period: float
    numbers: dict[str, float]
    warning: str


class AnswerSolver:
    """Answers for one robot after another, each begun where the last one ended.

    Numbers are along `forward`, as of a design problem; without, along where the robot goes or is pushed.
    """

    def __init__(self, forward: str = ""):
        self._forward = DIRECTIONS.get(forward)
        self._last: State | None = None  # of the last steady motion
        self._begins: State | None = None  # with which the last cycle begins
        self._repeats: bool | None = None  # whether the first robot has a periodic motion; None until it is known

    def __call__(self, description: RobotDescription) -> Answer:
        """The motion that a robot keeps: steady, or periodic with its drives, or none, at rest.

        Of one that keeps none by its nature, as it sinks, walks or begins slowly, its first seconds; and where no
        periodic motion was found of the first robot, those of all. Raises InputError with the reason where a motion
        cannot be found.
        """
        robot = build(description)
        if not robot.tree.free_v.size:
            raise InputError("nothing of this robot is free to move.", field=description.name)
        try:
            period = drive_period(description)
        except InputError as error:
            symmetry = solve.find_symmetry(robot)
            if not symmetry.steady:
                return _begun(robot, description, str(error))
            if solve.with_crank(robot, symmetry, robot.initial()).crank is None:
                return _resting(robot, description)
            return self._cycle(robot, description, None)
        found = self._steady(robot)
        if Status(int(found.status)) != Status.UNSTEADY_DRIVES:
            return _turning(found, description, period, self._forward)
        return self._cycle(robot, description, period)

    def _cycle(self, robot: Robot, description: RobotDescription, period: float | None) -> Answer:
        """The periodic motion, or its beginning where there is none; the period of a motor's turns is not known."""
        cycle = None if self._repeats is False else self._periodic(robot, period)
        if cycle is not None and self._repeats is None:
            self._repeats = Status(int(cycle.status)) != Status.NO_PERIOD
        if cycle is None or not self._repeats:
            return _begun(robot, description, f"{Status.NO_PERIOD.reason}.")
        found = float(cycle.stats["period"])
        answer = _answer(cycle, description, "periodic motion", found, cycle.means(), forward=self._forward)
        return answer._replace(run=answer.run.isel(time=slice(None, None, _FINER)))

    def _periodic(self, robot: Robot, period: float | None) -> Periodic:
        """Periodic motion from where the last one began, which takes half the cycles, else from rest."""
        samples = _FINER * (TIMES - 1) + 1
        found = solve.periodic(robot, period, guess=self._begins, samples=samples, multipliers=False)
        if Status(int(found.status)) not in _LASTING and self._begins is not None:
            found = solve.periodic(robot, period, samples=samples, multipliers=False)
        lasts = Status(int(found.status)) in _LASTING
        self._begins = jax.tree.map(lambda x: x[0], found.value.state) if lasts else None
        return found

    def _steady(self, robot: Robot) -> Steady:
        """Steady motion from where the last one was, else from rest."""
        found = solve.steady(robot, guess=self._last)
        if Status(int(found.status)) not in _SHOWN and self._last is not None:
            found = solve.steady(robot)
        self._last = found.state if Status(int(found.status)) in _SHOWN else None
        return found


def _resting(robot: Robot, description: RobotDescription) -> Answer:
    """The shape at rest, or what happens where there is none."""
    found = solve.static(robot)
    status = Status(int(found.status))
    if status not in _SHOWN:
        return _begun(robot, description, f"{status.reason}.")
    return _answer(found, description, "at rest", 0.0)


def _turning(found: Steady, description: RobotDescription, period: float, forward: Direction | None) -> Answer:
    """A steady motion over a turn of its drives [s]."""
    robot, times = found.value.system, jnp.linspace(0.0, period, TIMES)
    still = solve.in_still_water(robot) if solve.goes_along(robot) else None
    states, d, means = remembered(turn, robot, still, found.state, times)
    run = Run(Trajectory(robot, times, states), found.status, {}, found.residual)
    return _answer(run, description, "steady motion", period, means, solve.results_of(run, d), forward)


def turn(robot: Robot, still: Robot | None, x: State, times: Float[Array, "n"]) -> tuple[State, Diagnosis, CycleMeans]:
    """A turn of a steady motion from x on: velocities stay, what is displaced goes on evenly. Leaves [n, ...].

    They do so in the water where a current carries the robot along, and it is given as it is in `still` water. All
    instants side by side, which is twice as fast as one after another.
    """
    x = x if still is None else solve.in_stream(robot, times[0], x, -1.0)
    states = jax.vmap(lambda t: State(robot.advance(x.q, x.v, t), x.v, x.z))(times)
    states = states if still is None else solve.with_stream(robot, times, states)
    d = jax.vmap(lambda t, x: diagnose(robot, t, x))(times, states)
    return states, d, solve.means_of(robot, times, d)


def _begun(robot: Robot, description: RobotDescription, why: str) -> Answer:
    """What a robot does at first, from its start, where it keeps no motion."""
    found = solve.simulate(robot, _BEGINNING, samples=TIMES)
    answer = _answer(found, description, f"the first {_BEGINNING:g} s", 0.0)
    place = answer.run["position"].values[:, 0]  # the first part is the body
    # over what is no cycle the mean of a force or power tells nothing that lasts
    speed = float(np.linalg.norm(place[-1] - place[0])) / _BEGINNING
    return answer._replace(numbers={"speed": speed}, warning=f"{why} The speed is the mean over them.")


def _answer(
    found: Run,
    description: RobotDescription,
    kind: str,
    period: float,
    means: CycleMeans | None = None,
    results: Results | None = None,
    forward: Direction | None = None,
) -> Answer:
    """Raises InputError with the reason for what is no motion."""
    status = Status(int(found.status))
    if status not in _SHOWN:
        raise InputError(f"{status.reason}.", field=description.name)
    run = (results or found.results()).to_dataset()
    warned = [status.reason] if status == Status.UNSTABLE else []
    numbers = dict[str, float]()
    if means is not None:
        numbers = numbers_of(means, forward, found.value.system, found.value.time)
        arrays = Results(solve.drive_limits(found.value.system), {}, {}).arrays
        arrays |= {"prescribed": np.array(found.value.system.prescribed_names)}
        warned += solve.overloaded(arrays, np.asarray(means.reaction_peak), np.asarray(means.drive_velocity_peak))
        kept, _ = solve.mean_data(found.value.system, means)
        of_loads = {name: kept[name][1] for name in ("load_power", "load_force", "flow_number") if name in kept}
        warned += solve.out_of_range({"load": run["load"].values, "part": run["part"].values, **of_loads}, description)
        if "motor" in run.dims:
            peaks = {name.removesuffix("_peak"): np.asarray(x) for name, x in means._asdict().items()}
            warned += solve.tracking_warnings(description, peaks | {"motor": run["motor"].values})
    return Answer(run, description, kind, period, numbers, " ".join(f"{words}." for words in warned))


def numbers_of(
    means: CycleMeans, forward: Direction | None, robot: Robot, times: Float[Array, "n"]
) -> dict[str, float]:
    """All `QUANTITIES` of a cycle of a robot [SI]; NaN where one makes no sense.

    Where no direction is forward, it is where the body goes; of one that is held, where the water pushes it.
    """
    goes = float(means.speed) > _STANDS
    there = np.asarray(forward if forward else means.velocity[0] - means.water_velocity if goes else means.force)
    along = there / max(float(np.linalg.norm(there)), 1e-300)
    values = remembered(judged, means, along, robot, times)
    found: dict[str, float] = {name: float(value) for name, value in values.items()}
    return found if goes else found | dict.fromkeys(_OF_TRAVEL, np.nan)


def judged(
    means: CycleMeans, forward: Float[Array, "3"], robot: Robot, times: Float[Array, "n"]
) -> dict[str, Float[Array, ""]]:
    """All `QUANTITIES` of a cycle, not those at rest."""
    swim = PeriodicSwim(robot, means, forward, times)
    return {name: quantity.of_cycle(swim) for name, quantity in QUANTITIES.items() if name not in AT_REST}
