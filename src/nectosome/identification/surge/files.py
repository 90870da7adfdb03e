"""Added mass and drag from a campaign of speeds and thrusts: recordings paired, on one clock, in unbroken stretches."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import savgol_filter

from nectosome._renamed import former
from nectosome.measure.labels import conditions_of, file_of
from nectosome.measure.signals.requirements import is_even
from nectosome.measure.signals.resample import default_gap, unbroken
from nectosome.units import InputError, count, did_you_mean

from ..fits.errors import deviation
from ..recordings import (
    CampaignLike,
    beside_recordings,
    check_units,
    check_varies,
    fitted_and_test,
    recordings_of,
    time_of,
)
from .estimators import METHODS, Surge, SurgeRecording, fit_surge

if TYPE_CHECKING:
    import xarray as xr


_UNITS = {"speed": "m/s", "position": "m", "thrust": "N", "crank": "rad"}
_PARAMETER_UNITS = {"added_mass": "kg", "drag": "kg/m", "alpha": "1/m", "gamma": "1/kg"}
_SHIFT = "shift"  # the condition by how much a file's own clock is ahead
_LEAST = 20  # samples of a stretch
_WINDOW, _ORDER = 11, 3  # samples and order of the filter on positions


class _Signal(NamedTuple):
    """One quantity without what is missing."""

    file: str
    time: Float[np.ndarray, "n"]
    values: Float[np.ndarray, "n"]


class SurgeFit(NamedTuple):
    """Added mass and drag of a body, fitted to recordings."""

    found: Surge
    recordings: tuple[SurgeRecording, ...]  # that were fitted
    test: tuple[SurgeRecording, ...] = ()  # and those that are predicted only

    def to_dataset(self) -> "xr.Dataset":
        """Parameters, and the model beside the recordings.

        - over `parameter` (added_mass, drag, and alpha, gamma of the linear model; `unit`): `value`, `error`,
          `percent`, and the 95 % interval, `low` to `high`.
        - over `recording` (its name; `used` says train or test): `deviation_mean`, `deviation_std`, `deviation_largest`
          [percent of the root mean square of the measured speed].
        - over `sample`, recording by recording (`of` is its place): `time`, `measured`, `computed`, `thrust`.

        Attributes: `method`, `mass`, and `warnings` as JSON.
        """
        parts = self.found.physical, self.found.rate
        values, errors, percent = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("values", "errors", "percent")
        )
        low, high = np.concatenate([part.interval() for part in parts]).T
        over = {"value": values, "error": errors, "percent": percent, "low": low, "high": high}
        recordings = [*self.recordings, *self.test]
        computed = [self.found.speed(recording) for recording in recordings]
        deviations = np.array([deviation(r.speed, v) for r, v in zip(recordings, computed, strict=True)])
        names = ("deviation_mean", "deviation_std", "deviation_largest")
        samples = {
            "time": ([r.time for r in recordings], "s"),
            "measured": ([r.speed for r in recordings], "m/s"),
            "computed": (computed, "m/s"),
            "thrust": ([r.trial.inputs[0](r.time) for r in recordings], "N"),
        }
        data = beside_recordings(_PARAMETER_UNITS, self.recordings, self.test, samples)
        return data.assign(
            {name: ("parameter", x) for name, x in over.items()}
            | {name: ("recording", x, {"units": "percent"}) for name, x in zip(names, deviations.T, strict=True)}
        ).assign_attrs(method=self.found.method, mass=self.found.mass, warnings=json.dumps(self.found.warnings))


def identify_surge(
    campaign: CampaignLike,
    mass: float,
    *,
    method: str = "output_error",
    smooth: float | None = None,
    test: Iterable[str] = (),
) -> SurgeFit:
    """Find added mass and drag of a body of known mass [kg] from its `speed` [m/s] and `thrust` [N].

    - campaign: as `recordings_of` takes it; `test`: file names of speeds that are predicted, not fitted.
    - method, smooth: as in `fit_surge`.

    Raises InputError as `surge_recordings` and `fit_surge` do.
    """
    if method not in METHODS:
        raise InputError(f'"{method}" is no method.{did_you_mean(method, METHODS)}', field="method")
    recordings = surge_recordings(recordings_of(campaign, _UNITS))
    fitted, held = fitted_and_test(recordings, test)
    return SurgeFit(fit_surge(fitted, mass, method, smooth), tuple(fitted), tuple(held))


def surge_recordings(recordings: "Sequence[xr.Dataset]") -> list[SurgeRecording]:
    """Pairs of `speed` [m/s] and `thrust` [N], each in one file or in two of the same conditions.

    Where there is a `position` [m] instead, position and thrust go through the same Savitzky-Golay filter, over 11
    samples of the position, and the speed is the derivative of the spline through the result. Files have one clock,
    unless both have the angle `crank` [rad], by which the thrust is then put where the crank was as far, or a condition
    `shift` [s], which is taken off the file's time. Only what both signals cover is taken, in stretches without gaps;
    times that are not even are made so. Each recording's `notes` say what was done.

    Raises InputError that names file and column for what is missing, constant, swapped or in another unit, and where
    nothing is left.
    """
    files = {file_of(recording): recording for recording in recordings}
    for file, recording in files.items():
        _check(file, recording)
    both = [file for file, recording in files.items() if _moves(recording) and "thrust" in recording.data_vars]
    thrusts = [file for file in files if file not in both and "thrust" in files[file].data_vars]
    found, used = list[SurgeRecording](), set[str]()
    for file, recording in files.items():
        if not _moves(recording):
            continue
        other = file if file in both else _partner(file, recording, {name: files[name] for name in thrusts})
        used.add(other)
        found += _stretches(file, recording, other, files[other])
    if not found:
        raise InputError("there is no recording of a speed.", field="recordings")
    idle = [file for file in thrusts if file not in used]
    if idle:
        note = f"not used, since no speed was recorded at its conditions: {', '.join(idle)}"
        found[0] = found[0]._replace(notes=(*found[0].notes, note))
    return found


def _moves(recording: "xr.Dataset") -> str:
    """Name of the column with the body's motion, empty where there is none."""
    return next((name for name in ("speed", "position") if name in recording.data_vars), "")


