"""Robot files: YAML to a description and back, by way of plain data; settings, `omega=14.4rad/s`, are checked alike."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError

from nectosome.description.drives import MotorDescription
from nectosome.description.mesh_added_mass import with_added_mass
from nectosome.description.meshes import MeshShape
from nectosome.description.parts import Rigid
from nectosome.description.recorded_signals import RecordingSignal
from nectosome.description.robot import RobotDescription, check_description, resolve
from nectosome.io.atomic import write_atomic
from nectosome.io.schema.described import inside
from nectosome.io.schema.quantity import Si
from nectosome.io.schema.structure import Slot, at_path, items, leaves, numeric_paths, slot, to_plain
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import Key, read_text, read_yaml, write_yaml
from nectosome.units import DIMENSIONS, InputError, did_you_mean, shorten

Settings = Iterable[str] | Mapping[str, Any]
"""Quantities to set: `name=value` as text, or by name their values, text as in a file or numbers in SI."""


def load_robot(path: str | Path, copies: Mapping[str, int] | None = None) -> RobotDescription:
    """Return the robot described in the YAML file at `path`.

    - copies: counts of limbs that take the place of the file's, such as {"limbs.fin.repeat.count": 4}.

    Raises InputError with file, line and field for whatever is wrong: no such file, no text, no YAML, no robot.
    """
    data, lines = read_yaml(read_text(path), str(path))
    for name, count in (copies or {}).items():
        *groups, last = name.split(".")
        place = data
        for group in groups:
            place = place.get(group) if isinstance(place, dict) else None
        if not isinstance(place, dict) or last not in place:
            raise InputError("the file has no limb with such a count.", file=str(path), field=name)
        place[last] = count
    description = validate(data, file=str(path), lines=lines)
    for name, part in description.parts.items():
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            with _in_part(path, description.place_of(name)):
                with inside("shape"):
                    shape = part.shape.refreshed(Path(path).parent)
                if shape is not part.shape:
                    loads = with_added_mass(part.loads, shape, Path(path).parent)
                    description = description.with_part(name, shape=shape, loads=loads)
    return description


@contextmanager
def _in_part(path: str | Path, part: str) -> Iterator[None]:
    """Name file and field in errors of a mesh that has changed."""
    try:
        with inside(part):
            yield
    except PydanticCustomError as error:
        raise InputError(error.message(), file=str(path), field=(error.context or {})["field"]) from None


def parse_robot(text: str, source: str = "robot") -> RobotDescription:
    """Return the robot described in YAML `text`; `source` names it in messages. Raises InputError."""
    data, lines = read_yaml(text, source)
    return validate(data, file=source, lines=lines)


@lru_cache(maxsize=8)
def robot_of_run(text: str) -> RobotDescription:
    """Return the robot of a run from its text, which names no file, so that it is read once. Raises InputError."""
    return parse_robot(text)


def validate(
    data: Any, *, file: str | None = None, lines: Mapping[Key, int] | None = None, folder: Path | None = None
) -> RobotDescription:
    """Return the description in plain `data`; InputError names file, line and field of the first mistake.

    Names of other files are relative to `folder`, else to that of `file`.
    """
    return validate_as(RobotDescription, data, "robot", file=file, lines=lines, folder=folder)


def dump_robot(description: RobotDescription) -> str:
    """Return YAML text with readable units that loads as exactly the same description."""
    return write_yaml(to_plain(description))


def save_robot(description: RobotDescription, path: str | Path) -> None:
    """Write a robot file that `load_robot` reads as exactly the same description, whole or not at all.

    Raises InputError for what is no description, and where it cannot be written.
    """
    check_description(description)
    write_atomic(path, dump_robot(description).encode())


def read_value(name: str, value: Any, description: RobotDescription) -> dict[str, float]:
    """Read a value of a quantity, text with its unit or `Si`, as SI values by path; an alias may stand for several.

    Raises InputError for an unknown name, a missing or wrong unit, or a value out of the field's range.
    """
    known = numeric_paths(description)
    try:
        return {path: known[path].read(value, units_required=True) for path in resolve(description, name)}
    except ValueError as error:
        raise InputError(str(error), field=name) from None


def apply_settings(description: RobotDescription, settings: Settings, folder: Path | None = None) -> RobotDescription:
    """Return the description with settings put in and everything checked anew.

    What is no quantity is set by its path too: `limbs.filament.strains.torsion=5`, `limbs.shaft.joint={kind: fixed}`.
    Numbers of a mapping are `Si`. Meshes that settings ask for are looked for in `folder`, else in the working one.
    Raises InputError.
    """
    check_description(description)
    data = to_plain(description, si=True)
    for name, value in settings.items() if isinstance(settings, Mapping) else map(_split, settings):
        group = not isinstance(value, Si) and str(value).startswith("{")
        if not group and (name in description.number_aliases or name in numeric_paths(description)):
            paths: Iterable[str] = read_value(name, value, description)
        else:
            paths = description.aliases.get(name, (name,))
            try:
                value = read_yaml(value, name)[0] if isinstance(value, str) else value
            except InputError as error:
                raise InputError(error.message, field=name) from None
        for path in paths:
            _put(data, description, path, value)
    return validate(data, folder=folder)


class Samples(NamedTuple):
    """What was recorded of a quantity, in an SI unit."""

    times: Sequence[float]  # [s]
    values: Sequence[float]
    unit: str


def with_recordings(description: RobotDescription, recordings: Mapping[str, Samples]) -> RobotDescription:
    """Return the description with samples for the signals at some paths, and everything checked anew.

    Raises InputError for a path that is no signal, or none that may be recorded, and for samples in another unit.
    """
    data = to_plain(description, si=True)
    for path, samples in recordings.items():
        here, _ = at_path(description, path)
        kind = here.kinds().get("recording") if here is not None else None
        if kind is not None and issubclass(kind, RecordingSignal):
            unit = DIMENSIONS[kind.dimension].unit
            if unit != samples.unit:
                why = f"is driven in {unit}, and was recorded in {samples.unit or 'no unit'}."
                raise InputError(f"{why} Give the unit in the campaign.", field=path)
        times, values = ([Si(x) for x in row] for row in samples[:2])
        _put(data, description, path, {"kind": "recording", "times": times, "values": values})
    return validate(data)


def _split(setting: str) -> tuple[str, str]:
    name, equals, text = setting.partition("=")
    if not equals or not name.strip() or not text.strip():
        raise InputError(f'"{shorten(setting)}" is no setting. Write a name, = and a value, as in "omega=14.4rad/s".')
    return name.strip(), text.strip()


def _put(data: Any, description: RobotDescription, path: str, value: Any) -> None:
    """Put `value` at `path` into plain `data`; groups that it leaves at their default are filled in first."""
    standing: Any = description
    here: Slot | None = slot(type(description))
    *parents, leaf = path.split(".")
    for key in parents:
        standing = dict(items(standing)).get(key)
        here = here.child(key, data) if here is not None else None
        if isinstance(data, dict) and here is not None:
            if isinstance(standing, tuple) and not isinstance(data.get(key), list):
                data[key] = [to_plain(item, here.child(i, standing), si=True) for i, item in enumerate(standing)]
            elif key not in data and standing is not None:
                data[key] = to_plain(standing, here, si=True)
        data = dict(items(data)).get(key)
    if isinstance(data, list) and leaf.isdigit() and int(leaf) < len(data):
        data[int(leaf)] = value
    elif isinstance(data, dict) and here is not None and here.child(leaf, data) is not None:
        if isinstance(standing, MotorDescription) and leaf == "model":  # the sheet of the model before goes with it
            for name in standing.of_sheet():
                if data.get(name) == Si(getattr(standing, name)):
                    del data[name]
        data[leaf] = value
    else:
        known = [*description.aliases, *(known for known, _ in leaves(description))]
        raise InputError(f'there is nothing called "{shorten(path)}" in {description.name}.{did_you_mean(path, known)}')
