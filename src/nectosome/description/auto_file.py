"""What `water: auto` has chosen in a robot file, and the file with that written out."""

import re
from pathlib import Path
from typing import Any, NamedTuple

from nectosome.io.atomic import write_atomic
from nectosome.io.schema.structure import to_plain
from nectosome.io.yaml_text import added_fields, read_text, read_yaml, replaced_field
from nectosome.units import InputError

from .loads import LoadDescription
from .robot import RobotDescription
from .robot_file import load_robot

_AS_GROUP = re.compile(r"\bwater:(?:[ ]*\{[ ]*auto:[ ]*true[ ]*\}|([ ]*#[^\n]*)?\n[ ]*auto:[ ]*true\b)")


class AutoLoads(NamedTuple):
    """The loads that were chosen for a part."""

    part: str  # in the description, the first of its copies
    place: tuple[str, ...]  # of the part as it is written
    loads: dict[str, LoadDescription]

    @property
    def texts(self) -> dict[str, str]:
        """The loads as a file has them."""
        return {name: _flow(to_plain(load)) for name, load in self.loads.items()}


def auto_loads(path: Path, description: RobotDescription) -> list[AutoLoads]:
    """The loads that were chosen for each part of a robot file with `water: auto`, by the description of the file."""
    data, _ = read_yaml(read_text(path), str(path))
    limbs = data.get("limbs") or {}
    written_parts = {("limbs", name): limb for name, limb in limbs.items()}
    places: dict[tuple[str, ...], Any] = {("body",): data.get("body"), **written_parts}
    found = list[AutoLoads]()
    for place, written in places.items():
        if isinstance(written, dict) and written.get("water") in ("auto", {"auto": True}):
            name = next(one for one in description.parts if re.fullmatch(f"{place[-1]}(1(_1)*)?", one))
            given = written.get("loads") or {}
            chosen = {key: load for key, load in description.parts[name].loads.items() if key not in given}
            found.append(AutoLoads(name, place, chosen))
    return found


def write_auto_loads(path: Path, chosen: list[AutoLoads]) -> None:
    """Write loads into a robot file in place of `water: auto`; all else in it stays, comments too.

    Raises InputError where that does not give the same robot, as where a part is written once for several.
    """
    source, text = str(path), read_text(path)
    ends = "\r\n" if "\r\n" in text else "\n"
    text = _AS_GROUP.sub(r"water: auto\1", text.replace("\r\n", "\n"))
    data, _ = read_yaml(text, source)
    before = load_robot(path)
    for one in chosen:
        group = data
        for step in one.place:
            group = group[step]
        water, loads = (*one.place, "water"), (*one.place, "loads")
        if "loads" not in group:
            text = replaced_field(text, source, water, "loads", one.texts)
            continue
        if one.texts and group["loads"]:
            text = added_fields(text, source, loads, one.texts)
        elif one.texts:
            text = replaced_field(text, source, loads, "loads", one.texts)
        text = replaced_field(text, source, water, "", {})

    def written(temporary: Path) -> None:
        temporary.write_text(text, encoding="utf-8", newline=ends)
        if load_robot(temporary) != before:
            why = "cannot be written out: one part is written for several. Write its loads."
            raise InputError(why, file=source)

    write_atomic(path, written)


def _flow(value: Any) -> str:
    """Plain data on one line of YAML; texts are as they are written, and those of loads hold no marks."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    return "[" + ", ".join(map(_flow, value)) + "]" if isinstance(value, list) else str(value)
