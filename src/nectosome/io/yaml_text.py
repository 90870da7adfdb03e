"""YAML text to plain data with line numbers, and back; only text, numbers, lists and mappings are allowed."""

import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nectosome.io.file_system import read_bytes
from nectosome.units import InputError, shorten

MAX_BYTES = 4_000_000  # those of fifty meshes with all that was measured of them
MAX_DEPTH = 30
MAX_VALUES = 20_000

Key = tuple[str | int, ...]


def read_text(path: str | Path) -> str:
    """Return the text of a small file. Raises InputError if it is missing, not text, or too large."""
    source, raw = str(path), read_bytes(path, MAX_BYTES + 1)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("this is not a text file.", file=source) from None
    if len(raw) > MAX_BYTES:
        raise InputError(f"larger than {MAX_BYTES // 1_000_000} MB, which is too large.", file=source)
    return text


def read_yaml(text: str, source: str) -> tuple[Any, dict[Key, int]]:
    """Return the data in `text` and the line number (from 1) of each value or key, by path.

    Anchors may repeat a value. Raises InputError for invalid YAML, duplicate keys, unknown tags, and too deeply nested
    or too large data.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.composer import Composer
    from ruamel.yaml.error import MarkedYAMLError, YAMLError
    from ruamel.yaml.scanner import Scanner

    class Limited(Composer):
        """Stops at too many nodes, names of fields among them, since each takes a while."""

        count = 0

        def compose_node(self, parent: Any, index: Any) -> Any:
            self.count += 1
            if self.count > 2 * MAX_VALUES:
                line = self.parser.peek_event().start_mark.line + 1
                raise InputError(f"too large: at most {MAX_VALUES} values are read.", file=source, line=line)
            return super().compose_node(parent, index)

    class Shallow(Scanner):
        """Stops at brackets that are nested too deeply, of which each takes longer than the one around it."""

        def fetch_flow_collection_start(self, TokenClass: Any, to_push: str) -> None:
            if self.flow_level > MAX_DEPTH:
                raise InputError("nested too deeply.", file=source, line=self.reader.line + 1)
            super().fetch_flow_collection_start(TokenClass, to_push)

    try:
        yaml = YAML(typ="safe", pure=True)
        yaml.Composer, yaml.Scanner = Limited, Shallow
        node = yaml.compose(text)
        reader = _Reader(source, yaml.constructor)
        return (None if node is None else reader.value(node, ())), reader.lines
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        why = " ".join(str(error.problem or error.context or "it breaks off").split())
        line = mark.line + 1 if mark is not None else None
        raise InputError(f"this is not YAML: {shorten(why, 120)}.", file=source, line=line) from None
    except RecursionError:
        raise InputError("nested too deeply.", file=source) from None
    except (YAMLError, ValueError) as error:
        why = shorten(str(error).splitlines()[0] if str(error) else "it cannot be read", 120)
        raise InputError(f"this is not YAML: {why}.", file=source) from None


def replaced_value(text: str, source: str, path: Key, value: str) -> str:
    """Return YAML text with another value of one field, put into its group where it is not there; all else stays.

    Raises InputError where the group is not there, and where the value is not a single one.
    """
    node = _group(text, path[:-1])
    if node is None or not node.value:
        raise InputError(f"has no group {'.'.join(map(str, path[:-1]))}.", file=source)
    scalar = _below(node, path[-1])
    if scalar is not None:
        if scalar.id != "scalar":
            raise InputError("is no single value.", file=source, field=".".join(map(str, path)))
        return text[: scalar.start_mark.index] + value + text[scalar.end_mark.index :]
    first = node.value[0][0].start_mark
    end = ", " if node.flow_style else "\n" + " " * first.column
    return text[: first.index] + f"{path[-1]}: {value}{end}" + text[first.index :]


def replaced_field(text: str, source: str, path: Key, name: str, items: Mapping[str, str]) -> str:
    """Return YAML text with a group of another name in place of a field, or without that field where it has no items.

    All else stays, and so do comments beside it. Raises InputError where it is not there.
    """
    group = _group(text, path[:-1])
    found = next(((key, value) for key, value in group.value if key.value == path[-1]), None) if group else None
    if group is None or found is None:
        raise InputError(
            "cannot be replaced: it is written for several places at once.", file=source, field=".".join(map(str, path))
        )
    (key, value), column = found, found[0].start_mark.column
    before, after = text[: key.start_mark.index], text[value.end_mark.index :]
    if group.flow_style:
        if items:
            return f"{before}{name}: {{{', '.join(f'{key}: {value}' for key, value in items.items())}}}{after}"
        rest = re.sub(r"^\s*,\s*", "", after)
        return (before if rest != after else re.sub(r",\s*$", "", before)) + rest
    line, _, others = after.partition("\n")
    if items:
        return f"{before}{name}:{line.rstrip()}\n{_lines(items, column + 2)}{others}"
    return f"{before}{line.lstrip()}\n{others}" if line.strip() else before.rstrip(" ") + others


def added_fields(text: str, source: str, path: Key, items: Mapping[str, str]) -> str:
    """Return YAML text with more fields at the beginning of a group that has some.

    Raises InputError where that is not there.
    """
    group = _group(text, path)
    if group is None or not group.value:
        raise InputError("has no fields.", file=source, field=".".join(map(str, path)))
    if group.flow_style:
        first = group.value[0][0].start_mark.index
        return text[:first] + "".join(f"{key}: {value}, " for key, value in items.items()) + text[first:]
    above = _group(text, path[:-1])
    start = next(key for key, _ in above.value if key.value == path[-1]).end_mark.index
    line = text.index("\n", start) + 1
    return text[:line] + _lines(items, group.value[0][0].start_mark.column) + text[line:]


def _lines(items: Mapping[str, str], column: int) -> str:
    return "".join(f"{' ' * column}{key}: {value}\n" for key, value in items.items())


def _group(text: str, path: Key) -> Any:
    """The node of a group; None where none is there."""
    from ruamel.yaml import YAML

    node = YAML(typ="safe", pure=True).compose(text)
    for step in path:
        node = _below(node, step)
    return node if node is not None and node.id == "mapping" else None


def _below(node: Any, step: str | int) -> Any:
    """The node of a field or an item; None where it is not there."""
    if node is None:
        return None
    if node.id == "sequence" and isinstance(step, int):
        return node.value[step] if step < len(node.value) else None
    return next((below for key, below in node.value if key.value == step), None) if node.id == "mapping" else None


def write_yaml(data: Any) -> str:
    """Return plain `data` as YAML text: mappings over several lines, lists on one line."""
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 10_000  # one value, one line
    stream = io.StringIO()
    yaml.dump(_styled(data), stream)
    return stream.getvalue()


def _styled(data: Any) -> Any:
    from ruamel.yaml.comments import CommentedSeq
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString

    if isinstance(data, dict):
        return {key: _styled(value) for key, value in data.items()}
    if isinstance(data, list):
        row = CommentedSeq(_styled(item) for item in data)
        row.fa.set_flow_style()
        return row
    if isinstance(data, str) and not data.isprintable():
        return DoubleQuotedScalarString(data)  # other styles would fold unusual line ends
    return data


class _Reader:
    """Converts the nodes of one file to data."""

    def __init__(self, source: str, constructor: Any):
        self.source, self.constructor = source, constructor
        self.lines: dict[Key, int] = {}
        self.count = 0

    def value(self, node: Any, path: Key) -> Any:
        self.lines.setdefault(path, node.start_mark.line + 1)
        self.count += 1
        if len(path) > MAX_DEPTH or self.count > MAX_VALUES:
            what = "nested too deeply" if len(path) > MAX_DEPTH else "too large"
            raise self.error(f"{what}.", node)
        kind = str(node.tag).rpartition(":")[2]
        if node.id == "mapping":
            return self.mapping(node, path)
        if node.id == "sequence":
            return [self.value(item, (*path, i)) for i, item in enumerate(node.value)]
        if kind == "int":
            if len(node.value) > 4000:
                raise self.error("this number has too many digits.", node)
            return self.constructor.construct_yaml_int(node)
        if kind == "float":
            return self.constructor.construct_yaml_float(node)
        if kind == "bool":
            return self.constructor.construct_yaml_bool(node)
        if kind == "null":
            return None
        if kind in ("str", "timestamp", "value", "merge"):
            return self.text(node)
        raise self.error(f'the tag "{shorten(node.tag)}" is not used here. Leave it out.', node)

    def text(self, node: Any) -> str:
        """The text of a node, in which JSON may write a character as two halves, as in `\\ud83d\\udc1f`."""
        try:
            return str(node.value).encode("utf-16", "surrogatepass").decode("utf-16")
        except UnicodeDecodeError:
            raise self.error("this has half a character, a lone surrogate. Write it as a whole.", node) from None

    def mapping(self, node: Any, path: Key) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if key_node.id != "scalar":
                raise self.error("a name is expected before the colon.", key_node)
            key = self.text(key_node)
            if key in result:
                first = self.lines[(*path, key)]
                raise self.error(f'"{shorten(key)}" occurs twice here, first in line {first}.', key_node)
            self.lines[(*path, key)] = key_node.start_mark.line + 1
            result[key] = self.value(value_node, (*path, key))
        return result

    def error(self, message: str, node: Any) -> InputError:
        return InputError(message, file=self.source, line=node.start_mark.line + 1)
