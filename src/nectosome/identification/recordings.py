"""Recordings that fits take: those of a campaign, datasets, or arrays; which are only predicted; models beside them."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np
from jaxtyping import Float

from nectosome.measure import load_campaign
from nectosome.measure.campaign import Campaign
from nectosome.measure.labels import unit_of
from nectosome.units import InputError, did_you_mean, kind_of, read_positive, unit_to_si

if TYPE_CHECKING:
    import xarray as xr

_OWN = "start", "shift", "drift", "clocks", "drives"  # attributes of a recording, as JSON
CampaignLike = str | Path | Campaign | Iterable["xr.Dataset | Mapping[str, Any]"]


class FittedTrial(Protocol):
    """A recording, or a part of one, as it is fitted."""

    @property
    def name(self) -> str:
        """Its name on pages."""
        ...

    @property
    def file(self) -> str:
        """Name of its file."""
        ...


_T = TypeVar("_T", bound=FittedTrial)


def recordings_of(campaign: CampaignLike, units: Mapping[str, str] | None = None) -> "list[xr.Dataset]":
    """Recordings of a campaign, of a campaign file, or given one by one, as datasets or as arrays by name.

    Arrays are `{"time": t, "angle": y, ...}`: each an array, or a pair of an array and its unit. An array without a
    unit is in SI; its unit is that of `units`. A single number with its unit is a condition. `start`, `shift` and
    `drift` are as in a campaign, and so are `drives`: `{"angle": {"smooth": "8 Hz"}}`; `clocks` are those of devices,
    with their columns: `{"camera": {"columns": ["tip"], "shift": "-30..30 ms"}}`. The time is None where each row is a
    shape at rest. The k-th recording of arrays is called `recording k`. Raises InputError for files that cannot be
    read, and for arrays without a time or of another length than it.
    """
    if isinstance(campaign, str | Path):
        campaign = load_campaign(campaign)
    if isinstance(campaign, Campaign):
        return campaign.recordings()
    import xarray as xr

    if isinstance(campaign, xr.Dataset | Mapping) or not isinstance(campaign, Iterable):
        raise InputError(
            f"{kind_of(campaign)} is given where a campaign is expected: a file, or a list of recordings.",
            field="campaign",
        )
    each = enumerate(campaign, start=1)
    return [one if isinstance(one, xr.Dataset) else _of_arrays(one, f"recording {k}", units or {}) for k, one in each]


def _of_arrays(arrays: Mapping[str, Any], name: str, units: Mapping[str, str]) -> "xr.Dataset":
    import xarray as xr

    if "time" not in arrays:
        why = f"has no time, but {', '.join(arrays)}. It is None where each row is a shape at rest."
        raise InputError(why, file=name)
    along = "row" if arrays["time"] is None else "time"
    found: dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]] = {}
    own = {key: arrays[key] for key in _OWN if isinstance(arrays.get(key), str | Mapping)}
    for key, given in arrays.items():
        if key in own or (key == "time" and given is None):
            continue
        values, unit = given if isinstance(given, tuple) and isinstance(given[-1], str) else (given, units.get(key, ""))
        try:
            factor, si = unit_to_si("s" if key == "time" and not unit else unit)
        except ValueError as error:
            raise InputError(f"its unit {error}.", file=name, field=key) from None
        values = factor * np.asarray(values, dtype=float)
        found[key] = ((along,) if values.ndim else (), values, {"units": si})
    samples = next((values.size for key, (dims, values, _) in found.items() if dims and along in ("row", key)), 0)
    if along == "row":
        found["row"] = (("row",), np.arange(samples, dtype=float), {"units": "1"})
    for key, (dims, values, _) in found.items():
        if dims and values.shape != (samples,):
            raise InputError(f"has the shape {values.shape}, and there are {samples} {along}s.", file=name, field=key)
    numbers = {key for key, (dims, *_) in found.items() if not dims}
    data = {key: one for key, one in found.items() if key not in numbers | {along}}
    coords = {key: found[key] for key in (along, *numbers)}
    about = {"file": name, "repairs": [], "warnings": []}
    told = {key: json.dumps(dict(one) if isinstance(one, Mapping) else one) for key, one in own.items()}
    return xr.Dataset(data, coords, {"provenance": json.dumps(about), **told})


class Own(NamedTuple):
    """What a recording says of the robot's start in it, and of its own clock."""

    start: Mapping[str, Any]
    shift: Any = None  # of its readings beside the robot and its inputs
    drift: Any = 0.0

    @property
    def is_said(self) -> bool:
        """Whether it says any of it."""
        return bool(self.start) or self.shift is not None or self.drift != 0


class ColumnsClock(NamedTuple):
    """What a recording says of the clock of some of its columns."""

    columns: tuple[str, ...]
    shift: Any = 0.0  # later than the recording's clock
    drift: Any = 0.0
    own: bool = True  # whether what is unknown of it is this recording's, and not one of all


def own_of(recording: "xr.Dataset") -> Own:
    """What a recording says of the robot's `start` in it, and of its own clock."""
    start, shift, drift = (json.loads(recording.attrs.get(key, "null")) for key in ("start", "shift", "drift"))
    return Own(start or {}, shift, 0.0 if drift is None else drift)


