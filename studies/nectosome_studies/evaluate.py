"""Expressions of data files: what rows and figures take from datasets, as in `100 * (thrust / thrust[0] - 1)`."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from nectosome.units import InputError, did_you_mean

_FIELD = re.compile(r"\{([^{}:]+)(?::([^{}]*))?\}")
_BUILTINS: dict[str, Any] = {"len": len, "max": max, "min": min, "float": float, "int": int, "str": str}
_BUILTINS["rms"] = lambda x: np.sqrt(np.nanmean(np.square(x)))


class Names(Mapping[str, Any]):
    """What an expression may name: variables of a dataset, its `attrs`, datasets, `rms`, functions of numpy.

    `data` has all datasets by name.
    """

    def __init__(self, sets: Mapping[str, xr.Dataset], one: xr.Dataset | None = None) -> None:
        self._own = {**sets, "data": sets, "np": np, **_BUILTINS}
        if one is not None:
            self._own |= {"attrs": one.attrs, **{str(name): one[name] for name in one.variables}}

    def __getitem__(self, name: str) -> Any:
        if name in self._own:
            return self._own[name]
        if hasattr(np, name):
            return getattr(np, name)
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._own)

    def __len__(self) -> int:
        return len(self._own)


def value_of(expression: str, names: Names) -> Any:
    """Value of an expression of Python, which files of this package write. Raises InputError for an unknown name."""
    try:
        return eval(expression, {"__builtins__": {}}, names)
    except (NameError, AttributeError) as error:
        known = (
            list(names) if isinstance(error, NameError) else [str(name) for name in getattr(error.obj, "variables", ())]
        )
        raise InputError(f'"{expression}": there is no {error.name}.{did_you_mean(str(error.name), known)}') from None


def array_of(expression: str, names: Names) -> np.ndarray:
    """Values of an expression, at least one."""
    return np.atleast_1d(np.asarray(value_of(expression, names)))


def filled(text: str, names: Names) -> str:
    """A text whose `{expression:format}` are replaced by their values."""
    return _FIELD.sub(lambda found: format(_plain(value_of(found[1], names)), found[2] or ""), text)


def _plain(value: Any) -> Any:
    """A number for an array of one."""
    return value.item() if hasattr(value, "item") and np.size(value) == 1 else value
