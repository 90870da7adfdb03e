"""Source files that a traced program depends on: those of its function and of its classes, and all that these import.

Imports are read from the text, so that constants and functions count as classes do; those within functions, which read
files, do not. `from package import name` leads to the module of the package in which the name is; a package that is
imported as such counts with all of its modules.
"""

import os
import re
import sys
import sysconfig
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from nectosome.io.file_system import entries

_IMPORT = re.compile(r"^(?:from[ \t]+([.\w]+)[ \t]+import[ \t]+(\([^)]*\)|[^\n#]+)|import[ \t]+([.\w]+))", re.MULTILINE)
_NAME = re.compile(r"(\w+)(?:[ \t]+as[ \t]+(\w+))?[ \t]*(?:,|$)")
_INSTALLED = tuple(sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib"))
_PACKAGE = Path(__file__).parents[2]


def sources(modules: Iterable[str]) -> set[Path]:
    """Files of these modules and of all that they import, but for installed packages other than this one."""
    found: set[str] = set()
    ahead = [*modules]
    while ahead:
        module = ahead.pop()
        if module not in found and _file(module) is not None:
            found.add(module)
            ahead += _imported(module)
    return {file for file in map(_file, found) if file is not None}


@cache
def _file(module: str) -> Path | None:
    """File of a module of this package, or of one that is loaded; None where it counts as installed."""
    if module.partition(".")[0] == _PACKAGE.name:
        return _own().get(module)
    name = getattr(sys.modules.get(module), "__file__", None)
    return None if name is None or name.startswith(_INSTALLED) else Path(name)


@cache
def _own() -> dict[str, Path]:
    """Files of this package by the names of its modules: asking for each of 900 names takes longer."""
    start = len(f"{_PACKAGE.parent}/")
    files = entries(_PACKAGE, "**/*.py")
    names = (str(file)[start:].removesuffix(".py").replace(os.sep, ".") for file in files)
    return {name.removesuffix(".__init__"): file for name, file in zip(names, files, strict=True)}


@cache
def _imported(module: str) -> frozenset[str]:
    """Modules that a module imports."""
    out: set[str] = set()
    for base, names in _imports(module):
        if not names:
            out |= _whole(base)
        for name, _ in names:
            out |= _home(base, name)
    return frozenset(out)


@cache
def _imports(module: str) -> tuple[tuple[str, tuple[tuple[str, str], ...]], ...]:
    """Each import of a module: where from, and what, with the names that it has there and here; () for all of it."""
    file = _file(module)
    if file is None or file.suffix != ".py":  # a compiled module of a package that lies on PYTHONPATH
        return ()
    found = []
    for base, names, whole in _IMPORT.findall(file.read_text(encoding="utf-8")):
        package = module if file.name == "__init__.py" else module.rpartition(".")[0]
        above = len(base) - len(base.lstrip("."))
        for _ in range(above - 1):
            package = package.rpartition(".")[0]
        start = ".".join(filter(None, (package, base.lstrip(".")))) if above else base
        lines = (line.partition("#")[0].strip() for line in names.strip("()").splitlines())
        pairs = tuple((name, other or name) for name, other in _NAME.findall(" ".join(lines)))
        found.append((whole or start, () if whole else pairs))
    return tuple(found)


def _home(base: str, name: str) -> set[str]:
    """Modules that `from base import name` leads to."""
    if _file(f"{base}.{name}") is not None:
        return _whole(f"{base}.{name}")
    file = _file(base)
    if file is not None and file.name == "__init__.py":
        for inner, names in _imports(base):
            for there, here in names:
                if here == name and inner != base:
                    return _home(inner, there)
    return {base}


def _whole(module: str) -> set[str]:
    """A module; of a package all of its modules."""
    file = _file(module)
    if file is None or file.name != "__init__.py":
        return {module}
    inside = (path.relative_to(file.parent).with_suffix("").parts for path in entries(file.parent, "**/*.py"))
    return {module, *(".".join((module, *parts)) for parts in inside if parts[-1] != "__init__")}
