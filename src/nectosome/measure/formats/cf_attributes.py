"""Attributes of HDF5 and netCDF data (CF conventions): unit, time, packing and missing values."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.named_arrays import NamedArray, SkippedEntry, Transposed, classify


class Packed:
    """Packed numbers: scale * raw + offset, NaN for the raw values that mean missing."""

    def __init__(self, array: Any, missing: Sequence[float], scale: float, offset: float):
        self.shape, self.dtype, self._array = array.shape, np.dtype(float), array
        self._missing, self._scale, self._offset = missing, scale, offset

    def __getitem__(self, rows: Any) -> np.ndarray:
        raw = np.asarray(self._array[rows])
        values = raw.astype(float)
        if (self._scale, self._offset) != (1, 0):
            values = values * self._scale + self._offset
        return np.where(np.isin(raw, self._missing), np.nan, values)


def described(
    name: str,
    array: Any,
    group: str,
    attributes: Mapping[str, Any],
    dimensions: Sequence[str] = (),
    labels: Mapping[str, Sequence[str]] | None = None,
) -> NamedArray | SkippedEntry:
    """Return an array with unit, dimension and notes of its attributes; `labels` of the dimensions, by name."""
    lower = {key.lower(): value for key, value in attributes.items()}
    unit, notes = text(lower.get("units", lower.get("unit", ""))), []
    if " since " in unit:
        notes.append(f"{name}: {unit}")
        unit = unit.partition(" since ")[0]
    if array.dtype.kind in "iuf" and (unpacked := _unpacked(array, lower)) is not None:
        array = unpacked
        if {"scale_factor", "add_offset"} & lower.keys():
            notes.append(f"{name}: unpacked with its scale_factor and add_offset")
    entry = classify(name, array, group, unit=unit, notes=notes)
    if isinstance(entry, SkippedEntry) or not dimensions:
        return entry
    along, *across = dimensions
    if len(dimensions) == 2 and not entry.is_vector and is_time(_last(across[0])) and not is_time(_last(along)):
        along, across, entry = across[0], [along], replace(entry, array=Transposed(array))
    named = (labels or {}).get(across[0], ()) if across and not entry.is_vector else ()
    return replace(entry, along=along, labels=named, first=_last(along) == name)


def text(value: Any) -> str:
    """Return an attribute as text; "" if it is not text."""
    values = np.asarray(value).ravel()
    first = values[0] if len(values) == 1 else None
    if isinstance(first, bytes):
        first = first.decode("utf-8", "replace")
    return first.strip() if isinstance(first, str) else ""


def _unpacked(array: Any, lower: Mapping[str, Any]) -> Packed | None:
    missing = [value for key in ("_fillvalue", "missing_value") for value in _numbers(lower.get(key)) if value == value]
    (scale, *_), (offset, *_) = _numbers(lower.get("scale_factor")) or [1.0], _numbers(lower.get("add_offset")) or [0.0]
    return Packed(array, missing, scale, offset) if missing or (scale, offset) != (1, 0) else None


def _numbers(value: Any) -> list[float]:
    values = np.ravel(value)
    return values.astype(float).tolist() if values.dtype.kind in "iuf" else []


def _last(path: str) -> str:
    return path.rpartition("/")[2]