def _check(file: str, recording: "xr.Dataset") -> None:
    """Raise InputError where a recording is not what it should be."""
    names = [name for name in _UNITS if name in recording.data_vars]
    if not {"speed", "position", "thrust"} & set(names):
        there = ", ".join(map(str, recording.data_vars))
        how = "Name the columns in the campaign, as in columns: {speed: {column: v, unit: m/s}}"
        raise InputError(f"has no speed, position or thrust, but {there}. {how}.", file=file)
    time_of(recording, file)
    check_units(recording, file, _UNITS, ("speed", "thrust"))
    for name in names:
        check_varies(_signal(file, recording, name).values, file, name)


def _signal(file: str, recording: "xr.Dataset", name: str) -> _Signal:
    """A column where it has values, on the clock that all files share."""
    time, values = recording["time"].values.astype(float), recording[name].values.astype(float)
    known = np.isfinite(values)
    there = int(known.sum())
    if there < _LEAST:
        raise InputError(f"has {count(there, 'value')}; {_LEAST} at least are needed.", file=file, field=name)
    later = 0.0
    if _SHIFT in recording.coords:
        shift = recording.coords[_SHIFT]
        if shift.attrs.get("units") != "s":
            raise InputError('is no time, as in "0.12 s".', file=file, field=_SHIFT)
        later = float(shift)
    return _Signal(file, time[known] - later, values[known])


def _partner(file: str, recording: "xr.Dataset", thrusts: "Mapping[str, xr.Dataset]") -> str:
    """The file with the thrust at the conditions of a speed."""
    same = [name for name, other in thrusts.items() if _conditions(other) == _conditions(recording)]
    if not same:
        where = ", ".join(f"{name} {value:g} {unit}".strip() for name, value, unit in _conditions(recording))
        at = f" at {where}" if where else ""
        raise InputError(f"has no thrust, and no other file has one{at}.", file=file, field="thrust")
    if len(same) > 1:
        raise InputError(f"is in several files of the same conditions: {', '.join(same)}. Keep one.", field="thrust")
    return same[0]


def _conditions(recording: "xr.Dataset") -> list[tuple[str, float, str]]:
    given = conditions_of(recording).items()
    rows = ((name, float(f"{float(x):.9g}"), str(x.attrs.get("units", ""))) for name, x in given if name != _SHIFT)
    return sorted(rows)


