"""Recordings as trials of a robot: what it was like, what drove it, what was measured of its motion."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import make_interp_spline

from nectosome.description import RobotDescription, Samples, apply_settings, numeric_paths, resolve, with_recordings
from nectosome.description.variables import Variable
from nectosome.io.schema.quantity import Si
from nectosome.measure.labels import conditions_of, file_of, unit_of
from nectosome.measure.signals.filters import cutoff_of, cutoffs, noise_of, smoothing_spline
from nectosome.measure.signals.noise import FELT, ROUNDED, resolution, roughness
from nectosome.mechanism import Robot
from nectosome.solve.readings import Reading, is_expression, reading_of
from nectosome.units import InputError, count, dimension_of, show_quantity

from ..recordings import Own, check_varies, clocks_of, column_of, cutoffs_of, own_of, time_of
from .static_shapes import SetRows, check_unit, is_at_rest, read_rows, set_rows
from .trial_clocks import DRIFT, SHIFT, Span, TrialClock, is_within, read_lateness
from .trial_starts import RobotStart, read_starts

if TYPE_CHECKING:
    import xarray as xr

_LEAST = 10  # samples of a column
_KNOTS = 1000  # of an input at most
_MOTIONS = "rad", "m"  # units of inputs whose accelerations act
_FINER = 4  # parts of each step of a smooth motion: the curve of its samples has kinks that cost no time steps then
_CLEAN = 5e-3  # of second differences: noise that makes more of them would cost more steps between the samples
_ROUGH = 1e-3  # of an input's range: fewer knots are noted where they leave out more
SLOW = "time steps short"  # in notes of what makes a fit slow
_EATEN = 1e-4, 0.25  # of an input's variance, beyond its noise, that a cut-off takes off: with a warning, refused
_NOISE = 4.0  # of a variance: times that of the noise


class Compared(NamedTuple):
    """A column of the recordings, and what of the robot it measures."""

    column: str
    reading: Reading
    sign: float  # of the reading

    @property
    def text(self) -> str:
        """The reading with its sign."""
        return f"{'-' if self.sign < 0 else ''}{self.reading.name}"


class RobotTrial(NamedTuple):
    """A recording of a robot: its time begins with its first sample.

    At the 0 of the robot's own time, which its clocks make of that, it is as it is described. Or its rows are shapes at
    rest, each with numbers of its own.
    """

    name: str
    description: RobotDescription  # with the conditions of the recording, and what drove the robot
    time: Float[np.ndarray, "n"]  # [s], from 0
    measured: Float[np.ndarray, "k n"]  # SI, headings beyond half a turn too; NaN where nothing is to be compared
    notes: tuple[str, ...]
    file: str
    starts: tuple[RobotStart, ...] = ()
    released: bool = False  # whether it starts at rest in equilibrium, with numbers that it had before
    clocks: tuple[TrialClock, ...] = ()  # those of devices, then the recording's own
    driven: bool = False  # by columns of the recording
    conditions: tuple[tuple[str, float], ...] = ()  # [SI]
    rows: SetRows | None = None  # what was set in each row, where each is a shape at rest: its time is NaN

    @property
    def set_paths(self) -> tuple[str, ...]:
        """Paths of the robot's numbers that were set row by row."""
        return self.rows.paths if self.rows is not None else ()

    @property
    def start(self) -> str:
        """How the robot starts, in words."""
        if self.rows is not None:
            return "at rest"
        said = [*(["in equilibrium"] if self.released else []), *(one.how for one in self.starts)]
        return ", ".join(said) or "as described"

    @property
    def held(self) -> dict[str, float]:
        """Known numbers that the robot had before its start, by path [SI]."""
        known = [one for one in self.starts if one.before and not isinstance(one.value, Variable)]
        return {path: one.value for one in known for path in one.paths}  # pyright: ignore[reportReturnType]

    @property
    def times(self) -> Float[np.ndarray, "k n"]:
        """Times at which its columns were read, as they were read [s]."""
        return np.broadcast_to(self.time, self.measured.shape)

    def with_clocks(self, clocks: Sequence[TrialClock]) -> "RobotTrial":
        """The recording with other clocks, and with what can be compared whatever is unknown of them."""
        known = is_within(clocks, self.times, self.driven)
        return self._replace(clocks=tuple(clocks), measured=np.where(known, self.measured, np.nan))


