"""What an editor marks by a schema: the part of JSON Schema (draft 7) in which ours are written."""

import re
from collections.abc import Iterator
from typing import Any

_SILENT = {"$schema", "$defs", "description", "default", "examples", "enumDescriptions", "errorMessage", "then"}
_TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "integer": int, "number": (int, float)}


def marked(schema: dict[str, Any], value: Any, whole: dict[str, Any], path: str = "") -> Iterator[str]:
    """Yield the path of each mistake in a value; `whole` has the definitions."""
    if "$ref" in schema:  # what stands beside it does not count
        schema = whole["$defs"][schema["$ref"].removeprefix("#/$defs/")]
    for keyword, given in schema.items():
        if keyword in _SILENT:
            continue
        if keyword in _PARTS:
            for part, inner, name in _PARTS[keyword](given, value, schema):
                yield from marked(part, inner, whole, f"{path}.{name}".strip(".") if name else path)
        elif keyword == "anyOf":
            yield from [] if any(fits(part, value, whole) for part in given) else [path]
        elif keyword == "if":
            yield from marked(schema["then"], value, whole, path) if fits(given, value, whole) else ()
        elif not _CHECKS[keyword](given, value):
            yield path


def fits(schema: dict[str, Any], value: Any, whole: dict[str, Any]) -> bool:
    """Whether nothing of a value is marked."""
    return next(marked(schema, value, whole), None) is None


def _is(kind: Any, value: Any) -> bool:
    return isinstance(value, kind) and (kind is bool or not isinstance(value, bool))


def _others(value: Any, schema: dict[str, Any]) -> list[str]:
    return [name for name in value if name not in schema.get("properties", {})] if _is(dict, value) else []


_NEVER: dict[str, Any] = {"enum": []}
# schema, value and name of each part; that of a value that is marked itself has no name
_PARTS = {
    "properties": lambda given, value, _: [(given[k], value[k], k) for k in given if _is(dict, value) and k in value],
    "additionalProperties": lambda given, value, schema: [
        (_NEVER if given is False else given, value[k], k) for k in _others(value, schema) if given is not True
    ],
    "propertyNames": lambda given, value, _: [(given, k, k) for k in value] if _is(dict, value) else [],
    "items": lambda given, value, _: [(given, x, str(k)) for k, x in enumerate(value)] if _is(list, value) else [],
    "allOf": lambda given, value, _: [(part, value, "") for part in given],
}
_NUMBER = _TYPES["number"]
_CHECKS = {
    "type": lambda given, value: any(_is(_TYPES[name], value) for name in ([given] if _is(str, given) else given)),
    "const": lambda given, value: value == given,
    "enum": lambda given, value: value in given,
    "minimum": lambda given, value: not _is(_NUMBER, value) or value >= given,
    "maximum": lambda given, value: not _is(_NUMBER, value) or value <= given,
    "exclusiveMinimum": lambda given, value: not _is(_NUMBER, value) or value > given,
    "exclusiveMaximum": lambda given, value: not _is(_NUMBER, value) or value < given,
    "minLength": lambda given, value: not _is(str, value) or len(value) >= given,
    "maxLength": lambda given, value: not _is(str, value) or len(value) <= given,
    "pattern": lambda given, value: not _is(str, value) or re.search(given, value) is not None,
    "minItems": lambda given, value: not _is(list, value) or len(value) >= given,
    "maxItems": lambda given, value: not _is(list, value) or len(value) <= given,
    "minProperties": lambda given, value: not _is(dict, value) or len(value) >= given,
    "maxProperties": lambda given, value: not _is(dict, value) or len(value) <= given,
    "required": lambda given, value: not _is(dict, value) or all(name in value for name in given),
}
