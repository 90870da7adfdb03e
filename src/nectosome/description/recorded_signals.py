"""Signals that were recorded: their samples, written beside them or read from a file of measurements."""

import json
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Generic, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from nectosome.description.fields import Number, Time
from nectosome.description.signal_contract import Q, SignalDescription
from nectosome.io.schema.described import unfit, wrong
from nectosome.io.schema.quantity import QuantitySource
from nectosome.units import DIMENSIONS, InputError, did_you_mean, expected, parse_quantity, shorten

if TYPE_CHECKING:
    import xarray as xr


def _increasing(times: tuple[float, ...]) -> tuple[float, ...]:
    for k, (before, after) in enumerate(pairwise(times), start=1):
        if not before < after:
            raise unfit(f"the times must increase: {after:g} s, number {k + 1}, comes after {before:g} s.")
    return times


Times = Annotated[tuple[Time, ...], Field(min_length=2), AfterValidator(_increasing)]
"""Times of samples [s], increasing."""


class RecordingSignal(SignalDescription, Generic[Q]):
    """The quantity that was recorded, at least two samples, joined by straight lines.

    Before the first and after the last of them the quantity stays as it is there.
    """

    kind: Literal["recording"]
    times: Times = ()
    """Times of the samples, increasing."""
    values: Annotated[tuple[Q, ...], Field(min_length=2)] = ()
    """Value at each time."""
    file: str | None = None
    """File of measurements that has the samples, relative to this one, instead of times and values. Time counts from
    its first row."""
    column: str | None = None
    """Column of that file; may be left out where only one is of this quantity."""
    sheet: str | None = None
    """Sheet that describes that file: its columns and units."""
    factor: Number = 1.0
    """What the values are multiplied by."""
    signed = ("values",)
    smooth = False
    once = "values", "a recording does not repeat itself. Cut one period out of it and give that as a cycle."

    @model_validator(mode="after")
    def _has_samples(self, info: ValidationInfo) -> Self:
        if self.file is not None:
            if self.times or self.values:
                raise wrong("times" if self.times else "values", "the file has the samples. Leave one of the two out.")
            source = info.context if isinstance(info.context, QuantitySource) else QuantitySource()
            times, values = self._read_samples(source)
            read = {"times": times, "values": values, "file": None, "column": None, "sheet": None}
            for name, value in read.items():
                object.__setattr__(self, name, value)  # from here on it holds its samples, wherever the file is
        elif self.column is not None or self.sheet is not None:
            raise wrong("file", "is missing. Name the file that has the column.")
        for name in ("times", "values"):
            if not getattr(self, name):
                raise wrong(name, "is missing. Give times and values, or a file and a column.")
        if len(self.times) != len(self.values):
            why = f"there are {len(self.values)} values at {len(self.times)} times. Give one for each time."
            raise wrong("values", why)
        return self

    def _read_samples(self, source: QuantitySource) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s], from 0, and values [SI] of its file. Raises the error of a field for what is not there."""
        import numpy as np

        from nectosome.measure import read  # it takes a second, and few robots need it

        file, sheet = str(self.file), None if self.sheet is None else source.folder / self.sheet
        try:
            recording = read(source.folder / file, sheet)
        except InputError as error:
            raise wrong("file" if sheet is None else "sheet", str(error)) from None
        if "time" not in recording.dims:
            raise wrong("file", f"{file} has no time. Say in a sheet which column it is, or its rate.")
        if recording.sizes["time"] > source.most_rows:
            why = f"{file} has {recording.sizes['time']} rows, at most {source.most_rows} can drive a robot."
            raise wrong("file", f"{why} Resample it with fewer, or cut a part out.")
        column = self._column_of(recording)
        values, time = recording[column].values.astype(float), recording["time"].values.astype(float)
        missing = np.flatnonzero(~np.isfinite(values))
        if missing.size:
            notes = json.loads(recording.attrs["provenance"])
            odd = [text for text in (*notes["warnings"], *notes["repairs"]) if text.startswith(f"{column}: ")]
            where = odd[0] if odd else f"{column}: {missing.size} values missing"
            why = f"{file}, {where}, at {time[missing[0]]:.9g} s. Fill them in, or leave these rows out."
            raise wrong("column", why)
        gaps = json.loads(recording.attrs["gaps"]) if self.smooth else []
        if gaps:
            since, until, row = gaps[0]
            why = f"{file}, row {row}: nothing was recorded between {since:.9g} s and {until:.9g} s."
            raise wrong("file", f"{why} Cut out a part without a gap.")
        return tuple((time - time[0]).tolist()), tuple(values.tolist())

    def _column_of(self, recording: "xr.Dataset") -> str:
        """Return its column, or the only one of its quantity. Raises the error of a field."""
        kind, column = DIMENSIONS[self.dimension], self.column
        units = {str(name): str(one.attrs.get("units", "")) for name, one in recording.data_vars.items()}
        if column is None:
            fitting = [name for name, unit in units.items() if unit == kind.unit]
            if len(fitting) != 1:
                listed = ", ".join(fitting or [f"{name} [{unit or '?'}]" for name, unit in units.items()])
                several = f"{self.file} has several columns of this quantity: {listed}. Name one."
                none = (
                    f"no column of {self.file} is {kind.with_article()}; it has {listed}. Write units in its heading."
                )
                raise wrong("column", several if fitting else none)
            return fitting[0]
        if column not in units:
            raise wrong("column", f'{self.file} has no column "{shorten(column)}".{did_you_mean(column, units)}')
        unit = units[column]
        if unit in ("", "1") and kind.unit:
            why = f"{self.file} gives it no unit. Write one into its heading, as in angle (deg), or into a sheet."
            raise wrong("column", why)
        if unit not in ("", "1"):
            try:
                parse_quantity(f"1 {unit}", self.dimension)  # SI already; rad may be left out, as in 1/m
            except ValueError:
                raise wrong("column", f"{self.file} has it in {unit}. {expected(self.dimension)}") from None
        return column

    def least(self) -> float:
        """Return the smallest of the values."""
        return min(self.factor * min(self.values), self.factor * max(self.values))

    @property
    def length(self) -> float:
        """Time of its last sample [s]."""
        return self.times[-1]


class SmoothRecordingSignal(RecordingSignal[Q], Generic[Q]):
    """The quantity that was recorded, at least four samples, as a smooth curve through them.

    The curve is a cubic spline whose third derivative is continuous at the second and the last but one sample
    (not-a-knot). The first time is at most 0 s. Before the first and after the last sample the quantity stands still at
    that sample: let a recording end at rest if the motion goes on after it.
    """

    smooth = True

    @model_validator(mode="after")
    def _is_a_motion(self) -> Self:
        if len(self.times) < 4:
            raise wrong("values", f"a smooth curve needs at least 4 samples, {len(self.times)} given.")
        if self.times[0] > 0:
            why = f"nothing is known of the motion before {self.times[0]:g} s. Let the first time be at most 0 s."
            raise wrong("times.0", why)
        return self