def read_compared(column: str, reading: str, robot: Robot) -> Compared:
    """What a column measures: a reading or an expression of several; a minus before a name says that the sensor reads
    the other way.

    Raises InputError for what the robot does not have.
    """
    text = reading.strip()
    name = text.removeprefix("-").strip()
    try:
        if is_expression(name):
            return Compared(column, reading_of(robot, text), 1.0)
        return Compared(column, reading_of(robot, name), -1.0 if text.startswith("-") else 1.0)
    except InputError as error:
        raise InputError(error.message, field=column) from None


def robot_trials(
    recordings: "Sequence[xr.Dataset]",
    description: RobotDescription,
    compared: Sequence[Compared],
    inputs: Mapping[str, str],
    skip: float = 0.0,
    start: Mapping[str, Span] | None = None,
    shift: Span | float = 0.0,
) -> list[RobotTrial]:
    """Trials of a robot.

    Conditions of a recording are quantities of the robot by their paths or aliases. Where columns drove the robot,
    others are left out with a note: they say what was played, which the columns say too. `inputs`: columns that drove
    the robot, and the paths of the signals for which they stand, at most 1000 samples of each; forces are joined by
    straight lines, motions by a smooth curve, of degree 5 and sampled four times as fine where they have next to no
    noise. Nothing is compared in the first `skip` [s] of each recording. `start` and `shift` are those of recordings
    that say nothing else; a range of the shift is that of one shift of all. What only some recordings have is compared
    in these. Where each row is a shape at rest, columns set numbers too, and constants in the place of signals.

    Raises InputError that names file and column for what is missing, unknown, constant, in another unit or too short.
    """
    if not recordings:
        raise InputError("there is no recording.", field="recordings")
    files = [file_of(recording) for recording in recordings]
    stems = [Path(file).stem for file in files]
    names = stems if len({*stems}) == len(stems) else [f"{file} ({k})" for k, file in enumerate(files, start=1)]
    shared = start or {}, read_lateness(shift, SHIFT, SHIFT)
    there = {str(name) for recording in recordings for name in recording.data_vars}
    return [
        _trial(recording, name, description, compared, inputs, skip, there, *shared)
        for recording, name in zip(recordings, names, strict=True)
    ]


def _trial(
    recording: "xr.Dataset",
    name: str,
    description: RobotDescription,
    compared: Sequence[Compared],
    inputs: Mapping[str, str],
    skip: float,
    there: Collection[str],
    start: Mapping[str, Span],
    shift: Variable | float,
) -> RobotTrial:
    file = file_of(recording)
    if is_at_rest(recording, file):
        return _at_rest(recording, name, description, compared, inputs, file)
    time = time_of(recording, file)
    if time.size < _LEAST:
        raise InputError(f"has {count(time.size, 'row')}; at least {_LEAST} are needed.", file=file)
    time = time - time[0]
    driven, notes, cutoff = dict[str, Samples](), list[str](), cutoffs_of(recording)
    for column, path in inputs.items():
        if path in numeric_paths(description) or path in description.aliases:
            raise InputError("is a number: no recording can drive it. Name a signal.", file=file, field=path)
        try:
            driven[path], more = _driven(time, *_column(recording, column, file), cutoff.pop(column, None), column)
        except InputError as error:
            raise InputError(error.message, file=file, field=error.field) from None
        notes += more
    if cutoff:
        why = f"drives nothing here, which it would by --drive; there are {', '.join(inputs) or 'no columns that do'}."
        raise InputError(why, file=file, field=f"drives.{next(iter(cutoff))}")
    absent = {one.column for one in compared if one.column not in recording.data_vars and one.column in there}
    if len(absent) == len(compared):
        raise InputError(f"has none of {', '.join(sorted(absent))}: nothing is compared in it.", file=file)
    empty = np.full(time.shape, np.nan)
    measured = np.stack([empty if one.column in absent else _measured(recording, one, file) for one in compared])
    notes += [f"has no {column}" for column in sorted(absent)]
    own = own_of(recording)
    try:
        clocks = _clocks(recording, name, compared, inputs, shift, own)
        conditions = conditions_of(recording)
        if inputs:
            named = [k for k in conditions if not _has(description, k)]
            notes += [f"{k} is no quantity of {description.name}: it only names the recording" for k in named]
            conditions = {k: x for k, x in conditions.items() if k not in named}
        given = {str(name): Si(float(x), unit_of(x)) for name, x in conditions.items()}
        described = _without_names(apply_settings(description, given), inputs)
        late = {c for clock in clocks if (clock.shift, clock.drift) != (0, 0) for c in clock.columns}
        rows = ((c, one, row) for c, (one, row) in enumerate(zip(compared, measured, strict=True)))
        first = {one.reading.name: one.sign * float(row[0]) for c, one, row in rows if c not in late}
        described, starts, released = read_starts({**start, **own.start}, described, first, name)
        _check_not_driven(starts, driven)
        described = with_recordings(described, driven) if driven else described
    except InputError as error:
        raise InputError(error.message, file=file, field=error.field) from None
    measured[:, time < skip] = np.nan
    gaps = int(np.isnan(measured[:, time >= skip]).sum()) - len(absent) * int((time >= skip).sum())
    notes += [f"{gaps} values are missing and are not compared"] if gaps else []
    whole = RobotTrial(name, described, time, measured, tuple(notes), file, starts, released, driven=bool(driven))
    trial = whole.with_clocks(clocks)._replace(conditions=_sorted(recording))
    for one, row in zip(compared, trial.measured, strict=True):
        known = int(np.isfinite(row).sum())
        if known < _LEAST and one.column not in absent:
            words = f"has {count(known, 'value')} to compare; {_LEAST} at least are needed."
            raise InputError(words, file=file, field=one.column)
    return trial


