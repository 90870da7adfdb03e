"""Structures of results as JSON: which containers, with which settings, hold how many numbers in which order.

Unlike a pickle, such a text can name classes and functions only, of modules that are loaded or of this package.
"""

import json
import sys
from collections.abc import Callable
from enum import Enum
from importlib import import_module
from types import FunctionType
from typing import Any

import jax
from jax.tree_util import PyTreeDef, default_registry

Structure = Any  # a PyTreeDef, which types do not know as a class

_PACKAGE = __name__.partition(".")[0]
_LEAF = "number"


def structure_text(structure: Structure) -> str:
    """Return a structure as text. Raises TypeError where it holds what has no text."""
    text = json.dumps(_tree(structure))
    if structure_of(text) != structure:  # a setting that compares otherwise than it reads
        raise TypeError("this structure does not come back from its text")
    return text


def structure_of(text: str) -> Structure:
    """Return the structure of a text. Raises ValueError where it is none."""
    try:
        return _read_tree(json.loads(text))
    except (TypeError, AttributeError, KeyError, IndexError, ImportError, RecursionError) as error:
        raise ValueError(f"no structure: {error}") from error


def _tree(structure: Structure) -> Any:
    data = structure.node_data()
    if data is None:
        return _LEAF
    kind, settings = data
    return [_named(kind), _value(settings), [_tree(child) for child in structure.children()]]


def _read_tree(text: Any) -> Structure:
    if text == _LEAF:
        return PyTreeDef.from_node_data_and_children(default_registry, None, ())
    kind, settings, children = text
    data = (_find(kind), _read_value(settings))
    return PyTreeDef.from_node_data_and_children(default_registry, data, [_read_tree(child) for child in children])


def _value(value: Any) -> Any:
    """A setting as JSON: what JSON has no word for is a list that begins with its kind."""
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, type | FunctionType):
        return ["name", _named(value)]
    if isinstance(value, Enum):
        return ["member", _named(type(value)), value.name]
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return ["fields", _named(type(value)), *map(_value, value)]
    if type(value) in (tuple, list):
        return [type(value).__name__, *map(_value, value)]
    if type(value) is dict:
        return ["dict", *([_value(key), _value(one)] for key, one in value.items())]
    if jax.tree.structure(value).num_leaves == 0:  # such as what stands for a field of a module that is not set
        return ["tree", _tree(jax.tree.structure(value))]
    raise TypeError(f"a {type(value).__name__} has no text")


def _read_value(text: Any) -> Any:
    if not isinstance(text, list):
        return text
    kind, *rest = text
    return _READERS[kind](rest)


def _read_fields(rest: list[Any]) -> Any:
    return _find_below(tuple, rest[0])(*map(_read_value, rest[1:]))


_READERS: dict[str, Callable[[list[Any]], Any]] = {
    "tree": lambda rest: jax.tree.unflatten(_read_tree(rest[0]), ()),
    "name": lambda rest: _find(rest[0]),
    "member": lambda rest: _find_below(Enum, rest[0])[rest[1]],
    "fields": _read_fields,
    "tuple": lambda rest: tuple(map(_read_value, rest)),
    "list": lambda rest: [*map(_read_value, rest)],
    "dict": lambda rest: {_read_value(key): _read_value(one) for key, one in rest},
}


def _named(thing: type | FunctionType) -> str:
    return f"{thing.__module__}:{thing.__qualname__}"


def _find_below(base: type, name: str) -> Any:
    found = _find(name)
    if not (isinstance(found, type) and issubclass(found, base)):
        raise TypeError(f"{name} is no {base.__name__}")
    return found


def _find(name: str) -> Any:
    """The class or function of a name, in a module that is loaded or one of this package."""
    module, _, path = name.partition(":")
    found: Any = type(None) if name == "builtins:NoneType" else sys.modules.get(module)
    if found is None:
        if module.partition(".")[0] != _PACKAGE:
            raise ImportError(f"{module} is not loaded")
        found = import_module(module)
    if found is not type(None):
        for part in path.split("."):
            found = getattr(found, part)
    if not isinstance(found, type | FunctionType):
        raise TypeError(f"{name} is no class")
    return found
