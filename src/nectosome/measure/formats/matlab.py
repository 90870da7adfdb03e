"""MAT-files: variables, fields of a struct, or what Simulink logged, as columns."""

from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from nectosome.io.errors import shorten
from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.faults import damage_told, foreign, head, is_text
from nectosome.measure.formats.hdf5 import opened
from nectosome.measure.formats.items import Item, Other, item_of, join
from nectosome.measure.formats.matlab_4 import read_mat4
from nectosome.measure.formats.matlab_5 import read_mat5
from nectosome.measure.formats.matlab_73 import read_mat73
from nectosome.measure.formats.matlab_values import Unread, Value
from nectosome.measure.formats.source import Options, Source
from nectosome.measure.formats.tables import choose

_SIGNATURES = (b"PK\x03\x04", b"CDF", b"\x93NUMPY", b"TDS", b"\xd0\xcf\x11\xe0")


def open_matlab(path: Path, options: Options) -> Source:
    """Open a .mat file of any version: vectors of one length, a matrix, a struct of them, or Simulink's log.

    Raises InputError for what is no such file, is damaged, or holds no table, several, or objects of MATLAB alone.
    """
    import h5py

    start = head(path)
    with damage_told(path), ExitStack() as stack:
        if h5py.is_hdf5(path):
            values = read_mat73(stack.enter_context(opened(path)))
        elif start.startswith(_SIGNATURES) or (is_text(start) and not start.startswith(b"MATLAB")):
            raise foreign(path, "a MAT-file", start)
        else:
            values = read_mat4(path) if 0 in start[:4] else read_mat5(path.read_bytes())
        things = [thing for name, value in values.items() for thing in _things(name, value, "")]
        wanted = options.table.replace(".", "/") if options.table is not None else None
        table = choose(things, wanted)
        return ArraySource("matlab", path, table.blocks(), table.found, close=stack.pop_all().close)


def _things(name: str, value: Value, group: str) -> list[Item | Other]:
    """What a variable or field holds, and what is inside of it."""
    if isinstance(value, str):
        return [Other(name, "text", group, f'"{shorten(value)}"')]
    if isinstance(value, Unread):
        return [Other(name, value.what, group)]
    if isinstance(value, list):
        return [Other(name, f"an array of {len(value)} structs", group)]
    if not isinstance(value, dict):
        return [item_of(name, value, group)]
    inside = join(group, name)
    if {"time", "signals"} <= value.keys():
        return _logged(value, inside)
    lower = {field.lower(): field for field in value}
    if {"time", "data"} <= lower.keys():
        return _series(name, value, lower, inside)
    return [thing for field, inner in value.items() for thing in _things(field, inner, inside)]


def _logged(struct: dict[str, Value], group: str) -> list[Item | Other]:
    """Simulink's structure with time: `time`, and for each of the `signals` its `values`, `label` and `blockName`."""
    signals = struct["signals"]
    things = _things("time", struct["time"], group)
    for i, signal in enumerate(signals if isinstance(signals, list) else [signals]):
        if isinstance(signal, dict) and "values" in signal:
            names = [signal.get("label"), signal.get("blockName")]
            name = next((n.rpartition("/")[2] for n in names if isinstance(n, str) and n.strip()), f"signals({i + 1})")
            things += _things(name, signal["values"], group)
    return things


def _series(name: str, struct: dict[str, Value], fields: dict[str, str], group: str) -> list[Item | Other]:
    """A timeseries as a struct: `Time`, and `Data`, which takes the name of the struct; their infos know the units."""
    units = {fields[key]: _unit(struct.get(info)) for key, info in (("time", "TimeInfo"), ("data", "DataInfo"))}
    things: list[Item | Other] = []
    for field, value in struct.items():
        if field not in ("TimeInfo", "DataInfo"):
            inside = _things(name if field == fields["data"] else field, value, group)
            things += [replace(x, unit=units.get(field, "")) if isinstance(x, Item) else x for x in inside]
    return things


def _unit(info: "Value | None") -> str:
    unit = info.get("Units") if isinstance(info, dict) else None
    return unit if isinstance(unit, str) else ""