def _clocks(
    recording: "xr.Dataset",
    name: str,
    compared: Sequence[Compared],
    inputs: Mapping[str, str],
    shift: Variable | float,
    own: Own,
) -> tuple[TrialClock, ...]:
    """Clocks of devices whose columns are compared, then the recording's own. Raises InputError for an unknown input's.

    `shift` is that of recordings without one.
    """
    devices = list[TrialClock]()
    for device, told in clocks_of(recording).items():
        named = f" of {name}" if told.own else ""
        given = ((what, getattr(told, what)) for what in (SHIFT, DRIFT))
        late = {what: read_lateness(x, what, f"{device}.{what}{named}") for what, x in given}
        clock = TrialClock(device, tuple(c for c, one in enumerate(compared) if one.column in told.columns), **late)
        driver = next((column for column in inputs if column in told.columns), None)
        if driver is not None and (clock.shift, clock.drift) != (0, 0):
            why = f"{driver} drives the robot, so that its clock is the one by which readings are late"
            raise InputError(f"{why}. Give shift and drift of their clocks.", field=f"clocks.{device}")
        devices += [clock] if clock.columns else []
    given = (shift if own.shift is None else own.shift), own.drift
    late = [
        one if isinstance(one, Variable) else read_lateness(one, what, f"{what} of {name}")
        for what, one in zip((SHIFT, DRIFT), given, strict=True)
    ]
    return (*devices, TrialClock("", tuple(range(len(compared))), *late))


def _at_rest(
    recording: "xr.Dataset",
    name: str,
    description: RobotDescription,
    compared: Sequence[Compared],
    inputs: Mapping[str, str],
    file: str,
) -> RobotTrial:
    if own_of(recording).is_said:
        why = "has a start or a shift, and its rows are shapes at rest, which have neither. Leave both out."
        raise InputError(why, file=file)
    described, rows = set_rows(recording, file, description, inputs)
    columns = [(one.column, one.reading.name, one.reading.unit) for one in compared]
    measured, notes = read_rows(recording, file, columns)
    nowhen = np.full(measured.shape[1], np.nan)
    same = _sorted(recording)
    return RobotTrial(name, described, nowhen, measured, notes, file, conditions=same, rows=rows)


def _sorted(recording: "xr.Dataset") -> tuple[tuple[str, float], ...]:
    """Conditions of a recording by name [SI]."""
    return tuple(sorted((str(name), float(value)) for name, value in conditions_of(recording).items()))


def _check_not_driven(starts: Sequence[RobotStart], driven: Mapping[str, Samples]) -> None:
    """Raise InputError for a start that a column says."""
    for path in (path for one in starts for path in one.paths):
        column = next((signal for signal in driven if path.startswith(f"{signal}.")), None)
        if column is not None:
            raise InputError(f"{path} is driven by a column, whose first value it starts with.", field="start")


def _has(description: RobotDescription, name: str) -> bool:
    """Whether a robot has a quantity of this name."""
    try:
        resolve(description, name)
    except InputError:
        return False
    return True


def _without_names(description: RobotDescription, inputs: Mapping[str, str]) -> RobotDescription:
    """A robot without short names for what columns stand for."""
    gone = tuple(f"{path}." for path in inputs.values())
    aliases = {name: tuple(p for p in paths if not p.startswith(gone)) for name, paths in description.aliases.items()}
    return description.model_copy(update={"aliases": {name: paths for name, paths in aliases.items() if paths}})


