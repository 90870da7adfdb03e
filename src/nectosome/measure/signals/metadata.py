"""Metadata of a recording: its time, its units, its standard errors, and its processing steps.

- A recording is an `xarray.Dataset` with dimension and coordinate `time` [s], increasing, and one variable per
  quantity, in SI units, `attrs["units"]`. Repeats are a dimension `repeat`.
- The standard error of the variable `force` is the variable `force_se`, in the same unit.
- `attrs["processing"]` is a JSON list with one entry per step: its `function`, its settings, and `"errors":
  "correlated"` if the errors of neighbouring samples are no longer independent after it.

Functions of signals take a Dataset, or a DataArray without standard errors, and return a new one. A variable taken out
of a Dataset loses the list of steps.
"""

import json
import re
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
import xarray as xr
from jaxtyping import Float

SE = "_se"
CORRELATED = {"errors": "correlated"}
R = TypeVar("R", xr.Dataset, xr.DataArray)
_ALONE = "signal"
_FACTOR = re.compile(r"([^\W\d_]+|%)(-?\d+)?")  # a symbol and its power


class RecordedSignal(NamedTuple):
    """One quantity of a recording, time last."""

    values: Float[np.ndarray, "*batch n"]
    se: Float[np.ndarray, "*batch n"] | None  # None: unknown
    units: str | None  # None: unknown


def quantities(recording: xr.Dataset, dim: str = "time") -> list[str]:
    """Names of the variables along `dim`, without the standard errors."""
    names = [str(name) for name, variable in recording.data_vars.items() if dim in variable.dims]
    return [name for name in names if not (name.endswith(SE) and name.removesuffix(SE) in recording.data_vars)]


def units(quantity: xr.DataArray) -> str | None:
    """Unit of a quantity, None if unknown."""
    return quantity.attrs.get("units")


def processing(recording: xr.Dataset | xr.DataArray) -> list[dict[str, Any]]:
    """Processing steps, the oldest first."""
    return json.loads(recording.attrs.get("processing", "[]"))


def with_step(recording: R, function: str, **settings: Any) -> R:
    """Return the recording with one more processing step."""
    steps = [*processing(recording), {"function": function, **settings}]
    text = json.dumps(steps, allow_nan=False, default=lambda number: number.item())  # NumPy scalars
    return recording.assign_attrs(processing=text)


def history(recording: xr.Dataset | xr.DataArray) -> dict[str, str]:
    """The processing steps, as attributes of a dataset derived from the recording."""
    return {k: v for k, v in recording.attrs.items() if k == "processing"}


def errors_independent(recording: xr.Dataset | xr.DataArray) -> bool:
    """Whether the errors of neighbouring samples are still independent: no step has correlated them."""
    return not any(step.get("errors") == "correlated" for step in processing(recording))


def each(
    recording: R,
    change: Callable[[str, RecordedSignal], RecordedSignal],
    along: Sequence[xr.DataArray] | None = None,
) -> R:
    """Return the recording with `change` applied to every quantity; coordinates `along` replace time.

    Variables without time are kept; with `along`, other coordinates over the old time are dropped. Raises ValueError
    for a quantity that is not numeric.
    """
    if isinstance(recording, xr.DataArray):
        return each(recording.to_dataset(name=_ALONE), change, along)[_ALONE].rename(recording.name)
    new = {}
    for name in quantities(recording):
        before = recording[name].transpose(..., "time")
        after = change(name, _signal(recording, name, before))
        dims, order = before.dims, recording[name].dims
        if along is not None:
            instead, place = [coordinate.name for coordinate in along], order.index("time")
            dims, order = (*dims[:-1], *instead), (*order[:place], *instead, *order[place + 1 :])
        unit = {"units": after.units} if after.units is not None else {}
        others = {k: v for k, v in before.attrs.items() if k != "units"}
        new[name] = xr.DataArray(after.values, dims=dims, attrs=others | unit).transpose(*order)
        if after.se is not None:
            new[name + SE] = xr.DataArray(after.se, dims=dims, attrs=unit).transpose(*order)
        else:
            recording = recording.drop_vars(name + SE, errors="ignore")
    if along is not None:
        coordinates = {coordinate.name: coordinate for coordinate in along}
        recording = recording.drop_dims("time").assign_coords(coordinates)
    return recording.assign(new)


def _signal(recording: xr.Dataset, name: str, values: xr.DataArray) -> RecordedSignal:
    for variable in (recording[name], recording.get(name + SE)):
        if variable is not None and variable.dtype.kind not in "fiu":
            raise ValueError(
                f"{variable.name} holds {variable.dtype}, and numbers are expected: leave it out with "
                f'drop_vars("{variable.name}"), or turn it into numbers with astype(float).'
            )
    se = recording.get(name + SE)
    if se is not None:
        se = se.broadcast_like(values).transpose(*values.dims).values.astype(float)
    return RecordedSignal(values.values.astype(float), se, units(values))


def product(*factors: tuple[str, int]) -> str:
    """Unit of a product of powers: `product(("m/s", 2), ("Hz", -1))` is `m2/(s2 Hz)`; "1" if all cancel.

    A text with anything but symbols, powers, one slash and blanks counts as one symbol, in parentheses.
    """
    powers: dict[str, int] = {}
    for text, power in factors:
        for symbol, exponent in _powers(text).items():
            powers[symbol] = powers.get(symbol, 0) + exponent * power
    above = " ".join(_write(symbol, n) for symbol, n in powers.items() if n > 0)
    below = [_write(symbol, -n) for symbol, n in powers.items() if n < 0]
    if not below:
        return above or "1"
    return f"{above or '1'}/{below[0] if len(below) == 1 else '(' + ' '.join(below) + ')'}"


def _powers(text: str) -> dict[str, int]:
    above, _, below = re.sub(r"[*·]", " ", text.replace("**", "").replace("^", "")).partition("/")
    if below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    elif " " in below:
        return {f"({text})": 1}  # "N/m s" is ambiguous
    powers: dict[str, int] = {}
    for part, sign in ((above, 1), (below, -1)):
        for factor in part.split():
            if factor == "1":
                continue
            match = _FACTOR.fullmatch(factor)
            if match is None or factor == "or":
                return {f"({text})": 1}
            powers[match[1]] = powers.get(match[1], 0) + sign * int(match[2] or 1)
    return powers


def _write(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}{power}"