def _stretches(file: str, recording: "xr.Dataset", other: str, force: "xr.Dataset") -> list[SurgeRecording]:
    """What speed and thrust have in common, without gaps."""
    moves, notes = _moves(recording), list[str]()
    speed, thrust = _signal(file, recording, moves), _signal(other, force, "thrust")
    if other != file:
        thrust, said = _on_clock(recording, force, speed, thrust)
        notes.append(said)
    thrust_parts = _unbroken(thrust)
    parts = list[tuple[_Signal, _Signal]]()
    for part in _unbroken(speed):
        for push in thrust_parts:
            inside = (part.time >= push.time[0]) & (part.time <= push.time[-1])
            if inside.sum() >= _LEAST and push.time.size >= _LEAST:
                parts.append((part._replace(time=part.time[inside], values=part.values[inside]), push))
    if not parts:
        a, b = (f"{x.time[0]:.4g} s to {x.time[-1]:.4g} s" for x in (speed, thrust))
        raise InputError(
            f"its {moves} ({a}) and the thrust of {other} ({b}) have no {_LEAST} samples in common. Give the condition "
            f"{_SHIFT}, or record the crank angle in both.",
            file=file,
        )
    left_out = speed.time.size - sum(part.time.size for part, _ in parts)
    if left_out:
        where = "where the thrust is not known or gaps are near"
        notes.append(f"{left_out} of {speed.time.size} samples left out, {where}")
    out, stem = [], Path(file).stem
    for k, (part, push) in enumerate(parts, start=1):
        part, said = _even(part)
        own = [*(notes if k == 1 else ()), *said]
        if moves == "position":
            part, push = _differentiated(part, push)
            own.append(f"speed from positions smoothed over {_WINDOW} samples, the thrust alike")
        name = stem if len(parts) == 1 else f"{stem}, part {k}"
        out.append(SurgeRecording(name, *part[1:], *push[1:], other != file, tuple(own), file))
    return out


def _differentiated(part: _Signal, push: _Signal) -> tuple[_Signal, _Signal]:
    """Speed from even positions, and the thrust behind the same filter."""
    window = _WINDOW * float(np.mean(np.diff(part.time)))
    push, _ = _even(push)
    samples = 2 * round((window / float(np.mean(np.diff(push.time))) - 1) / 2) + 1
    smooth = savgol_filter(part.values, _WINDOW, _ORDER)
    speed = CubicSpline(part.time, smooth).derivative()(part.time)
    if samples > _ORDER + 1:
        push = push._replace(values=np.asarray(savgol_filter(push.values, samples, _ORDER)))
    return part._replace(values=speed), push


def _on_clock(recording: "xr.Dataset", force: "xr.Dataset", speed: _Signal, thrust: _Signal) -> tuple[_Signal, str]:
    """The thrust at the times when the crank of the swimming robot was as far, or as it is; and what was done."""
    if not all("crank" in one.data_vars for one in (recording, force)):
        shifted = _SHIFT in {*recording.coords, *force.coords}
        how = "shifted as the campaign says" if shifted else "taken to be on the same clock"
        return thrust, f"thrust of {thrust.file}, {how}"
    swims, holds = (_turning(_signal(x.file, of, "crank")) for x, of in ((speed, recording), (thrust, force)))
    angle = np.interp(thrust.time, holds.time, holds.values)
    angle = angle + 2 * np.pi * np.floor((swims.values[0] - angle[0]) / (2 * np.pi))
    inside = (angle >= swims.values[0]) & (angle <= swims.values[-1])
    time = np.interp(angle[inside], swims.values, swims.time)
    said = f"thrust of {thrust.file}, put by the crank angle where it belongs"
    return thrust._replace(time=time, values=thrust.values[inside]), said


def _turning(crank: _Signal) -> _Signal:
    """A crank angle without jumps at whole turns. Raises InputError where it does not turn on."""
    angle = np.unwrap(crank.values)
    angle = angle if angle[-1] > angle[0] else -angle
    if not np.all(np.diff(angle) > 0):
        at = float(crank.time[int(np.argmin(np.diff(angle)))])
        raise InputError(f"stands still or turns back at {at:.4g} s. Smooth or cut it.", file=crank.file, field="crank")
    return crank._replace(values=angle)


def _unbroken(signal: _Signal) -> list[_Signal]:
    parts = unbroken(signal.time, np.ones(signal.time.size, bool), default_gap(signal.time))
    return [signal._replace(time=signal.time[part], values=signal.values[part]) for part in parts]


def _even(signal: _Signal) -> tuple[_Signal, tuple[str, ...]]:
    """A signal at even steps, and what was done."""
    if is_even(signal.time):
        return signal, ()
    step = float(np.median(np.diff(signal.time)))
    even = np.linspace(signal.time[0], signal.time[-1], round(np.ptp(signal.time) / step) + 1)
    values = np.interp(even, signal.time, signal.values)
    return signal._replace(time=even, values=values), (f"interpolated to even steps of {step:.4g} s",)


__getattr__ = former(__name__)