def clocks_of(recording: "xr.Dataset") -> dict[str, ColumnsClock]:
    """Clocks of devices in a recording, by name. Raises InputError for fields that there are none of."""
    told, shared = (json.loads(recording.attrs.get(key, "null")) for key in ("clocks", "shared_clocks"))
    for name, fields in (told or {}).items():
        other = next((field for field in fields if field not in ("columns", "shift", "drift")), None)
        if other is not None:
            why = "is no field of a clock here. There are columns, shift and drift."
            raise InputError(why, field=f"clocks.{name}.{other}")
    made = {name: ColumnsClock(**{"columns": ()} | fields, own=not shared) for name, fields in (told or {}).items()}
    return {name: one._replace(columns=tuple(one.columns)) for name, one in made.items()}


def cutoffs_of(recording: "xr.Dataset") -> dict[str, float]:
    """Cut-offs of columns that drive a robot [Hz]. Raises InputError for fields that there are none of."""
    out = dict[str, float]()
    for column, fields in json.loads(recording.attrs.get("drives", "{}")).items():
        for field, value in fields.items():
            name = f"drives.{column}.{field}"
            if field != "smooth":
                raise InputError("is no field of a drive here. There is smooth.", field=name)
            out[column] = read_positive(value if isinstance(value, str) else f"{value} Hz", "frequency", name)
    return out


def fitted_and_test(recordings: Sequence[_T], test: Iterable[str]) -> tuple[list[_T], list[_T]]:
    """Recordings to fit, and those of the files named in `test`, which are predicted only.

    Raises InputError for a name that no recording has, and where nothing is left to fit.
    """
    names, files = [test] if isinstance(test, str) else [*test], [one.file for one in recordings]
    for name in names:
        if name not in files:
            raise InputError(f'"{name}" is no recording here.{did_you_mean(name, files)}', field="test")
    fitted = [one for one in recordings if one.file not in names]
    if not fitted:
        raise InputError("all recordings are named: none is left to fit.", field="test")
    return fitted, [one for one in recordings if one.file in names]


def time_of(recording: "xr.Dataset", file: str) -> Float[np.ndarray, "n"]:
    """Times of a recording [s]. Raises InputError where it has none."""
    if "time" not in recording.dims:
        raise InputError("has no time. Say in the campaign which column it is, or its rate.", file=file)
    return recording["time"].values.astype(float)


def column_of(recording: "xr.Dataset", column: str, file: str) -> tuple[Float[np.ndarray, "n"], str]:
    """Values and SI unit of a column. Raises InputError where there is none of this name."""
    if column not in recording.data_vars:
        there = [str(name) for name in recording.data_vars]
        words = f"is missing; there are {', '.join(there)}.{did_you_mean(column, there)}"
        raise InputError(words, file=file, field=column)
    return recording[column].values.astype(float).copy(), unit_of(recording[column])


def check_units(recording: "xr.Dataset", file: str, units: Mapping[str, str], pair: tuple[str, str]) -> None:
    """Raise InputError for columns that are not in these units, and for a pair of them that is swapped."""
    given = {name: str(recording[name].attrs.get("units", "")) for name in units if name in recording.data_vars}
    a, b = pair
    if given.get(a) == units[b] and given.get(b) == units[a]:
        raise InputError(f"{a} is in {units[b]} and {b} in {units[a]}: the two columns are swapped.", file=file)
    for name, unit in given.items():
        if unit != units[name]:
            words = f"is in {unit or 'no unit'}; {units[name]} or a multiple is needed. Give its unit in the campaign."
            raise InputError(words, file=file, field=name)


def check_varies(values: Float[np.ndarray, "n"], file: str, name: str) -> None:
    """Raise InputError for a column that is the same all the time."""
    if np.ptp(values) == 0:
        raise InputError("is constant: nothing can be identified from it.", file=file, field=name)


def beside_recordings(
    units: Mapping[str, str],
    fitted: Sequence[FittedTrial],
    test: Sequence[FittedTrial],
    samples: "Mapping[str, tuple[Sequence[Float[np.ndarray, '_']], str]]",
) -> "xr.Dataset":
    """What results of all fits hold: parameters with their units, and a model beside its recordings.

    - over `parameter`: `unit`. Over `recording`, its name: `used`, train if it was fitted, else test.
    - over `sample`, recording by recording (`of` is its place): what `samples` has of each, with its unit.
    """
    import xarray as xr

    sizes = [len(x) for x in samples["time"][0]]
    return xr.Dataset(
        {name: ("sample", np.concatenate(x), {"units": unit} if unit else {}) for name, (x, unit) in samples.items()},
        {
            "parameter": [*units],
            "unit": ("parameter", [*units.values()]),
            "recording": [one.name for one in (*fitted, *test)],
            "used": ("recording", ["train"] * len(fitted) + ["test"] * len(test)),
            "of": ("sample", np.repeat(np.arange(len(sizes)), sizes)),
        },
    )
