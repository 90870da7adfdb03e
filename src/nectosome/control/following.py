"""A robot under a controller: measured and commanded once a sample, its state carried on in between."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.actuators import Chain, DeadTime, Sensor
from nectosome.core import Line, Status
from nectosome.robots import Commanded
from nectosome.robots.commanded import Standing

from .beat import Beat, BeatMean
from .controller import Controller, Regulator
from .followed import Followed

_PROGRESS = 100  # times a run tells how far it is


class Measuring(NamedTuple):
    """How what is measured comes to the controller: as it is, or as its mean over a beat; late, and with noise."""

    beat: Beat | None = None  # whose mean it is
    delay: float = 0.0  # [s]
    noise: float = 0.0  # standard deviation of a sample, in SI
    seed: int = 0


PLAIN = Measuring()


def follow(
    robot: Commanded,
    controller: Controller,
    reference: Float[np.ndarray, "k"],
    measuring: Measuring = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
    enough: Callable[[Float[np.ndarray, "k"], Float[np.ndarray, "k"]], bool] | None = None,
) -> Followed:
    """Let a robot follow a reference, given at its samples, from where its description starts.

    At each sample the measurement is taken first, and the command that follows from it is held until the next. The
    controller takes over from the command of the description. `progress(share)` is called now and then, and the run is
    cancelled where it returns False; it ends after a sample of which `enough(measured, commands)` is true. What was
    done until then is kept.
    """
    regulator = controller.planned(reference, robot.dt)
    going = Ongoing(robot, regulator, float(reference[0]), measuring)
    status = Status.SOLVED
    every = max(len(reference) // _PROGRESS, 1)
    for k in range(len(reference)):
        going.sample(regulator)
        if k == len(reference) - 1 or (enough is not None and enough(*np.array(going.rows).T[1:])):
            break
        if progress is not None and k % every == 0 and progress(k / len(reference)) is False:
            status = Status.CANCELLED
            break
        status = going.hold()
        if status != Status.SOLVED:
            break
    return going.followed(np.asarray(reference, dtype=float), status)


class Ongoing:
    """A robot under a controller that goes on sample by sample: `sample`, `hold`, `sample`, ...

    The regulator is handed over at each sample, and may have other numbers then. It takes over from the command of the
    description, and from `first`, what is wanted at first.

    - standings, pieces: where the robot was and what it did, one for the start and one for each sample that was held.
    - rows: for each sample what was, what the controller was told, and the command.
    """

    def __init__(self, robot: Commanded, regulator: Regulator, first: float, measuring: Measuring = PLAIN):
        self.robot, self.rows = robot, list[tuple[float, float, float]]()
        self._state = regulator.initial(robot.resting, first)  # a reference that begins apart is a step
        start, begin = robot.start()
        self.standings, self.pieces = [start], [begin]
        self._sensor = _Sensor(measuring, robot.dt, start.reading)
        self._mean = None if measuring.beat is None else BeatMean(measuring.beat, start.reading)

    @property
    def standing(self) -> Standing:
        """Where the robot is."""
        return self.standings[-1]

    def sample(self, regulator: Regulator) -> None:
        """Take the measurement, and the command that follows from it: one row more."""
        output = self.standing.reading if self._mean is None else self._mean.mean()
        measured = self._sensor.read(output)
        self._state, command = _step(regulator, self._state, jnp.asarray(measured))  # a float would compile anew
        self.rows.append((output, measured, float(command)))

    def hold(self) -> Status:
        """Hold the command until the next sample: one piece more, where the robot gets through it."""
        command = self.rows[-1][2]
        standing, held, status = self.robot.hold(self.standing, command)
        if held is not None:
            self.standings.append(standing)
            self.pieces.append(held)
            if self._mean is not None:
                self._mean.add(held.time, held.reading, command)
        return status

    def followed(self, reference: Float[np.ndarray, "k"], status: Status) -> Followed:
        """All of it, with what was wanted at its samples, and how it ended."""
        samples = self.robot.dt * np.arange(len(self.rows))
        output, measured, command = np.array(self.rows).T
        of_samples = samples, reference[: len(self.rows)], output, measured, command
        return Followed(self.robot, *of_samples, tuple(self.standings), tuple(self.pieces), status)


class _Sensor:
    """What is told of what is, sample by sample; before the first one all was as it was then."""

    def __init__(self, measuring: Measuring, dt: float, first: float):
        sensor = Sensor(*map(jnp.asarray, (measuring.noise, -jnp.inf, jnp.inf, measuring.seed)))
        late = DeadTime(jnp.asarray(measuring.delay), int(measuring.delay / dt) + 2)
        self._stepper: Any = Chain((late, sensor)).sampled(dt) if measuring.delay else sensor
        self._exact = not (measuring.delay or measuring.noise)
        self._state, self._first, self._before = self._stepper.initial(), first, first

    def read(self, value: float) -> float:
        if self._exact:
            return value
        line = Line(jnp.asarray(self._before - self._first), jnp.asarray(value - self._first))
        self._state, told = _told(self._stepper, self._state, line)
        self._before = value
        return float(told) + self._first


@eqx.filter_jit
def _told(stepper: Any, state: Any, line: Line) -> tuple[Any, Any]:
    state, line = stepper.step(state, line)
    return state, line.end


@eqx.filter_jit
def _step(regulator: Regulator, state: Any, measured: Any) -> tuple[Any, Any]:
    return regulator.step(state, measured)
