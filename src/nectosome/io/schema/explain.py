"""What a field means in words: the docstring below it in the source of its class."""

import ast
import inspect
import textwrap
from functools import cache
from itertools import pairwise

from pydantic import BaseModel

from nectosome.io.schema.described import NameOrGroup


def explained(model: type[BaseModel], field: str) -> str:
    """Return what the class of a field, the model or one above it, says below the field; empty where it says nothing.

    A model made of a dataclass names it as `described_in`. Where a name may stand, the classes so named say theirs.
    """
    classes = [c for cls in model.__mro__ for c in (cls, *getattr(getattr(cls, "described_in", None), "__mro__", ()))]
    info = model.model_fields.get(field)
    marks = [mark for mark in (info.metadata if info else ()) if isinstance(mark, NameOrGroup)]
    named = [first_paragraph(cls) for mark in marks for cls in mark.named(info and info.annotation)]
    return " ".join([*(words[field] for words in map(_field_words, classes) if field in words)][:1] + named)


def first_paragraph(model: type) -> str:
    """Return the first paragraph of a class's docstring, as one line."""
    return plain_words((model.__doc__ or "").split("\n\n", maxsplit=1)[0])


def plain_words(text: str) -> str:
    """Return a text on one line, without marks of code."""
    return " ".join(text.replace("`", "").split())


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
