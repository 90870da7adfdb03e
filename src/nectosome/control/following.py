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
    state = regulator.initial(robot.resting, float(reference[0]))  # a reference that begins apart is a step
    (standing, held), status = robot.start(), Status.SOLVED
    sensor = _Sensor(measuring, robot.dt, standing.reading)
    mean = None if measuring.beat is None else BeatMean(measuring.beat, standing.reading)
    rows: list[tuple[float, float, float]] = []
    pieces = [held]
    every = max(len(reference) // _PROGRESS, 1)
    for k in range(len(reference)):
        output = standing.reading if mean is None else mean.mean()
        measured = sensor.read(output)
        state, command = _step(regulator, state, jnp.asarray(measured))  # a float would compile anew
        rows.append((output, measured, float(command)))
        if k == len(reference) - 1 or (enough is not None and enough(*np.array(rows).T[1:])):
            break
        if progress is not None and k % every == 0 and progress(k / len(reference)) is False:
            status = Status.CANCELLED
            break
        standing, held, status = robot.hold(standing, float(command))
        if held is None:
            break
        pieces.append(held)
        if mean is not None:
            mean.add(held.time, held.reading, float(command))
    return _followed(robot, np.asarray(reference, dtype=float), np.array(rows), pieces, status)


def _followed(robot: Commanded, reference: np.ndarray, rows: np.ndarray, pieces: list, status: Status) -> Followed:
    time, reading, position = (np.concatenate([getattr(p, f) for p in pieces]) for f in ("time", "reading", "position"))
    q, v = (np.concatenate([getattr(p.state, f) for p in pieces]) for f in "qv")
    q = np.asarray(jax.jit(jax.vmap(robot.displacements))(jnp.asarray(q)))
    output, measured, command = rows.T
    return Followed(
        robot,
        robot.dt * np.arange(len(rows)),
        reference[: len(rows)],
        output,
        measured,
        command,
        time,
        reading,
        position,
        q,
        v,
        status,
    )


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
