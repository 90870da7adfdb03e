"""What is added by writing it: the modules of a package are loaded, and the classes below a base are found."""

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules
from typing import TypeVar

T = TypeVar("T")


def load_modules(package: str) -> list[str]:
    """Import every module of a package, so that the classes in them are known; return their full names."""
    names = [module.name for module in iter_modules(import_module(package).__path__, f"{package}.")]
    for name in names:
        import_module(name)
    return names


def classes_below(base: type[T]) -> Iterator[type[T]]:
    """Classes that derive from `base`, however far, in the order of their definition; only those of loaded modules."""
    for cls in base.__subclasses__():
        yield cls
        yield from classes_below(cls)


def first_paragraph(model: type) -> str:
    """Return the first paragraph of a class's docstring, as one line."""
    return plain_words((model.__doc__ or "").split("\n\n", maxsplit=1)[0])


def plain_words(text: str) -> str:
    """Return a text on one line, without marks of code."""
    return " ".join(text.replace("`", "").split())
