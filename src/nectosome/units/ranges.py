"""Ranges: `LOW..HIGH` as people write it, and parameters between bounds, each with a place from 0 to 1."""

import re
from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import ArrayLike

from nectosome.units.errors import InputError, did_you_mean

_RANGE = re.compile(r"\s*([^:]+?)\s*\.\.\s*([^:]+?)(?:\s*:\s*([^:]+?))?(\s+log)?\s*", re.DOTALL)
_SPREAD = re.compile(r"\s*(.+?)\s*(?:\+-|\+/-|±)\s*(.+?)(\s+each)?\s*", re.DOTALL)
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*")


class RangeText(NamedTuple):
    """The parts of a range, each number with its unit."""

    low: str
    high: str
    step: str  # empty without one; on a logarithmic scale the ratio of neighbouring values
    log: bool


def split_range(text: str) -> RangeText | None:
    """Split `LOW..HIGH`, `LOW..HIGH:STEP` or either with ` log` behind it; None where the text is none of these.

    A number without a unit has that of the next number, as in `30..75:5deg`.
    """
    match = _RANGE.fullmatch(text)
    if match is None:
        return None
    low, high, step, log = match.groups()
    if step is not None and not log:
        low, high, step = with_last_unit([low, high, step])
    low, high = with_last_unit([low, high])
    return RangeText(low, high, step or "", bool(log))


class SpreadText(NamedTuple):
    """The parts of `1.2 +- 0.1 MPa`, each number with its unit."""

    value: str
    plus_minus: str  # in percent it is a share of the value
    each: bool  # equal numbers differ, each on its own


def split_spread(text: str) -> SpreadText | None:
    """Split `VALUE +- SPREAD`, with ` each` behind it or not; None where the text is none of these.

    A value without a unit has that of the spread, unless this is in percent.
    """
    match = _SPREAD.fullmatch(text)
    if match is None:
        return None
    value, spread, each = match.groups()
    value = value if spread.endswith("%") else with_last_unit([value, spread])[0]
    return SpreadText(value, spread, bool(each))


def with_last_unit(numbers: Sequence[str]) -> list[str]:
    """Numbers as text, each with a unit: its own, else that of the next number that has one."""
    out, unit = list[str](), ""
    for text in reversed(numbers):
        own = text.removeprefix(match[0]) if (match := _NUMBER.match(text)) else text
        unit = own or unit
        out.append(text if own else f"{text} {unit}".strip())
    return out[::-1]


class Ranges:
    """Parameters with their bounds, and the map from the unit box [0, 1]^n to their values and back.

    Bounds that are equal fix a parameter; its place is 0. Raises InputError for a name that stands there
    twice, for bounds that are NaN, infinite or the wrong way round, and for a logarithm of zero.
    """

    names: tuple[str, ...]
    bounds: Float[np.ndarray, "n 2"]
    log: Bool[np.ndarray, "n"]  # mask of logarithmic scales
    ends: Float[np.ndarray, "n 2"]  # scaled bounds

    def __init__(self, names: Sequence[str], lower: ArrayLike, upper: ArrayLike, log: Collection[str] = ()):
        self.names, n = tuple(names), len(names)
        self.bounds = np.stack([np.broadcast_to(np.asarray(x, dtype=float), n) for x in (lower, upper)], axis=1)
        self.log = np.array([name in log for name in self.names], dtype=bool)
        for name in log:
            if name not in self.names:
                raise InputError(f"there is no such parameter.{did_you_mean(name, self.names)}", field=name)
        for k, (name, (low, high)) in enumerate(zip(self.names, self.bounds, strict=True)):
            if self.names.count(name) > 1:
                raise InputError("is named twice.", field=name)
            if not (np.isfinite([low, high]).all() and low <= high):
                words = f"{low:g} to {high:g} is no range: two numbers are needed, the larger one last."
                raise InputError(words, field=name)
            if self.log[k] and low <= 0:
                raise InputError(f"{low:g} has no logarithm: the lower bound must be more than 0.", field=name)
        self.ends = self._scaled(self.bounds.T).T

    def values(self, u: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Values at coordinates; for coordinates in [0, 1] they are within their bounds despite rounding."""
        u = np.asarray(u)
        x = self.ends[:, 0] + u * (self.ends[:, 1] - self.ends[:, 0])
        x = np.where(self.log, np.exp(np.where(self.log, x, 0.0)), x)
        return np.where((u >= 0) & (u <= 1), np.clip(x, self.bounds[:, 0], self.bounds[:, 1]), x)

    def places(self, x: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Coordinates of values; outside [0, 1] for values outside their bounds."""
        width = self.ends[:, 1] - self.ends[:, 0]
        return (self._scaled(np.asarray(x)) - self.ends[:, 0]) / np.where(width > 0, width, 1.0)

    def derivatives(self, x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Derivatives of values by their places, at x."""
        return (self.ends[:, 1] - self.ends[:, 0]) * np.where(self.log, x, 1.0)

    def text(self, x: Float[np.ndarray, "n"]) -> str:
        """Values in words: `k = 3.2, c = 0.1`."""
        return ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, x, strict=True))

    def _scaled(self, x: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        return np.where(self.log, np.log(np.where(self.log, x, 1.0)), x)
