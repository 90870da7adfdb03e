"""JSON Schemas of files, with which editors complete fields, explain them and mark mistakes.

Keywords are those of draft 7, which editors know best. A choice by kind is a row of conditions, so that an editor
completes and checks the fields of the kind that is written, not those of all of them.
"""

import ast
import inspect
import textwrap
from functools import cache
from itertools import pairwise
from typing import Any, get_args, get_origin

from pydantic import BaseModel, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema

from nectosome.io.discovery import first_paragraph, plain_words
from nectosome.io.schema.described import NameOrGroup
from nectosome.io.schema.structure import Slot, slot, to_plain
from nectosome.io.schema.validate import NAMING
from nectosome.units import DIMENSIONS

_KIND = "Which of these it is."
_BASE = "http://json-schema.org/draft-07/schema#"


def explained(model: type[BaseModel], field: str) -> str:
    """Return what the class of a field, the model or one above it, says below the field; empty where it says nothing.

    A model made of a dataclass names it as `described_in`. Where a name may stand, the classes so named say theirs.
    """
    classes = [c for cls in model.__mro__ for c in (cls, *getattr(getattr(cls, "described_in", None), "__mro__", ()))]
    info = model.model_fields.get(field)
    marks = [mark for mark in (info.metadata if info else ()) if isinstance(mark, NameOrGroup)]
    named = [first_paragraph(cls) for mark in marks for cls in mark.named(info and info.annotation)]
    return " ".join([*(words[field] for words in map(_field_words, classes) if field in words)][:1] + named)


@cache
def _field_words(cls: type) -> dict[str, str]:
    """The docstrings below the fields that a class defines itself."""
    origin = getattr(cls, "__pydantic_generic_metadata__", {}).get("origin") or cls
    try:
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(origin))).body
    except (OSError, TypeError):  # a class that was made without a source
        return {}
    assert isinstance(tree, ast.ClassDef)
    words = {}
    for field, below in pairwise(tree.body):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name) and isinstance(below, ast.Expr):
            assert isinstance(below.value, ast.Constant)
            words[field.target.id] = plain_words(str(below.value.value))
    return words


def json_schema(model: Any) -> dict[str, Any]:
    """Return the JSON Schema of a file that `model`, or a choice of models, describes."""
    schema = TypeAdapter(model).json_schema(schema_generator=_ForEditors)
    definitions = schema.pop("$defs", {})
    if "$ref" in schema:  # the file itself stands at the top
        schema = definitions.pop(schema["$ref"].rpartition("/")[2])
    return {"$schema": _BASE, **schema, "$defs": definitions}


class _ForEditors(GenerateJsonSchema):
    """Says of each field what it is, its unit, its range and its default, as a person writes it."""

    def model_schema(self, schema: Any) -> dict[str, Any]:
        body = super().model_schema(schema)
        model = schema["cls"]
        body.pop("title", None)
        body["description"] = first_paragraph(model)
        for name, shown in body["properties"].items():
            field = model.model_fields[name]
            here = slot(field.annotation, tuple(field.metadata))
            shown.pop("title", None)
            if name == "kind" and "const" in shown:
                continue  # explained where it is chosen
            words = [explained(model, name), _measured(here)]
            if shown.pop("default", None) is not None:
                default = to_plain(field.get_default(call_default_factory=True), here)
                if default not in ("", [], {}, ()):
                    shown["default"] = default
                    words.append(f"Default: {_as_written(default)}.")
            shown["description"] = "\n\n".join(word for word in words if word)
        return body

    def nullable_schema(self, schema: Any) -> dict[str, Any]:
        return self.generate_inner(schema["schema"])  # what has no value is left out of a file

    def tuple_schema(self, schema: Any) -> dict[str, Any]:
        row = super().tuple_schema(schema)
        if items := row.pop("prefixItems", None):
            row["items"] = items[0]  # all are alike
        return row

    def dict_schema(self, schema: Any) -> dict[str, Any]:
        group = super().dict_schema(schema)
        if patterns := group.pop("patternProperties", None):
            ((pattern, values),) = patterns.items()
            names = {"pattern": pattern, "errorMessage": NAMING}
            group |= {"additionalProperties": values, "propertyNames": names}
        return group

    def tagged_union_schema(self, schema: Any) -> dict[str, Any]:
        metadata = schema.get("metadata", {})
        default = metadata.get("default")
        if callable(schema["discriminator"]) and default is None:  # names or groups of fields
            return {"anyOf": [self.generate_inner(choice) for choice in schema["choices"].values()]}
        fitting = metadata.get("fitting", schema["choices"])
        parts = {kind: self.generate_inner(schema["choices"][kind]) for kind in fitting}
        models = [self.get_schema_from_definitions(part["$ref"]) or {} for part in parts.values()]
        about = [model.get("description", "") for model in models]
        kind = {"description": _KIND, "enum": [*parts], "enumDescriptions": about}
        rules = [
            {"if": {"properties": {"kind": {"const": name}}, "required": ["kind"]}, "then": part}
            for name, part in parts.items()
        ]
        if default is None:
            return {"type": "object", "properties": {"kind": kind}, "required": ["kind"], "allOf": rules}
        rules.append({"if": {"not": {"required": ["kind"]}}, "then": parts[default]})
        return {"type": "object", "properties": {"kind": kind}, "allOf": rules}


def _measured(here: Slot) -> str:
    """The quantity of a field, its unit and its range; empty where it has none."""
    if here.quantity is not None:
        kind = DIMENSIONS[here.quantity.dimension]
        unit = f" [{kind.unit}]" if kind.unit else ""
        bounded = here.quantity.minimum is not None or here.quantity.maximum is not None
        return f"{kind.name.capitalize()}{unit}{', ' + here.quantity.allowed() if bounded else ''}."
    origin, args = get_origin(here.hint), get_args(here.hint)
    if origin is tuple and (inner := _measured(slot(args[0]))):
        return f"{'A list' if args[-1] is Ellipsis else f'{len(args)} values'}, each: {inner[0].lower()}{inner[1:]}"
    return ""


def _as_written(default: Any) -> str:
    if isinstance(default, list):
        return f"[{', '.join(map(_as_written, default))}]"
    if isinstance(default, dict):
        return f"{{{', '.join(f'{key}: {_as_written(value)}' for key, value in default.items())}}}"
    return {True: "true", False: "false"}.get(default, str(default)) if isinstance(default, bool) else str(default)
