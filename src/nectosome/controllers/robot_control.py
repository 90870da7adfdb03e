"""A controller on any robot in one call: parse, find gains and a model, simulate the closed loop, learn from it."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict, TypeVar, Unpack

import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.model.inputs import RobotLike, description_of
from nectosome.solve import SampledPlant
from nectosome.units import InputError, read_positive, read_quantity, show_quantity

from .autotune import LoopGains, find_gains
from .beat import Beat, instants_per_sample
from .closed_loop import ClosedLoopRecord, RobotLoop, SensorModel
from .commands import CommandRange
from .contract import ActuatorLimits, Controller, LoopData, controller_named, controllers
from .gains import PIDGains
from .linear_model import RobotModel, robot_model
from .own import ControlFunction, FunctionController, LimitedController
from .pid import PID, smooth_pid
from .references import Reference
from .tracking_errors import rms_error, step_response, still_approaching

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[str, float], bool | None]
ReferenceLike = str | Path | float | Float[np.ndarray, "k"] | Mapping[str, Any] | Reference
ControllerLike = str | Controller | ControlFunction

_RATE, _PER_BEAT = 20.0, 4  # samples a second, and a beat where the measurement is averaged over one
_MOST = 100_000  # samples
_REACHED = 0.05  # of a step, within which a constant reference counts as reached
_POOR, _SATURATED = 0.5, 0.1  # shares: of what a reference varies by; of samples with the command at an end
_LEAST = 4  # samples of a run that is judged
_SAMPLES = 20  # of a cycle of a reference, below which samples are too few for it
_FOUND = 0.85  # of the time, until the controller is found
_ROUNDS = 5  # of a controller that learns
_MODEL = 0.3  # of the time until a controller is found
_QUIET = 1e-4  # of the reference's range: the least noise that a predictive controller assumes


_Found = TypeVar("_Found")


class Shape(TypedDict, total=False):
    """Options of a reference, as text with units: see `Reference.parse`."""

    amplitude: str | None
    frequency: str | None
    to: str | None
    column: str | None


class LoopOptions(Shape, total=False):
    """Options of a closed loop, as text with units or in SI: see `control`."""

    controller: ControllerLike
    rounds: int | None
    gains: str | Sequence[float] | None
    rate: str | float | None
    mean: bool
    noise: str | float | None
    delay: str | float | None


class FoundOnce:
    """What controllers of one task share, such as gains and a model: found once, or why it is not found."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, bool], Any] = {}

    def get(self, what: str, scheduled: bool, find: Callable[[], _Found | None]) -> _Found | None:
        """What `find` returns, or raises as InputError; it is called again only where it was cancelled (None)."""
        key = what, scheduled
        if key not in self._found:
            try:
                found = find()
            except InputError as error:
                found = error
            if found is None:
                return None
            self._found[key] = found
        known = self._found[key]
        if isinstance(known, InputError):
            raise InputError(known.message, field=known.field)
        return known


class FoundController(NamedTuple):
    """A controller with its gains, which one of one's own has not, and the model that it has."""

    controller: Controller
    gains: LoopGains | None = None
    model: RobotModel | None = None


