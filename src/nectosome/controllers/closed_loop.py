"""A robot under a controller: measured and commanded once a sample; its command is held in between."""

import json
from collections.abc import Sequence
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
from nectosome.units import InputError

from .beat import Beat, BeatMean
from .contract import Controller, Progress, Regulator, Stop

if TYPE_CHECKING:
    import xarray as xr


_MOST = 4000  # instants of a run that is saved, or one a sample


@dataclass(frozen=True)
class ClosedLoopRecord:
    """Record of a robot under a controller, in SI units: samples k, and instants m between them.

    `states` and `intervals` are the state of the robot and its motion, at the start and after each hold interval.
    """

    robot: SampledPlant
    time: Float[np.ndarray, "k"]  # [s]
    reference: Float[np.ndarray, "k"]
    output: Float[np.ndarray, "k"]  # true, without delay and noise; averaged over a beat where the sensor model does so
    measured: Float[np.ndarray, "k"]  # input of the controller
    command: Float[np.ndarray, "k"]  # held from this sample to the next
    states: Sequence[PlantState]
    intervals: Sequence[HoldInterval]
    status: Status

    @cached_property
    def instants(self) -> Float[np.ndarray, "m"]:
        """Times within the hold intervals [s]."""
        return np.concatenate([interval.time for interval in self.intervals])

    @cached_property
    def reading(self) -> Float[np.ndarray, "m"]:
        """The measured quantity at each instant, without averaging, delay and noise."""
        return np.concatenate([interval.reading for interval in self.intervals])

    @property
    def title(self) -> str:
        """Robot, measured quantity and command."""
        return f"{self.robot.description.name}: {self.robot.reading.name} by {self.robot.command}"

    def last(self, seconds: float) -> "ClosedLoopRecord":
        """The last seconds of the record."""
        k = max(len(self.time) - int(min(seconds / self.robot.dt, len(self.time))), 0)
        rows = {name: getattr(self, name)[k:] for name in ("time", "reference", "output", "measured", "command")}
        return replace(self, **rows, states=self.states[k:], intervals=self.intervals[k:])

    def signals(self) -> "xr.Dataset":
        """`reference`, `output`, `measured`, `command` over `sample` [s], `reading` and `position` over `time` [s].

        `position` [m] is that of each part's first station. Nothing is simulated for it, unlike `to_dataset`.
        """
        position = np.concatenate([interval.position for interval in self.intervals])
        signals = self.samples().assign_coords(
            time=("time", self.instants, {"units": "s"}), station_part=("station", [*self.robot.parts])
        )
        return signals.assign(
            reading=("time", self.reading, {"units": self._unit}),
            position=(("time", "station", "axis"), position, {"units": "m"}),
        )

    def to_dataset(
        self, settings: dict[str, Any] | None = None, diagnoses: Sequence[Diagnosis] | None = None
    ) -> "xr.Dataset":
        """The record as a run like that of `simulate`, in SI units, with `reading`, and the signals over `sample`.

        It begins after the first sample; raises InputError where nothing follows it. `settings` go into its provenance;
        `diagnoses` of all hold intervals but the first, where known, save their computation. A record of more than
        4000 instants is thinned.
        """
        intervals = self.intervals[1:]
        if not intervals:
            raise InputError("the run ended before its first hold interval: there is nothing to save.")
        if diagnoses is None:
            pairs = zip(self.states[:-1], self.states[1:], intervals, strict=True)
            diagnoses = [self.robot.diagnosis(*pair) for pair in pairs]
        instants = len(intervals[0].time)
        every = min(-(-instants * len(intervals) // _MOST), instants)
        some = slice(every - 1 + (instants - every) % every, None, every)  # with the end of each sample
        time, reading = (np.concatenate([getattr(x, name)[some] for x in intervals]) for name in ("time", "reading"))
        states = jax.tree.map(lambda *x: jnp.concatenate([a[some] for a in x]), *(x.state for x in intervals))
        forces = jax.tree.map(lambda *x: np.concatenate([a[some] for a in x]), *diagnoses)
        description = self.robot.description
        trajectory = Trajectory(build(description), jnp.asarray(time), states)
        run = Run(trajectory, jnp.asarray(int(self.status)), {}, jnp.zeros(()))
        whole = results_of(run, forces, settings).to_dataset().merge(self.samples())
        return whole.assign(reading=("time", reading, {"units": self._unit})).assign_attrs(
            self.samples().attrs, robot=dump_robot(description), provenance=json.dumps(provenance(settings or {}))
        )

    @property
    def _unit(self) -> str:
        return self.robot.reading.unit or "1"

    def samples(self) -> "xr.Dataset":
        """`reference`, `output`, `measured` and `command` over `sample` [s]."""
        import xarray as xr

        of, command = self._unit, self.robot.quantity.unit or "1"
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


_PROGRESS = 100  # calls of `progress` in a run


class SensorModel(NamedTuple):
    """How a reading becomes a measurement: averaged over a beat or not, delayed, and with noise."""

    beat: Beat | None = None  # over which it is averaged
    delay: float = 0.0  # [s]
    noise: float = 0.0  # standard deviation of a sample, in SI
    seed: int = 0


@dataclass(frozen=True)
class RobotLoop:
    """A robot with its sensor, which runs under any controller from the start of its description."""

    robot: SampledPlant
    sensor: SensorModel = SensorModel()

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return self.robot.dt

    def quiet(self) -> "RobotLoop":
        """The same without noise of the sensor."""
        return replace(self, sensor=self.sensor._replace(noise=0.0))

    def run(
        self,
        controller: Controller,
        reference: Float[np.ndarray, "k"],
        *,
        progress: Progress | None = None,
        stop: Stop | None = None,
    ) -> ClosedLoopRecord:
        """Simulate the robot under a controller along a reference, given at its samples.

        At each sample the measurement is taken first; the command computed from it is held until the next sample. The
        controller takes over the command of the description without a bump. `progress(share)` is called about a hundred
        times; the run is cancelled where it returns False. It ends after the first sample at which
        `stop(measured, commands)` is true. The record has all samples until then.
        """
        regulator = controller.planned(reference, self.dt)
        run = ClosedLoopRun(self, regulator, float(reference[0]))
        status = Status.SOLVED
        every = max(len(reference) // _PROGRESS, 1)
        for k in range(len(reference)):
            run.sample(regulator)
            if k == len(reference) - 1 or (stop is not None and stop(*np.array(run.rows).T[1:])):
                break
            if progress is not None and k % every == 0 and progress(k / len(reference)) is False:
                status = Status.CANCELLED
                break
            status = run.hold()
            if status != Status.SOLVED:
                break
        return run.record(np.asarray(reference, dtype=float), status)


class ClosedLoopRun:
    """A robot under a controller, sample by sample: `sample`, `hold`, `sample`, ...

    The regulator is given at each sample, and may have other numbers then. It takes over the command of the
    description, at the error from `reference`, that of the first sample.

    - states, intervals: state of the robot and its motion, at the start and after each hold interval.
    - rows: true output, measurement and command of each sample.
    """

    def __init__(self, loop: RobotLoop, regulator: Regulator, reference: float):
        robot, sensor = loop.robot, loop.sensor
        self.robot, self.rows = robot, list[tuple[float, float, float]]()
        self._regulator_state = regulator.initial(robot.initial_command, reference)  # another first reference is a step
        start, first = robot.start()
        self.states, self.intervals = [start], [first]
        self._sensor = _SampledSensor(sensor, robot.dt, start.reading)
        self._mean = None if sensor.beat is None else BeatMean(sensor.beat, start.reading)

    @property
    def state(self) -> PlantState:
        """Present state of the robot."""
        return self.states[-1]

    def sample(self, regulator: Regulator) -> None:
        """Take a measurement and compute the command: one more row."""
        output = self.state.reading if self._mean is None else self._mean.mean()
        measured = self._sensor.measure(output)
        # a float would compile anew
        self._regulator_state, command = _step(regulator, self._regulator_state, jnp.asarray(measured))
        self.rows.append((output, measured, float(command)))

    def hold(self) -> Status:
        """Hold the command until the next sample: one more interval, where the simulation succeeds."""
        command = self.rows[-1][2]
        state, interval, status = self.robot.hold(self.state, command)
        if interval is not None:
            self.states.append(state)
            self.intervals.append(interval)
            if self._mean is not None:
                self._mean.add(interval.time, interval.reading, command)
        return status

    def record(self, reference: Float[np.ndarray, "k"], status: Status) -> ClosedLoopRecord:
        """The record so far, with the reference at its samples and the status."""
        samples = self.robot.dt * np.arange(len(self.rows))
        output, measured, command = np.array(self.rows).T
        signals = samples, reference[: len(self.rows)], output, measured, command
        return ClosedLoopRecord(self.robot, *signals, tuple(self.states), tuple(self.intervals), status)


class _SampledSensor:
    """A sensor model, sample by sample; before the first sample the reading was constant."""

    def __init__(self, model: SensorModel, dt: float, first: float):
        sensor = Sensor(*map(jnp.asarray, (model.noise, -jnp.inf, jnp.inf, model.seed)))
        delay = DeadTime(jnp.asarray(model.delay), int(model.delay / dt) + 2)
        self._stepper: Any = Chain((delay, sensor)).sampled(dt) if model.delay else sensor
        self._exact = not (model.delay or model.noise)
        self._state, self._first, self._previous = self._stepper.initial(), first, first

    def measure(self, value: float) -> float:
        if self._exact:
            return value
        line = Line(jnp.asarray(self._previous - self._first), jnp.asarray(value - self._first))
        self._state, measured = _step_sensor(self._stepper, self._state, line)
        self._previous = value
        return float(measured) + self._first


@eqx.filter_jit
def _step_sensor(stepper: Any, state: Any, line: Line) -> tuple[Any, Any]:
    state, line = stepper.step(state, line)
    return state, line.end


@eqx.filter_jit
def _step(regulator: Regulator, state: Any, measured: Any) -> tuple[Any, Any]:
    return regulator.step(state, measured)
