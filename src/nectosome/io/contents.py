"""What a kind of results file holds, and the one check of files that others made or damaged."""

import json
from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray as xr

Dims = tuple[str, ...]
_MOST = 1e100  # of any number: its square is finite still


class Contents(NamedTuple):
    """What the readers of a kind of results file take from it; other variables and attributes may be anything.

    - kind: its name in messages, such as "a simulation".
    - needed: numbers that it must have, with their dimensions; known: those that older files lack.
    - finite: which of them are never NaN; endless: which may be infinite.
    - units: which of them need a unit.
    - names: dimensions whose labels are texts, each once.
    - texts: attributes that are text; counts: those that are whole numbers, where there are any; numbers: other ones.
    - encoded: attributes that are JSON, of this type.
    """

    kind: str
    needed: Mapping[str, Dims]
    known: Mapping[str, Dims] = {}
    finite: Collection[str] = ()
    endless: Collection[str] = ()
    units: Collection[str] = ()
    names: Collection[str] = ()
    texts: Collection[str] = ()
    counts: Collection[str] = ()
    numbers: Collection[str] = ()
    encoded: Mapping[str, type] = {}


def check_contents(dataset: "xr.Dataset", contents: Contents, source: str) -> None:
    """Raise InputError with the first thing that is not as `contents` has it; `source` is the name of the file."""
    for what in _faults(dataset, contents):
        raise InputError(f"this is not {contents.kind}: {what}.", file=source)
    for name in (*contents.needed, *contents.known):
        if name in dataset.variables:
            _check_values(dataset[name].values, name, contents, source)


def _faults(dataset: "xr.Dataset", contents: Contents) -> Iterator[str]:
    """What variables, names and attributes have of a wrong kind, or lack."""
    for name, dims in (*contents.needed.items(), *contents.known.items()):
        over = f" over {', '.join(dims)}" if dims and dims != (name,) else ""
        fits = name in dataset.variables and dataset[name].dims == dims and dataset[name].dtype.kind == "f"
        if not fits and (name in contents.needed or name in dataset.variables):
            yield f"it has no {name}{over}" if name in contents.needed else f"its {name} has no numbers{over}"
        elif fits and name in contents.units and not isinstance(dataset[name].attrs.get("units"), str):
            yield f"its {name} has no unit"
    for name in contents.names:
        labels = dataset.coords.get(name)
        if labels is None or labels.dims != (name,) or labels.dtype.kind != "U":
            yield f"its {name} has no names"
        elif len({*labels.values.tolist()}) < labels.size:
            yield f"its {name} has a name twice"
    for name in (*contents.texts, *contents.encoded):
        if not isinstance(dataset.attrs.get(name), str):
            yield f"its {name} is missing" if name not in dataset.attrs else f"its {name} is no text"
    for name in (*contents.counts, *contents.numbers):
        kind = np.asarray(dataset.attrs.get(name, 0))
        if kind.ndim or kind.dtype.kind not in ("iu" if name in contents.counts else "iuf") or not np.isfinite(kind):
            yield f"its {name} is no number"
    for name, kind in contents.encoded.items():
        try:
            fits = isinstance(json.loads(dataset.attrs[name]), kind)
        except (ValueError, RecursionError):
            fits = False
        if not fits:
            yield f"its {name} cannot be read"


def _check_values(values: np.ndarray, name: str, contents: Contents, source: str) -> None:
    known = np.isfinite(values)
    if name in contents.finite and not known.all():
        raise InputError(f"its {name} is not finite everywhere.", file=source)
    if name not in contents.endless and np.isinf(values).any():
        raise InputError(f"its {name} is infinite.", file=source)
    if np.abs(values[known].astype(float)).max(initial=0.0) > _MOST:
        raise InputError(f"its {name} is beyond {_MOST:g}.", file=source)