@dataclass(frozen=True)
class ControlTask:
    """A robot with its command, sensor and reference, parsed and checked."""

    robot: SampledPlant
    command: CommandRange
    reference: Reference
    sensor: SensorModel
    beat: Beat | None
    start: float  # output at t = 0 [SI]
    given: PIDGains | None  # [SI]
    controller: type[Controller] | Controller  # made of gains, or one of one's own
    rounds: int  # runs, of which each but the first is learned from the one before

    @classmethod
    def parse(
        cls,
        robot: RobotLike,
        *,
        command: str,
        measure: str,
        reference: ReferenceLike,
        controller: ControllerLike = "pid",
        rounds: int | None = None,
        gains: str | Sequence[float] | None = None,
        rate: str | float | None = None,
        mean: bool = False,
        noise: str | float | None = None,
        delay: str | float | None = None,
        settings: Iterable[str] = (),
        resolution: float = math.inf,
        **shape: Unpack[Shape],
    ) -> "ControlTask":
        """Read what `control` takes; `resolution` [s] is the longest time between recorded instants.

        Raises InputError, whose field is the argument.
        """
        description = description_of(robot, settings)
        frequency = None if rate is None else read_positive(rate, "frequency", "rate")
        late = 0.0 if delay is None else read_positive(delay, "time", "delay")
        kind = controller_of(controller)
        if rounds is not None and (not kind.learns or rounds < 1):
            learning = ", ".join(name for name, one in controllers().items() if one.learns)
            raise InputError(f"are those of {learning}, at least 1.", field="rounds")
        if gains is not None:
            if isinstance(kind, Controller):
                raise InputError(
                    "belong to a controller by its name: a controller of your own has its own.", field="gains"
                )
            parsed = PIDGains.parse(gains)
            _ = parsed.table if kind.scheduled else parsed.row
        span = CommandRange.parse(command, description)
        beat = span.beat(description, required=mean)
        if frequency is None:
            frequency = _PER_BEAT * beat.at(span.initial) if mean and beat is not None else _RATE
        dt = 1 / frequency
        instants = 1 if beat is None else instants_per_sample(beat, span.largest, dt)
        instants = max(instants, math.ceil(dt / resolution))
        try:
            plant = SampledPlant(description, span.name, measure, dt, instants)
        except InputError as error:
            raise InputError(error.message, field=error.field or "measure") from None
        target = Reference.parse(reference, plant.reading.dimension, **shape)
        spread = 0.0 if noise is None else read_quantity(noise, plant.reading.dimension, "noise")
        if spread < 0:
            raise InputError(f'"{noise}" is out of range: it must be not less than 0.', field="noise")
        sensor = SensorModel(beat if mean else None, late, spread)
        given = None if gains is None else PIDGains.parse(gains, span.unit_size / target.unit_size)
        whole = cls(plant, span, target, sensor, beat, plant.start()[0].reading, given, kind, 1)
        return whole.under(kind, rounds)

    def under(self, kind: type[Controller] | Controller, rounds: int | None = None) -> "ControlTask":
        """The same under another controller, with `rounds` where it learns."""
        return replace(self, controller=kind, rounds=(rounds or _ROUNDS) if kind.learns else 1)

    @property
    def loop(self) -> RobotLoop:
        """The robot with its sensor."""
        return RobotLoop(self.robot, self.sensor)

    def samples(self, time: float) -> Float[np.ndarray, "k"]:
        """The reference at its samples [SI], `time` [s] long. Raises InputError for too few or too many samples."""
        dt = self.robot.dt
        if not 2 <= time / dt <= _MOST:
            what = f"{show_quantity(1 / dt, 'frequency')} for {show_quantity(time, 'time')} is {time / dt:.3g} samples"
            raise InputError(f"{what}; from 2 to {_MOST} are possible.", field="rate")
        return self.reference.samples(time, dt, self.start)

    def seconds(self, time: str | float | None = None) -> float:
        """The given length [s], else that of the reference. Raises InputError."""
        return self.reference.duration(self.robot.dt) if time is None else read_positive(time, "time", "time")

    def find_gains(self, time: float, progress: Progress | None = None) -> LoopGains | None:
        """The given gains, or those of a relay experiment, detuned along `time` [s] of the reference.

        None where `progress` returns False. Raises InputError where no gains are found.
        """
        if self.given is not None:
            return LoopGains(self.given)
        samples = self.samples(time)
        setpoint = float(samples[0]) if self.reference.kind == "constant" else self.start
        return find_gains(
            self.loop, self._range, setpoint, ActuatorLimits(*self._range), samples,
            schedule=self.controller.scheduled, progress=progress,
        )  # fmt: skip

    def find_law(
        self, time: float, progress: Progress | None = None, *, slew: float = math.inf, known: FoundOnce | None = None
    ) -> FoundController | None:
        """The controller along `time` [s] of the reference, with the gains of `find_gains`, or one's own.

        `slew` is the largest rate of the command; `known` has what other controllers of this task and time found. None
        where `progress` returns False. Raises InputError where no gains are found, or no model that the controller
        needs.
        """
        limits, kind, shared = ActuatorLimits(*self._range, slew), self.controller, known or FoundOnce()
        if isinstance(kind, Controller):
            return FoundController(LimitedController(kind, limits))
        until = 1 - _MODEL * kind.needs_model
        tuning = None if progress is None else lambda what, x: progress(what, until * x)
        gains = shared.get("gains", kind.scheduled, lambda: self.find_gains(time, tuning))
        if gains is None:
            return None
        dt = self.robot.dt
        if not kind.needs_model:
            return FoundController(kind.from_loop(LoopData(gains.gains, limits, dt)), gains)
        samples, pid = self.samples(time), self.pid(gains)
        beat = 0.0 if self.beat is None else 1 / self.beat.at(self.command.initial)
        finding = _named("finding a model", progress, until, 1.0)
        model = shared.get("model", kind.scheduled, lambda: robot_model(self.loop, pid, samples, finding, beat))
        if model is None:
            return None
        noise = max(self.sensor.noise, _QUIET * float(np.ptp(np.append(samples, self.start))))
        pace = model.pace(limits, samples, noise)
        data = LoopData(gains.gains, limits, dt, model.for_controllers(), noise, pace, beat)
        return FoundController(kind.from_loop(data), gains, model)

    def run(self, time: float, progress: Progress | None = None, known: FoundOnce | None = None) -> "ControlResult":
        """Find the controller along `time` [s] of the reference, and simulate all rounds; see `find_law`."""
        kind, samples = self.controller, self.samples(time)
        begun = 0.0 if isinstance(kind, Controller) or (self.given is not None and not kind.needs_model) else _FOUND
        finding = None if progress is None else lambda what, x: progress(what, begun * x)
        law = self.find_law(time, finding, known=known)
        if law is None:
            (state, interval), none = self.robot.start(), np.zeros(0)
            signals = none, none, none, none, none
            empty = ClosedLoopRecord(self.robot, *signals, (state,), (interval,), Status.CANCELLED)
            return ControlResult(self, None, empty)
        course = samples.copy()
        if self.reference.kind == "constant" and law.model is not None:
            course[0] = self.start  # a step one sample later: what is known in advance is no bump
        runs = list[ClosedLoopRecord]()
        for k in range(self.rounds):
            acting = law.controller.after(runs[-1], self.robot.dt) if runs else law.controller
            part = (1 - begun) / self.rounds
            simulating = _named("simulating the loop", progress, begun + k * part, begun + (k + 1) * part)
            loop = RobotLoop(self.robot, self.sensor._replace(seed=k))  # another noise in each run: it is not learned
            runs.append(loop.run(acting, course, progress=simulating))
            if runs[-1].status != Status.SOLVED:
                break
        errors = tuple(rms_error(run.output, samples[: len(run.time)]) for run in runs)
        record = replace(runs[-1], reference=samples[: len(runs[-1].time)])
        return ControlResult(self, law, record, errors)

    def pid(self, gains: LoopGains) -> PID:
        """PID of a row of gains, within the range of the command."""
        return smooth_pid(gains.gains.row, ActuatorLimits(*self._range), self.robot.dt)

    @property
    def _range(self) -> tuple[float, float]:
        return self.command.low, self.command.high

    def gains_text(self, gains: LoopGains) -> str:
        """Gains in the units in which command and reference are written, as `PIDGains.parse` reads them."""
        return gains.gains.text(self.command.unit_size / self.reference.unit_size)

    def gain_units(self) -> tuple[str, str, str]:
        """Units of K_p, K_i and K_d in that text."""
        c, m = self.command.unit or "1", self.reference.unit or "1"
        m = f"({m})" if re.search("[ /]", m) else m
        return f"{c}/{m}", f"{c}/({m} s)", f"{c} s/{m}"


