"""Some thousand bad robot files, made from a good one by one slip each: every one gets a sentence, none a traceback."""

import copy
import io
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from nectosome.description import numeric_paths, parse_robot
from nectosome.io.yaml_text import read_yaml, write_yaml
from nectosome.units import InputError

TEXT = (Path(__file__).parent / "flagellum.yaml").read_text()
DATA = read_yaml(TEXT, "flagellum.yaml")[0]

SLIPS = {
    "nan": ".nan",
    "infinite": ".inf",
    "nan with a unit": "nan mm",
    "minus infinity": "-.inf",
    "wrong unit": "3 K",
    "unit of another kind": "3 kg m s",
    "unknown unit": "7.4 MP",
    "word": "long",
    "list": "[1, 2]",
    "group": "{value: 1}",
    "null": "null",
    "truth": "true",
    "huge": f"1{400 * '0'}",
    "empty": '""',
}
NAMES_OF_THE_MACHINERY = re.compile(
    r"Rigid|Rod\b|Error|pydantic|Description|tuple|dict\b|NoneType|class|float\b|__|Traceback|validat|_type"
)


def numbers(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Yield the path of every value in which a number stands, with or without a unit."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from numbers(value, (*path, key))
    elif isinstance(data, int | float) or re.match(r"-?\d", str(data)):
        yield path


def groups(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], dict]]:
    if isinstance(data, dict):
        yield path, data
        for key, value in data.items():
            yield from groups(value, (*path, key))


def get(data: Any, path: tuple[str | int, ...]) -> Any:
    for key in path:
        data = data[key]
    return data


def changed(path: tuple[str | int, ...], value: object) -> str:
    """Return the file with another value at `path`, written as in YAML."""
    before, after = around(path)
    return f"{before}{value}{after}"


@cache
def around(path: tuple[str | int, ...]) -> tuple[str, str]:
    """Return the file before and after the value at `path`: writing it takes longer than reading it."""
    data = copy.deepcopy(DATA)
    get(data, path[:-1])[path[-1]] = "VALUE"
    before, after = write_yaml(data).split("VALUE")
    return before, after


def told(text: str) -> InputError:
    """Return what is said of a bad file, and see that it is one readable sentence or two."""
    with pytest.raises(InputError) as caught:
        parse_robot(text, "robot.yaml")
    return readable(caught.value)


def readable(error: InputError) -> InputError:
    message = str(error)
    assert message.startswith("robot.yaml")
    assert message.isprintable()
    assert message.endswith((".", "?"))
    assert len(message) < 400
    assert not NAMES_OF_THE_MACHINERY.search(message), message
    return error


NUMBERS = list(numbers(DATA))
TOLD = {".".join(map(str, path)): path for path in NUMBERS}


def test_the_good_file_is_good():
    parse_robot(TEXT)
    parse_robot(write_yaml(DATA))
    assert len(NUMBERS) >= 40


@pytest.mark.parametrize("name", TOLD)
def test_every_number_may_be_wrong(name):
    path = TOLD[name]
    group = ".".join(map(str, path[:-1]))
    for slip in SLIPS.values():
        error = told(changed(path, slip))
        assert error.line is not None
        assert error.field is not None
        assert error.field.startswith(name) or error.field == group


@pytest.mark.parametrize("name", [n for n, p in TOLD.items() if isinstance(get(DATA, p), str)])
def test_a_bare_number_needs_its_unit(name):
    error = told(changed(TOLD[name], 7.4))
    assert error.field == name
    assert error.message.startswith('"7.4" has no unit. ')


ABOVE = {p: q for p, q in numeric_paths(parse_robot(TEXT)).items() if q.minimum is not None and p in TOLD}


@pytest.mark.parametrize("name", ABOVE)
def test_below_the_range_is_out_of_range(name):
    error = told(changed(TOLD[name], f"{ABOVE[name].minimum - 1} {ABOVE[name].unit}"))
    assert error.field == name
    assert "is out of range: it must be" in error.message
    if ABOVE[name].exclusive:
        assert "it must be more than 0" in told(changed(TOLD[name], 0)).message


@pytest.mark.parametrize("path", [p for p, _ in groups(DATA)], ids=lambda p: ".".join(map(str, p)) or "robot")
def test_every_group_may_have_an_unknown_field(path):
    error = told(changed((*path, "clr"), "red"))
    assert error.field == ".".join(map(str, (*path, "clr")))


MAY_MISS = {
    "about", "water", "density", "gravity", "limbs", "aliases", "on", "joint", "loads", "tangential",
    "lift", "tip_radius", "poisson", "damping", "bend", "motion", "omega", "E", "L", "alpha",
    "shaft", "hook", "filament", "hull", "face", "drag", "torsion", "bending_y", "bending_z",
}  # fmt: skip


def test_every_field_may_be_missing():
    count = 0
    for path, group in groups(DATA):
        for key in group:
            data = copy.deepcopy(DATA)
            del get(data, path)[key]
            text = write_yaml(data)
            if key in MAY_MISS:
                try:
                    parse_robot(text, "robot.yaml")
                except InputError as error:
                    readable(error)
                continue
            count += 1
            if path[-1:] == ("loads",):
                parse_robot(text)
                continue
            field = told(text).field
            assert field is not None
            assert field.startswith(".".join(map(str, path)))
    assert count > 30


@pytest.mark.parametrize(("limb", "on"), [("shaft", "hook"), ("shaft", "shaft"), ("hook", "nobody"), ("filament", 3)])
def test_limbs_sit_on_what_is_there(limb, on):
    assert told(changed(("limbs", limb, "on"), on)).field == f"limbs.{limb}.on"


def test_every_line_may_occur_twice():
    lines = TEXT.splitlines()
    keys = [n for n, line in enumerate(lines) if re.match(r"\s*[a-z_A-Z]+:", line)]
    for n in keys:
        told("\n".join([*lines[: n + 1], lines[n], *lines[n + 1 :]]))


def test_every_line_may_be_lost_or_shifted():
    lines = TEXT.splitlines()
    for n in range(len(lines)):
        good_or_told("\n".join(lines[:n] + lines[n + 1 :]))
        good_or_told("\n".join([*lines[:n], " " + lines[n], *lines[n + 1 :]]))


def test_the_file_may_break_off_anywhere():
    for end in range(0, len(TEXT), 7):
        good_or_told(TEXT[:end])


def test_every_byte_may_be_another():
    for n in range(0, len(TEXT), 37):
        for other in "\t:{[-&\x00é":
            good_or_told(TEXT[:n] + other + TEXT[n + 1 :])


def good_or_told(text: str) -> None:
    """A file that was damaged is told to be so, unless it is a robot all the same: then both ways back agree."""
    try:
        robot = parse_robot(text, "robot.yaml")
    except InputError as error:
        readable(error)
        return
    stream = io.StringIO()
    YAML().dump(YAML(typ="safe", pure=True).load(text), stream)
    assert parse_robot(stream.getvalue()) == robot


def test_a_character_may_be_written_as_two_halves_and_not_as_one():
    """As JSON writes it, which YAML takes too."""
    named = TEXT.replace("name: flagellum", 'name: "\\ud83d\\udc1f"', 1)
    assert parse_robot(named).name == "\U0001f41f"
    for lone in ('"\\ud83d"', '"\\udc1f\\ud83d"'):
        error = told(TEXT.replace("name: flagellum", f"name: {lone}", 1))
        assert error.line is not None and "half a character" in error.message
        assert "half a character" in told(f"{lone}: 3\n{TEXT}").message
