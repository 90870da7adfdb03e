"""Results files that others made or damaged, from good ones: by variables, dimensions and attributes, and by bytes."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

_TEXTS = (
    "",
    "[]",
    "{",
    "3",
    "\x1b[31mred\n\n",
    "y" * 20_000,
    "[" * 20_000,
    '{"settings": 3, "packages": [1], "time": {}}',
)
_VALUES = (None, *_TEXTS, 3, -1, 0.5, np.nan, np.inf, np.arange(3.0), b"\xff", ["a", "b"], 2**62)
_UNITS = (3, "kg", "nonsense", "y" * 10_000, np.arange(3.0))
# attributes and variables that some files have, to be put into one that has them not
_OTHERS = (
    "period",
    "growth",
    "multiplier",
    "multiplier_error",
    "cycles",
    "corrections",
    "jacobians",
    "residuals",
    "measured",
    "commanded",
)
_ADDED = ("motor", "battery", "tendon", "reference", "sample", "reading", "reaction_limit", "impulse", "strouhal")


def damaged(good: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """What was done to a dataset, and what became of it."""
    for name in map(str, good.variables):
        yield f"{name} dropped", good.drop_vars(name)
        for what, other in _variables(good.variables[name]):
            rest = good if other.dims == good.variables[name].dims else good.drop_vars(name)
            yield f"{name} {what}", _with(rest, name, other)
    for dim in map(str, good.dims):
        n = good.sizes[dim]
        for what, places in (
            ("empty", []),
            ("fewer", range(n - 1)),
            ("turned", range(n)[::-1]),
            ("doubled", 2 * [*range(n)]),
        ):
            yield f"{dim} {what}", good.isel({dim: [*places]})
        yield f"{dim} renamed", good.rename({dim: "another"})
        if n:
            yield f"{dim} gone", good.isel({dim: 0}, drop=True)
    for name in (*map(str, good.attrs), *(x for x in _OTHERS if x not in good.attrs)):
        for k, value in enumerate(_VALUES):
            others = {key: x for key, x in good.attrs.items() if key != name}
            yield (
                f"attribute {name} {k}",
                good.drop_attrs(deep=False).assign_attrs(others | ({} if value is None else {name: value})),
            )
    robot = str(good.attrs.get("robot", ""))
    rock = "name: rock\nbody: {kind: rigid, shape: point, mass: 1 kg}\n"
    for text in (rock, robot[: len(robot) // 2], robot.replace("body:", "torso:")):
        yield f"robot {text[:20]!r}", good.assign_attrs(robot=text)
    for name in (x for x in _ADDED if x not in good.variables and x not in good.dims):
        yield f"number {name} added", good.assign({name: 3.0})
        yield f"text {name} added", good.assign({name: "words"})
        yield f"dimension {name} added", good.assign_coords({name: (name, ["a", "b"])})
    nothing = {name: _filled(x.variable, np.nan) for name, x in good.data_vars.items() if x.dtype.kind == "f"}
    yield "all NaN", good.assign(nothing)
    yield "no attributes", good.drop_attrs()
    yield "nothing", xr.Dataset()


def _variables(x: xr.Variable) -> Iterator[tuple[str, xr.Variable]]:
    """Another variable in the place of one: other values, types, dimensions and units."""
    if x.dtype.kind == "f":
        for value in (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300):
            yield f"all {value}", _filled(x, value)
        for value in (np.nan, np.inf, 1e300) if x.size else ():
            one = x.values.copy()
            one.flat[x.size // 2] = value
            yield f"one {value}", x.copy(data=one)
        others = {
            "int": np.nan_to_num(x.values).astype(int),
            "text": x.values.astype(str),
            "small": x.values.astype("f4"),
        }
        others |= {"bool": x.values.astype(bool), "turned": x.values[::-1] if x.ndim else x.values}
    else:
        others: dict[str, Any] = {"number": np.arange(float(x.size)).reshape(x.shape), "bytes": x.values.astype("S")}
        others |= {
            "empty": np.full(x.shape, ""),
            "odd": np.array([f"\x1b[31m<b>{k}" for k in range(x.size)]).reshape(x.shape),
        }
        others |= {"long": np.array([f"{k}{'y' * 5000}" for k in range(x.size)]).reshape(x.shape)}
    for what, values in others.items():
        yield what, xr.Variable(x.dims, values, x.attrs)
    if x.ndim:
        yield "flat", xr.Variable(("another",), x.values.ravel(), x.attrs)
        yield "with a dimension more", xr.Variable(("another", *x.dims), x.values[None], x.attrs)
    yield "without a unit", xr.Variable(x.dims, x.values)
    for k, unit in enumerate(_UNITS):
        yield f"unit {k}", xr.Variable(x.dims, x.values, {"units": unit})


def _filled(x: xr.Variable, value: float) -> xr.Variable:
    return x.copy(data=np.full(x.shape, value))


def _with(dataset: xr.Dataset, name: str, variable: xr.Variable) -> xr.Dataset:
    return dataset.assign_coords({name: variable}) if name in dataset.coords else dataset.assign({name: variable})


def damaged_bytes(good: bytes) -> Iterator[tuple[str, bytes]]:
    """A file that was cut, or had bits turned, was emptied or doubled, at places that are always the same."""
    rng = np.random.default_rng(44)
    for share in (0.0, 0.001, 0.1, 0.5, 0.9, 0.999):
        yield f"cut at {share}", good[: int(share * len(good))]
    for k in range(20):
        place = int(rng.integers(len(good) if k % 2 else 2000))  # the head of the file has the most to break
        yield f"bit at {place}", good[:place] + bytes([good[place] ^ (1 << k % 8)]) + good[place + 1 :]
    half = len(good) // 2
    yield "second half of zeros", good[:half] + bytes(len(good) - half)
    yield "twice", good + good
    yield "text", b"time,x\n0,1\n"
    yield "classic netCDF", b"CDF\x01" + bytes(64)