@dataclass(frozen=True)
class ControlResult:
    """The last closed-loop run with its task; without law and samples where it was cancelled before."""

    task: ControlTask
    law: FoundController | None
    record: ClosedLoopRecord
    errors: tuple[float, ...] = ()  # rms, of each run [SI]
    settings: dict[str, Any] = field(default_factory=dict)  # the arguments, for provenance

    @property
    def status(self) -> Status:
        """How the run ended."""
        return self.record.status

    def to_dataset(self) -> "xr.Dataset":
        """The run as a dataset like that of `simulate`, with the signals of the loop over `sample`, in SI units."""
        return self.record.to_dataset(self.settings)

    def missed(self) -> str:
        """Why a constant reference was not reached although the command is saturated, in a sentence; else "".

        Of one that changes, why it is tracked poorly: see `_poor`.
        """
        run, span, reference = self.record, self.task.command, self.task.reference
        answer = step_response(run.time, run.output, run.reference) if len(run.time) > 1 else None
        if answer is None:
            return self._poor()
        last = slice(-max(len(run.time) // 10, 1), None)
        ends = [end for end in (span.low, span.high) if np.allclose(run.command[last], end)]
        error, step = answer.steady_error, run.reference[0] - run.output[0]
        if not ends or abs(error) <= _REACHED * abs(step):
            return ""
        saturated, name = f"{span.name} is at {span.show(ends[0])}, the end of its range", run.robot.reading.name
        now, target = reference.show(run.output[-1]), reference.show(run.reference[-1])
        if error * step < 0 and abs(error) > abs(step):
            return f"{saturated}, and {name} moved away from the reference, to {now}. Try gains of the other sign."
        if still_approaching(run.output - run.reference):
            more = "Give it more time."
            return f"{target} is not reached yet: {saturated}, and {name} is {now} and approaches it. {more}"
        return f"the reference is out of reach: {saturated}, and {name} is {now} instead of {target}."

    def _poor(self) -> str:
        """Why the second half of a run is off by more than half of what its reference varies by (rms), else ""."""
        run, span = self.record, self.task.command
        late = slice(len(run.time) // 2, None)
        reference = run.reference[late]
        varies, off = float(np.std(run.reference)), rms_error(run.output[late], reference)
        if len(run.time) < _LEAST or not varies > 0 or off <= _POOR * varies:
            return ""
        show = self.task.reference.show
        what = f"{run.robot.reading.name} is off by {show(off)} (rms), and its reference varies by {show(varies)}"
        at_end = float(np.mean(span.at_limits(run.command[late])))
        turns = np.diff(np.signbit(reference - reference.mean()).astype(int)) > 0
        cycles = max(int(turns.sum()), 1)
        if len(reference) / cycles < _SAMPLES:
            why = f"the reference has about {len(reference) / cycles:.0f} samples a cycle. Take a higher --rate."
        elif at_end > _SATURATED:
            ends = f"{span.show(span.low)} and {span.show(span.high)}"
            why = f"{span.name} is at an end of its range ({ends}) in {100 * at_end:.0f} % of the samples. "
            why += "Take a wider one, or a smaller or slower reference."
        else:
            *others, last = (one for one in ("ff-pid", "mpc", "ilc") if one != self.task.controller.name)
            why = "its command stays within its range. "
            why += f"Larger --gains, or {', '.join(others)} or {last}, may do better."
        return f"tracks poorly: {what}; {why}"


def control(
    robot: RobotLike,
    *,
    command: str,
    measure: str,
    reference: ReferenceLike,
    time: str | float | None = None,
    settings: Iterable[str] = (),
    progress: Progress | None = None,
    **options: Unpack[LoopOptions],
) -> ControlResult:
    """Simulate a robot under a controller that sets one of its quantities so that a reading tracks a reference.

    Quantities are text with units, or numbers in SI.

    - robot: name, path, description or built robot; `settings` such as `f=1.5 Hz` change its quantities.
    - command: the quantity and its range, `bias=-8..8 mN m`; the description has its initial value.
    - measure: name of a reading, such as `heading` or `arm.angle` (see `nectosome.solve.reading_of`).
    - reference: a constant, a kind of signal such as `sine` with `amplitude`, `frequency`, `to`, its fields such as
      `{"kind": "stroke", ...}`, a recording with `column`, or an array of samples (see `Reference.parse`).
    - controller: `pid`; `scheduled`, a PID with gains by the frequency of the reference; `ff-pid`, `ilc` and `mpc` with
      a linear model of the robot, from a run of it (see `robot_model`). Or one's own, without gains, limited to the
      range of the command: a `Controller`, or a function of time [s], reference and measurement that returns the
      command, in SI, and that JAX can trace.
    - rounds: runs of `ilc`, 5 unless given.
    - gains: K_p, K_i, K_d in the units in which command and reference are written, and s; of `scheduled` by frequency,
      `0.2Hz: 4,0.5,0; 1Hz: 3,0.4,0`. Without them, the rules of Tyreus and Luyben after a relay experiment on the
      model, detuned along the reference, or along sines from its lowest to its highest frequency.
    - time: [s]; two periods, the length of a recording, or 10 s unless given.
    - rate: of samples; 20 Hz, or four a beat with `mean`.
    - mean: the measurement is averaged over the last beat of the drives.
    - noise, delay: standard deviation and delay of a measurement.
    - progress(what, share): the run is cancelled where it returns False.

    Raises InputError, whose field is the argument, for arguments that are wrong and where no gains are found.
    """
    settings = [settings] if isinstance(settings, str) else list(settings)
    task = ControlTask.parse(robot, command=command, measure=measure, reference=reference, settings=settings, **options)
    seconds = task.seconds(time)
    result = task.run(seconds, progress)
    kind, gains = task.controller, result.law and result.law.gains
    given = {"command": command, "measure": measure, "reference": reference, "mean": False, **options}
    given |= {"controller": kind.name or type(kind).__name__} if "controller" in options else {}
    given |= {"gains": gains and task.gains_text(gains)}
    return replace(result, settings=given_settings(robot, settings, task, seconds, given))


def given_settings(
    robot: RobotLike, settings: Sequence[str], task: ControlTask, seconds: float, given: dict[str, Any]
) -> dict[str, Any]:
    """Arguments as they are kept in provenance, without those that are None."""
    name = str(robot) if isinstance(robot, str | Path) else task.robot.description.name
    whole = {"robot": name, "set": settings, **given, "reference": _plain(given["reference"])}
    whole |= {"time": seconds, "rate": 1 / task.robot.dt}
    return {key: value for key, value in whole.items() if value is not None}


def controller_of(given: ControllerLike) -> type[Controller] | Controller:
    """The class of a name, or a controller of one's own. Raises InputError."""
    if isinstance(given, str):
        return controller_named(given)
    if isinstance(given, Controller):
        return given
    if not callable(given) or isinstance(given, type):
        what = f"the class {given.__name__}: make one" if isinstance(given, type) else f"a {type(given).__name__}"
        message = f"is {what}. A name ({', '.join(controllers())}), a Controller or a function of time, reference and "
        raise InputError(f"{message}measurement expected.", field="controller")
    return FunctionController(given)


def _named(what: str, progress: Progress | None, begun: float, ended: float) -> Callable[[float], bool | None] | None:
    """Progress of a part of the work, from one share of it to another."""
    return None if progress is None else lambda share: progress(what, begun + (ended - begun) * share)


def _plain(reference: Any) -> Any:
    if isinstance(reference, Reference):
        return reference.kind
    if isinstance(reference, Mapping):
        return dict(reference)
    return str(reference) if isinstance(reference, Path) else np.asarray(reference).tolist()
