"""A soft actuator from a campaign of pressures and displacements: recordings at even times, from rest, unbroken."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome._renamed import former
from nectosome.drives import respond
from nectosome.io.results import Contents, check_contents
from nectosome.measure.labels import file_of
from nectosome.measure.signals.requirements import is_even
from nectosome.measure.signals.resample import default_gap, unbroken
from nectosome.units import InputError, count

from ..fits.errors import held_out_warning, range_errors
from ..recordings import (
    CampaignLike,
    beside_recordings,
    check_units,
    check_varies,
    fitted_and_test,
    recordings_of,
    time_of,
)
from .fit import HIGHEST, Identified, fit_hysteresis
from .trials import DEAD_TIME, PressureTrial

if TYPE_CHECKING:
    import xarray as xr


_UNITS = {"pressure": "Pa", "displacement": "m"}
_REST = 0.1  # of the range of the displacement: as far from 0 it does not begin at rest
_LEAST = 50  # samples
_HELD = "clocks.held"  # the clock of commands in a campaign of `rig run`: half a sample later, as they act on the mean


class HysteresisFit(NamedTuple):
    """A soft actuator, fitted to recordings."""

    found: Identified
    recordings: tuple[PressureTrial, ...]  # that were fitted
    test: tuple[PressureTrial, ...] = ()  # and those that are predicted only

    def to_dataset(self) -> "xr.Dataset":
        """Parameters, and the model beside the recordings.

        - over `parameter` (frequency, damping, zeros, dead time and what of the valve was fitted, slopes; `unit`):
          `value`, and the 95 % interval, `low` to `high`; `threshold` [Pa] of the play that a slope begins with, 0 for
          the first and for what is no slope.
        - over `recording` (its name; `used` says train or test): `e_rmsp`, `e_mp` [percent of its range].
        - over `sample`, recording by recording (`of` is its place): `time`, `pressure`, `measured`, `computed`.

        Attributes: `order` of the transfer function, `noise` [m], and `warnings` as JSON.
        """
        found, recordings = self.found, [*self.recordings, *self.test]
        block = found.block()
        slew = found.theta.get("slew", np.inf)
        computed = [np.asarray(respond(block, one.joined(slew), one.dt)) for one in recordings]
        errors = np.array([range_errors(y, one.displacement) for y, one in zip(computed, recordings, strict=True)])
        samples = {
            "time": ([one.dt * np.arange(len(one.pressure)) for one in recordings], "s"),
            "pressure": ([one.pressure for one in recordings], "Pa"),
            "measured": ([one.displacement for one in recordings], "m"),
            "computed": (computed, "m"),
        }
        held = zip(self.test, computed[len(self.recordings) :], strict=True)
        far = held_out_warning((f"displacement of {one.name}", y, one.displacement, found.noise) for one, y in held)
        plays = np.concatenate([np.zeros(len(found.theta) + 1), found.thresholds])
        units = {name: _unit_of(name) for name in found.intervals}
        data = beside_recordings(units, self.recordings, self.test, samples)
        return data.assign(
            value=("parameter", np.array([*found.theta.values(), *found.slopes])),
            low=("parameter", [one.low for one in found.intervals.values()]),
            high=("parameter", [one.high for one in found.intervals.values()]),
            threshold=("parameter", plays, {"units": "Pa"}),
            e_rmsp=("recording", errors[:, 0], {"units": "percent"}),
            e_mp=("recording", errors[:, 1], {"units": "percent"}),
        ).assign_attrs(order=found.order, noise=found.noise, warnings=json.dumps([*found.warnings, *far]))


def identify_hysteresis(
    campaign: CampaignLike,
    *,
    order: int = 2,
    zeros: int = 0,
    slew: bool = False,
    dead_band: bool = False,
    resolution: bool = False,
    dead_time: bool = False,
    test: Iterable[str] = (),
) -> HysteresisFit:
    """Find hysteresis and dynamics of a soft actuator from its `pressure` [Pa] and `displacement` [m].

    - campaign: as `recordings_of` takes it; `test`: file names of recordings that are predicted, not fitted.
    - order, zeros, slew, dead_band, resolution, dead_time: as in `fit_hysteresis`.

    Raises InputError as `pressure_recordings` and `fit_hysteresis` do.
    """
    recordings = pressure_recordings(recordings_of(campaign, _UNITS))
    fitted, held = fitted_and_test(recordings, test)
    found = fit_hysteresis(
        fitted, order, slew, zeros=zeros, dead_band=dead_band, resolution=resolution, dead_time=dead_time
    )
    return HysteresisFit(found, tuple(fitted), tuple(held))


def pressure_recordings(recordings: "Sequence[xr.Dataset]") -> list[PressureTrial]:
    """Trials of files that have a `pressure` [Pa] and a `displacement` [m].

    Times that are not even are made so. What follows a gap is left out, since hysteresis remembers what came in it.
    Raises InputError that names file and column for what is missing, constant, swapped or in another unit, for a
    displacement that does not begin near 0, and where too little is left.
    """
    found = [_recording(recording) for recording in recordings]
    if not found:
        raise InputError("there is no recording.", field="recordings")
    return found


def _recording(recording: "xr.Dataset") -> PressureTrial:
    file = file_of(recording)
    time, columns = _columns(file, recording)
    known = np.all([np.isfinite(x) for x in columns.values()], axis=0)
    if known.sum() < _LEAST:
        raise InputError(f"has {count(int(known.sum()), 'sample')} of both; {_LEAST} at least are needed.", file=file)
    gap = default_gap(time[known])
    first = unbroken(time, known, gap)[0]
    whole = time[np.argmax(known)] - time[0] <= gap  # a column with a clock of its own may begin a little later
    kept = np.flatnonzero(known)[: first.stop - first.start] if whole else np.zeros(0, int)
    if kept.size < _LEAST:
        raise InputError(
            f"has {count(kept.size, 'sample')} before its first gap; {_LEAST} at least are needed, since hysteresis "
            "remembers what came in the gap.",
            file=file,
        )
    notes = list[str]()
    if kept.size < time.size:
        notes.append(f"{time.size - kept.size} of {time.size} samples left out, from the first gap on")
    time, columns = time[kept], {name: x[kept] for name, x in columns.items()}
    step = float(np.mean(np.diff(time)))
    if not is_even(time):
        step = float(np.median(np.diff(time)))
        even = np.arange(time[0], time[-1] + 1e-9 * step, step)
        columns = {name: np.interp(even, time, x) for name, x in columns.items()}
        notes.append(f"put on even steps of {step:.4g} s")
    for name, x in columns.items():
        check_varies(x, file, name)
    first_value, width = float(columns["displacement"][0]), float(np.ptp(columns["displacement"]))
    if abs(first_value) > _REST * width:
        raise InputError(
            f"begins at {first_value:.4g} m, of a range of {width:.4g} m. It must begin at rest, near 0: give its zero "
            "in the campaign, as in columns: {displacement: {zero: ...}}.",
            file=file,
            field="displacement",
        )
    held = recording["pressure"].attrs.get("clock") == _HELD
    return PressureTrial(Path(file).stem, step, **columns, notes=tuple(notes), file=file, held=held)


def _columns(file: str, recording: "xr.Dataset") -> tuple[Float[np.ndarray, "n"], dict[str, Float[np.ndarray, "n"]]]:
    """Times, and both columns in SI units."""
    time = time_of(recording, file)
    for name in _UNITS:
        if name not in recording.data_vars:
            there = ", ".join(map(str, recording.data_vars))
            how = f"Name the column in the campaign, as in columns: {{{name}: {{column: ..., unit: ...}}}}"
            raise InputError(f"is missing; there are {there}. {how}.", file=file, field=name)
    check_units(recording, file, _UNITS, ("pressure", "displacement"))
    return time, {name: recording[name].values.astype(float) for name in _UNITS}


_SAVED = Contents(
    "a model that `nectosome identify hysteresis --save` wrote",
    dict.fromkeys(("value", "low", "high", "threshold"), ("parameter",)),
    finite=("value", "threshold"),
    names=("parameter",),
    counts=("order",),
    numbers=("noise",),
    encoded={"warnings": list},
)


def saved_model(data: "xr.Dataset", source: str = "") -> Identified:
    """The model of a dataset of `HysteresisFit`; its intervals stay there. `source` names the file that it is of.

    Raises InputError for data of another kind.
    """
    check_contents(data, _SAVED, source)

    def need(fits: object, what: str) -> None:
        if not fits:
            raise InputError(f"this is not {_SAVED.kind}: {what}.", file=source)

    names = [str(name) for name in data["parameter"].values]
    slopes = np.array([name.startswith("slope") for name in names], bool)
    value, thresholds = data["value"].values, data["threshold"].values[slopes][1:]
    theta = {name: float(x) for name, x, is_slope in zip(names, value, slopes, strict=True) if not is_slope}
    noise, order = float(data.attrs.get("noise", np.nan)), int(data.attrs.get("order", 0))
    need(all(name.rstrip("0123456789") in _PARAMETER_UNITS for name in names), "its parameters are not known here")
    need(slopes.sum() > 1, "it has no slopes")
    need((np.diff(thresholds, prepend=0.0) > 0).all(), "its threshold does not grow from above 0")
    need(0 <= noise < np.inf, "its noise is missing")
    zeros = sum(name.startswith("zero") for name in theta)
    need(1 <= order <= HIGHEST and zeros < order, f"its order is not from 1 to {HIGHEST}")
    need(
        sum(name.startswith(("frequency", "damping")) for name in theta) == order, "its order is not that of its parts"
    )
    need(
        all(x > 0 or (x == 0 and name == DEAD_TIME) for name, x in theta.items() if not name.startswith("zero")),
        "a parameter is not positive",
    )
    warnings = tuple(map(str, json.loads(data.attrs["warnings"])))
    return Identified(theta, {}, thresholds, value[slopes], noise, order, warnings)


# of parameters: scale and unit by the unit in SI
BENCH_UNITS = {"m/Pa": (1e8, "mm/bar"), "Pa/s": (1e-5, "bar/s"), "Pa": (1e-5, "bar")}
BENCH_UNITS |= {unit: (1.0, unit) for unit in ("", "rad/s", "s", *(f"s{k}" for k in range(2, HIGHEST)))}
_PARAMETER_UNITS = {"frequency": "rad/s", "damping": "", "slew": "Pa/s", "slope": "m/Pa", "zero": "s", DEAD_TIME: "s"}
_PARAMETER_UNITS |= dict.fromkeys(("dead_band", "resolution"), "Pa")


def _unit_of(name: str) -> str:
    """SI unit of a parameter; the k-th coefficient of the zeros has s^k."""
    kind = name.rstrip("0123456789")
    return _PARAMETER_UNITS[kind] + (name.removeprefix(kind) if kind == "zero" and name != "zero1" else "")


__getattr__ = former(__name__)
