"""A robot under a controller: measured and commanded once a sample, its state carried on in between."""

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.actuators import Chain, DeadTime, Sensor
from nectosome.core import Line, Status
from nectosome.io import dump_robot, provenance
from nectosome.io.dimensions import DIMENSIONS
from nectosome.robots import Commanded

from .beat import Beat, BeatMean
from .controller import Controller, Regulator

if TYPE_CHECKING:
    import xarray as xr

_PROGRESS = 100  # times a run tells how far it is


class Measuring(NamedTuple):
    """How what is measured comes to the controller: as it is, or as its mean over a beat; late, and with noise."""

    beat: Beat | None = None  # whose mean it is
    delay: float = 0.0  # [s]
    noise: float = 0.0  # standard deviation of a sample, in SI
    seed: int = 0


PLAIN = Measuring()


class Followed(NamedTuple):
    """What a robot did under a controller. Samples have the index k, moments within them m."""

    robot: Commanded
    time: Float[np.ndarray, "k"]  # [s]
    reference: Float[np.ndarray, "k"]
    output: Float[np.ndarray, "k"]  # what was, without delay and noise; its mean over a beat where that is measured
    measured: Float[np.ndarray, "k"]  # what the controller was told
    command: Float[np.ndarray, "k"]  # held from this sample to the next
    moment: Float[np.ndarray, "m"]  # [s]
    reading: Float[np.ndarray, "m"]  # what is measured, at each moment
    position: Float[np.ndarray, "m parts 3"]  # of each part's first station [m]
    q: Float[np.ndarray, "m coordinates"]  # displacements [rad or m]
    v: Float[np.ndarray, "m coordinates"]  # [rad/s or m/s]
    status: Status

    def to_dataset(self, settings: dict[str, Any] | None = None) -> "xr.Dataset":
        """As labelled data, in SI units; `settings` go into its provenance.

        `reference`, `output`, `measured`, `command` (time); `reading` (moment), `position` (moment, part, axis), `q`
        and `v` (moment, coordinate).
        """
        import xarray as xr

        robot, of = self.robot, DIMENSIONS[self.robot.reading.dimension].unit or "1"
        units = {"reference": of, "output": of, "measured": of, "command": robot.quantity.unit or "1"}
        return xr.Dataset(
            {name: ("time", getattr(self, name), {"units": unit}) for name, unit in units.items()}
            | {
                "reading": ("moment", self.reading, {"units": of}),
                "position": (("moment", "part", "axis"), self.position, {"units": "m"}),
                "q": (("moment", "coordinate"), self.q, {"units": "rad or m"}),
                "v": (("moment", "coordinate"), self.v, {"units": "rad/s or m/s"}),
            },
            coords={
                "time": ("time", self.time, {"units": "s"}),
                "moment": ("moment", self.moment, {"units": "s"}),
                "part": np.array(robot.parts, dtype=str),
                "axis": np.array(list("xyz"), dtype=str),
                "coordinate": np.array(robot.coordinates, dtype=str),
            },
            attrs={
                "title": f"{robot.description.name}: {robot.reading.name} by {robot.command}",
                "robot": dump_robot(robot.description),
                "measured": robot.reading.name,
                "commanded": robot.command,
                "status": self.status.name,
                "status_reason": self.status.reason,
                "provenance": json.dumps(provenance(settings or {})),
            },
        )


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

    - standing: where the robot is; pieces: what it did, one for the start and one for each sample that was held.
    - rows: for each sample what was, what the controller was told, and the command.
    """

    def __init__(self, robot: Commanded, regulator: Regulator, first: float, measuring: Measuring = PLAIN):
        self.robot, self.rows = robot, list[tuple[float, float, float]]()
        self._state = regulator.initial(robot.resting, first)  # a reference that begins apart is a step
        self.standing, begin = robot.start()
        self.pieces = [begin]
        self._sensor = _Sensor(measuring, robot.dt, self.standing.reading)
        self._mean = None if measuring.beat is None else BeatMean(measuring.beat, self.standing.reading)

    def sample(self, regulator: Regulator) -> None:
        """Take the measurement, and the command that follows from it: one row more."""
        output = self.standing.reading if self._mean is None else self._mean.mean()
        measured = self._sensor.read(output)
        self._state, command = _step(regulator, self._state, jnp.asarray(measured))  # a float would compile anew
        self.rows.append((output, measured, float(command)))

    def hold(self) -> Status:
        """Hold the command until the next sample: one piece more, where the robot gets through it."""
        command = self.rows[-1][2]
        self.standing, held, status = self.robot.hold(self.standing, command)
        if held is not None:
            self.pieces.append(held)
            if self._mean is not None:
                self._mean.add(held.time, held.reading, command)
        return status

    def followed(self, reference: Float[np.ndarray, "k"], status: Status) -> Followed:
        """All of it, with what was wanted at its samples, and how it ended."""
        time, reading, position = (
            np.concatenate([getattr(p, f) for p in self.pieces]) for f in ("time", "reading", "position")
        )
        q, v = (np.concatenate([getattr(p.state, f) for p in self.pieces]) for f in "qv")
        q = np.asarray(jax.jit(jax.vmap(self.robot.displacements))(jnp.asarray(q)))
        samples = self.robot.dt * np.arange(len(self.rows))
        output, measured, command = np.array(self.rows).T
        wanted = reference[: len(self.rows)]
        return Followed(self.robot, samples, wanted, output, measured, command, time, reading, position, q, v, status)


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
