"""Names of a room with their signatures and docstrings, read from the source without importing it."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import griffe

SOURCE = Path(__file__).parents[2] / "src"
_WIDTH = 100
_HELPERS = ("nectosome._renamed", "nectosome.io.discovery")  # what rooms are made with


@cache
def _package() -> griffe.Module:
    package = griffe.load("nectosome", search_paths=[str(SOURCE)])
    assert isinstance(package, griffe.Module)
    return package


def room(name: str) -> str:
    """All that a room and the packages in it offer by name."""
    found = _package()[name]
    return "\n\n".join(part for module in _packages(found) for part in _names(module, found))


def face() -> str:
    """The names of the package itself: what each is, and the page of its room."""
    rows = ["| name | what | room |", "|---|---|---|"]
    for name in offered(_package()):
        member = _resolved(_package()[name])
        room = member.path.split(".")[1]
        first = member.docstring.value.partition("\n\n")[0] if member.docstring else ""
        rows.append(f"| [`ns.{name}`]({room}.md#{name.lower()}) | {_cell(first)} | `{room}` |")
    return "\n".join(rows)


def _resolved(member: griffe.Object | griffe.Alias) -> griffe.Object:
    """What a name stands for; a file `design.py` that holds `design` hides it from its room."""
    while isinstance(member, griffe.Alias | griffe.Module):
        member = (
            member[member.name]
            if isinstance(member, griffe.Module)
            else _package()[member.target_path.removeprefix("nectosome.")]
        )
    return member


def _packages(module: griffe.Module) -> Iterator[griffe.Module]:
    """A room, and each package in it that offers names."""
    yield module
    for name in sorted(path.name for path in module.filepath.parent.iterdir() if (path / "__init__.py").exists()):
        inner = _package()[f"{module.name}.{name}"]
        if isinstance(inner, griffe.Module) and offered(inner):
            yield inner


def _names(module: griffe.Module, room: griffe.Module) -> Iterator[str]:
    if module is not room:
        yield f"## nectosome.{module.path.removeprefix('nectosome.')}"
        yield module.docstring.value if module.docstring else ""
    for name in offered(module):
        yield from _entry(_resolved(module[name]), name, 3)


def offered(module: griffe.Module) -> list[str]:
    """Names that a room offers: those of `__all__`, or all that it imports of the package, also as they are used."""
    if module.exports:
        return [str(name) for name in module.exports]
    found = set[str]()
    for node in ast.walk(ast.parse(Path(str(module.filepath)).read_text(encoding="utf-8"))):
        if not isinstance(node, ast.ImportFrom) or not (node.level or (node.module or "").startswith("nectosome.")):
            continue
        for alias in node.names if node.module not in _HELPERS else ():
            own = offered(module[node.module or ""]) if alias.name == "*" else [alias.asname or alias.name]
            found |= {name for name in own if not name.startswith("_")}
    return sorted(found)


def _entry(member: griffe.Object, name: str, level: int) -> Iterator[str]:
    """Heading, signature, docstring; of a class its fields and methods too."""
    yield f"{'#' * level} {name}"
    if isinstance(member, griffe.Function):
        yield f"```python\n{_signature(member, name)}\n```"
    elif isinstance(member, griffe.Attribute) and member.annotation is not None:
        yield f"```python\n{name}: {member.annotation}\n```"
    if member.docstring:
        yield member.docstring.value
    elif isinstance(member, griffe.Attribute):
        yield comment(member)
    if isinstance(member, griffe.Class):
        fields = [
            f"| `{field.name}` | `{_cell(str(field.annotation))}` | {_cell(comment(field))} |"
            for field in member.attributes.values()
            if not field.name.startswith("_") and field.annotation is not None
        ]
        if fields:
            yield "\n".join(["| field | type | what |", "|---|---|---|", *fields])
        for method in member.functions.values():
            if not method.name.startswith("_") and method.docstring:
                yield from _entry(method, f"{name}.{method.name}", level + 1)


def comment(attribute: griffe.Attribute) -> str:
    """What is said of a field: its docstring, or the comment on its last line, where its unit stands."""
    if attribute.docstring:
        return " ".join(attribute.docstring.value.split())
    if not attribute.endlineno:
        return ""
    line = attribute.lines_collection[attribute.filepath][attribute.endlineno - 1]
    text = line.partition("  # ")[2].strip()
    return "" if text.startswith("noqa") else text


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _signature(function: griffe.Function, name: str) -> str:
    """As it is called, a line a parameter where it is long."""
    whole = function.signature(name=name)
    if len(whole) <= _WIDTH:
        return whole
    last = f"-> {function.returns}" if function.returns is not None else ""
    inner = whole[len(name) + 1 : whole.rindex(")")]
    depth, lines, line = 0, [], ""
    for sign in inner:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            lines.append(f"    {line.strip()},")
            line = ""
        else:
            line += sign
    return "\n".join([f"{name}(", *lines, f"    {line.strip()},", f") {last}".rstrip()])
