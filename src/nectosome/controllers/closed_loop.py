"""A robot under a controller: measured and commanded once a sample, its state carried on in between."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.core import Line, Status
from nectosome.description import dump_robot
from nectosome.drives import Chain, DeadTime, Sensor
from nectosome.io import provenance
from nectosome.mechanism import Diagnosis
from nectosome.model import build
from nectosome.solve import Run, SampledPlant, Trajectory, results_of
from nectosome.solve.sampled_plant import HoldInterval, PlantState
from nectosome.units import DIMENSIONS

from .beat import Beat, BeatMean
from .contract import Controller, Regulator

if TYPE_CHECKING:
    import xarray as xr


_MOST = 4000  # moments of a run that are kept, or one a sample


@dataclass(frozen=True)
class ClosedLoopRecord:
    """What a robot did under a controller. Samples have the index k, moments within them m.

    `standings` and `pieces` are where the robot stood and what it did, at first and after each sample that was held.
    """

    robot: SampledPlant
    time: Float[np.ndarray, "k"]  # [s]
    reference: Float[np.ndarray, "k"]
    output: Float[np.ndarray, "k"]  # what was, without delay and noise; its mean over a beat where that is measured
    measured: Float[np.ndarray, "k"]  # what the controller was told
    command: Float[np.ndarray, "k"]  # held from this sample to the next
    standings: Sequence[PlantState]
    pieces: Sequence[HoldInterval]
    status: Status

    @cached_property
    def moment(self) -> Float[np.ndarray, "m"]:
        """Times between the samples [s]."""
        return np.concatenate([piece.time for piece in self.pieces])

    @cached_property
    def reading(self) -> Float[np.ndarray, "m"]:
        """What is measured, at each moment."""
        return np.concatenate([piece.reading for piece in self.pieces])

    @property
    def title(self) -> str:
        """Robot, what is measured and what is commanded."""
        return f"{self.robot.description.name}: {self.robot.reading.name} by {self.robot.command}"

    def last(self, seconds: float) -> "ClosedLoopRecord":
        """The last so many seconds of it."""
        k = max(len(self.time) - int(min(seconds / self.robot.dt, len(self.time))), 0)
        rows = {name: getattr(self, name)[k:] for name in ("time", "reference", "output", "measured", "command")}
        return replace(self, **rows, standings=self.standings[k:], pieces=self.pieces[k:])

    def track(self) -> "xr.Dataset":
        """`reference`, `output`, `measured`, `command` over `sample` [s], `reading` and `position` over `time` [s].

        `position` [m] is that of each part's first station. Computes nothing.
        """
        import xarray as xr

        position = np.concatenate([piece.position for piece in self.pieces])
        return self._samples().merge(
            xr.Dataset(
                {
                    "reading": ("time", self.reading, {"units": self._of}),
                    "position": (("time", "station", "axis"), position, {"units": "m"}),
                },
                coords={
                    "time": ("time", self.moment, {"units": "s"}),
                    "station_part": ("station", [*self.robot.parts]),
                },
            )
        )

    def to_dataset(
        self, settings: dict[str, Any] | None = None, diagnoses: Sequence[Diagnosis] | None = None
    ) -> "xr.Dataset":
        """A run like any, in SI units, from the first sample on, with what `track` has over `sample`, and `reading`.

        `settings` go into its provenance; `diagnoses` of all pieces but the first, where they are known, are not
        computed again. Of very many moments as many are kept as are seen.
        """
        pieces = self.pieces[1:]
        if diagnoses is None:
            held = zip(self.standings[:-1], self.standings[1:], pieces, strict=True)
            diagnoses = [self.robot.diagnosis(*what) for what in held]
        moments = len(pieces[0].time)
        every = min(-(-moments * len(pieces) // _MOST), moments)
        some = slice(every - 1 + (moments - every) % every, None, every)  # the end of a sample is one of them
        time, reading = (np.concatenate([getattr(p, name)[some] for p in pieces]) for name in ("time", "reading"))
        states = jax.tree.map(lambda *x: jnp.concatenate([a[some] for a in x]), *(p.state for p in pieces))
        told = jax.tree.map(lambda *x: np.concatenate([a[some] for a in x]), *diagnoses)
        description = self.robot.description
        trajectory = Trajectory(build(description), jnp.asarray(time), states)
        run = Run(trajectory, jnp.asarray(int(self.status)), {}, jnp.zeros(()))
        whole = results_of(run, told, settings).to_dataset().merge(self._samples())
        return whole.assign(reading=("time", reading, {"units": self._of})).assign_attrs(
            self._samples().attrs, robot=dump_robot(description), provenance=json.dumps(provenance(settings or {}))
        )

    @property
    def _of(self) -> str:
        return DIMENSIONS[self.robot.reading.dimension].unit or "1"

    def _samples(self) -> "xr.Dataset":
        import xarray as xr

        of, command = self._of, self.robot.quantity.unit or "1"
        units = {"reference": of, "output": of, "measured": of, "command": command}
        return xr.Dataset(
            {name: ("sample", getattr(self, name), {"units": unit}) for name, unit in units.items()},
            coords={"sample": ("sample", self.time, {"units": "s"})},
            attrs={
                "title": self.title,
                "measured": self.robot.reading.name,
                "commanded": self.robot.command,
                "status": self.status.name,
                "status_reason": self.status.reason,
            },
        )


_PROGRESS = 100  # times a run tells how far it is


class SensorModel(NamedTuple):
    """How what is measured comes to the controller: as it is, or as its mean over a beat; late, and with noise."""

    beat: Beat | None = None  # whose mean it is
    delay: float = 0.0  # [s]
    noise: float = 0.0  # standard deviation of a sample, in SI
    seed: int = 0


PLAIN = SensorModel()


def run_closed_loop(
    robot: SampledPlant,
    controller: Controller,
    reference: Float[np.ndarray, "k"],
    measuring: SensorModel = PLAIN,
    *,
    progress: Callable[[float], bool | None] | None = None,
    enough: Callable[[Float[np.ndarray, "k"], Float[np.ndarray, "k"]], bool] | None = None,
) -> ClosedLoopRecord:
    """Let a robot follow a reference, given at its samples, from where its description starts.

    At each sample the measurement is taken first, and the command that follows from it is held until the next. The
    controller takes over from the command of the description. `progress(share)` is called now and then, and the run is
    cancelled where it returns False; it ends after a sample of which `enough(measured, commands)` is true. What was
    done until then is kept.
    """
    regulator = controller.planned(reference, robot.dt)
    going = ClosedLoopRun(robot, regulator, float(reference[0]), measuring)
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


class ClosedLoopRun:
    """A robot under a controller that goes on sample by sample: `sample`, `hold`, `sample`, ...

    The regulator is handed over at each sample, and may have other numbers then. It takes over from the command of the
    description, and from `first`, what is wanted at first.

    - standings, pieces: where the robot was and what it did, one for the start and one for each sample that was held.
    - rows: for each sample what was, what the controller was told, and the command.
    """

    def __init__(self, robot: SampledPlant, regulator: Regulator, first: float, measuring: SensorModel = PLAIN):
        self.robot, self.rows = robot, list[tuple[float, float, float]]()
        self._state = regulator.initial(robot.resting, first)  # a reference that begins apart is a step
        start, begin = robot.start()
        self.standings, self.pieces = [start], [begin]
        self._sensor = _Sensor(measuring, robot.dt, start.reading)
        self._mean = None if measuring.beat is None else BeatMean(measuring.beat, start.reading)

    @property
    def standing(self) -> PlantState:
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

    def followed(self, reference: Float[np.ndarray, "k"], status: Status) -> ClosedLoopRecord:
        """All of it, with what was wanted at its samples, and how it ended."""
        samples = self.robot.dt * np.arange(len(self.rows))
        output, measured, command = np.array(self.rows).T
        of_samples = samples, reference[: len(self.rows)], output, measured, command
        return ClosedLoopRecord(self.robot, *of_samples, tuple(self.standings), tuple(self.pieces), status)


class _Sensor:
    """What is told of what is, sample by sample; before the first one all was as it was then."""

    def __init__(self, measuring: SensorModel, dt: float, first: float):
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