def _driven(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], unit: str, cutoff: float | None, column: str
) -> tuple[Samples, list[str]]:
    """Samples of a signal, smoothed at a cut-off [Hz] where there is one, or within the steps of an encoder, and notes.

    Raises InputError for a cut-off that is out of range, or takes off much more than noise.
    """
    known, at = np.isfinite(values), time if time.size <= _KNOTS else np.linspace(0.0, time[-1], _KNOTS)
    t, y = time[known], values[known]
    parts = _FINER if time.size <= _KNOTS else 1
    finer = np.interp(np.linspace(0, at.size - 1, parts * (at.size - 1) + 1), np.arange(at.size), at)
    moves = unit in _MOTIONS and y.size >= _LEAST
    step = resolution(y) if moves else 0.0
    noise = ROUNDED * step if step else noise_of(t, y) if y.size >= _LEAST else 0.0
    notes, how = list[str](), f"drives: {{{column}: {{smooth: %.2g Hz}}}} in the campaign"
    if cutoff is not None:
        notes.append(f"{column}: {_eaten(t, y, cutoff, noise, f'drives.{column}.smooth')}")
    elif step:
        passed = min(round(float(np.abs(np.diff(y)).sum()) / step), y.size)  # steps: errors within one are correlated
        cutoff, coarse = cutoff_of(t, y, noise, passed), show_quantity(step, dimension_of(unit))
        why = f"read in steps of {coarse}, too coarse for accelerations: smoothed at {cutoff:.2g} Hz, within the steps"
        notes.append(f"{column}: {why}. Another cut-off: {how % cutoff}")
    elif moves and (share := roughness(y, noise)) > FELT:
        size = f"noise of {show_quantity(noise, dimension_of(unit))} makes {100 * share:.0f} % of its accelerations"
        notes.append(f"{column}: {size}, and {SLOW}. {how % cutoff_of(t, y, noise)} smooths it")
    if cutoff is not None:
        smooth = smoothing_spline(t, y, cutoff)(np.clip(finer, t[0], t[-1]))
        return Samples(finer.tolist(), smooth.tolist(), unit), notes
    if moves and known.all() and parts > 1 and roughness(y, noise) < _CLEAN:
        return Samples(finer.tolist(), make_interp_spline(t, y, k=5)(finer).tolist(), unit), notes
    knots = np.interp(at, t, y)
    left_out = float(np.abs(np.interp(t, at, knots) - y).max() / (np.ptp(y) or 1.0))
    if left_out > _ROUGH:
        share = f"{100 * left_out:.2g} % of its range"
        notes.append(f"{column}: {_KNOTS} samples drive the robot, which leave out {share}")
    return Samples(at.tolist(), knots.tolist(), unit), notes


def _eaten(t: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], cutoff: float, noise: float, field: str) -> str:
    """What a cut-off takes off, in words. Raises InputError."""
    least, most = cutoffs(t)
    if not least <= cutoff <= most:
        raise InputError(f"is {cutoff:g} Hz; samples at these times allow {least:.2g} to {most:.4g} Hz.", field=field)
    lost, whole = float(np.mean((smoothing_spline(t, y, cutoff)(t) - y) ** 2)), float(np.var(y))
    share = f"which takes off {100 * lost / whole:.2g} % of its variance"
    if lost <= max(_NOISE * noise**2, _EATEN[0] * whole):
        return f"smoothed at {cutoff:g} Hz, {share}"
    enough = cutoff_of(t, y, max(noise, (_EATEN[0] * whole) ** 0.5))
    other = f"signal is lost, not noise alone. Take {enough:.2g} Hz or more"
    if lost > _EATEN[1] * whole:
        raise InputError(f"is {cutoff:g} Hz, {share}: {other}.", field=field)
    return f"smoothed at {cutoff:g} Hz, {share}: {other}"


def _measured(recording: "xr.Dataset", one: Compared, file: str) -> Float[np.ndarray, "n"]:
    values, given = _column(recording, one.column, file)
    check_unit(given, one.column, one.reading.name, one.reading.unit, file)
    if one.reading.turns:
        known = np.isfinite(values)
        values[known] = np.unwrap(values[known])
    return values


def _column(recording: "xr.Dataset", column: str, file: str) -> tuple[Float[np.ndarray, "n"], str]:
    """Values and SI unit of a column. Raises InputError for one that is missing, empty or the same all the time."""
    values, unit = column_of(recording, column, file)
    known = values[np.isfinite(values)]
    if known.size < 2:
        what = "has 1 value" if known.size else "has no values"
        raise InputError(f"{what}: nothing can be identified from it.", file=file, field=column)
    check_varies(known, file, column)
    return values, unit
