"""Tables of the fields of every kind of file, of quantities and of units."""

from importlib import import_module
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel

from nectosome.cli.schema import model_of
from nectosome.description.loads import LoadDescription
from nectosome.description.ranges import NUMBERS
from nectosome.description.signal_contract import SignalOf
from nectosome.description.which_load import ROWS
from nectosome.designs import QUANTITIES
from nectosome.io.discovery import first_paragraph
from nectosome.io.schema.described import Described
from nectosome.io.schema.editor import explained
from nectosome.io.schema.kinds import KINDS
from nectosome.io.schema.quantity import QuantityOrGroup
from nectosome.io.schema.structure import Slot, models_in, slot, to_plain
from nectosome.rigs.planned_signals import PlannedKinds, PlannedSignal
from nectosome.units import DIMENSIONS, show_quantity


def tables(kind: str) -> str:
    """A table for each model of a kind of file; those of a robot in sections."""
    parts = []
    found = [*dict.fromkeys(map(_generic, models_in(model_of(kind))))]
    for home in {model.__module__: None for model in found}:
        if kind == "robot":
            about = (import_module(home).__doc__ or "").splitlines()[0]
            title, _, rest = about.partition(": ")
            parts += [f"## {title.rstrip('.')}", f"{rest[:1].upper()}{rest[1:]}"]
        for model in found:
            if model.__module__ == home:
                parts += [f"### {words(model)}", prose(model.__doc__ or ""), _table(model)]
    return "\n\n".join(parts) + "\n"


def file_kinds() -> str:
    """A row for each kind of file that people write."""
    rows = ["| file | command that takes it | a file to start from |", "|---|---|---|"]
    for kind in KINDS.values():
        title = kind.title.partition(" ")[2]
        start = "`nectosome new`" if kind.name == "robot" else f"`nectosome new {kind.name}`"
        rows.append(f"| {title} | `{kind.command}` | {start} |")
    return "\n".join(rows)


def which_load() -> str:
    """A row for each part in the water: the loads that fit it, and where."""
    rows = [f"| {row.part} | {row.loads} | {row.regime} | {row.leaves_out} |" for row in ROWS.values()]
    return "\n".join(["| the part | loads | in which regime | what it leaves out |", "|---|---|---|---|", *rows])


def ranges() -> str:
    """A row for each range of each kind of load."""
    rows = ["| load | number | range | what happens beyond | source |", "|---|---|---|---|---|"]
    for load in models_in(model_of("robot")):
        for one in getattr(load, "ranges", ()):
            number = NUMBERS[one.number]
            if one.number == "reynolds":
                number = f"{number} of the {load.reynolds_length}"
            kind = get_args(load.model_fields["kind"].annotation)[0]
            rows.append(f"| `{kind}` | {number} | {one.words} | {one.beyond} | {one.source} |")
    return "\n".join(rows)


def spreads() -> str:
    """A row for each number of a robot file that nobody knows well."""
    rows = ["| of | field | 95 % of cases lie between | source | what tells it better |", "|---|---|---|---|---|"]
    seen = set[tuple[str, str]]()
    for model in models_in(model_of("robot")):
        if not issubclass(model, Described) or not model.spreads:
            continue
        owner = next(cls for cls in model.__mro__ if "spreads" in vars(cls))
        name = words(owner).lower().removesuffix(" description")
        if issubclass(model, LoadDescription):
            name = f"`{get_args(model.model_fields['kind'].annotation)[0]}`"
        for field, one in model.spreads.items():
            if field not in model.model_fields or (name, field) in seen:
                continue
            seen.add((name, field))
            ends = f"{one.low:g} to {one.high:g} times the value"
            if one.absolute:
                dimension = slot(model).child(field, None).quantity.dimension  # type: ignore[union-attr]
                ends = " to ".join(show_quantity(end, dimension) for end in (one.low, one.high))
            rows.append(f"| {name} | `{field}` | {ends} | {one.source} | {one.experiment} |")
    return "\n".join(rows)


def _generic(model: type[BaseModel]) -> type[BaseModel]:
    """The class of a signal, whatever its quantity."""
    return model.__pydantic_generic_metadata__["origin"] or model


def words(model: type[BaseModel]) -> str:
    """Name of a model for people: LumpedDragLoad is a lumped drag load."""
    name = "".join(f" {c.lower()}" if c.isupper() else c for c in model.__name__).strip()
    return name[:1].upper() + name[1:]


def anchor(model: type[BaseModel]) -> str:
    """Name of its section."""
    return words(model).lower().replace(" ", "-")


def prose(text: str) -> str:
    """Docstring without its indent."""
    return "\n".join(line.strip() for line in text.strip().splitlines())


def _table(model: type[BaseModel]) -> str:
    rows = ["| field | what | as | unit | range | if left out |", "|---|---|---|---|---|---|"]
    for name, field in model.model_fields.items():
        here = slot(field.annotation, tuple(field.metadata))
        what, unit, allowed = meaning(here)
        default = "**needed**" if field.is_required() else _default(field.get_default(call_default_factory=True), here)
        about = explained(model, name).replace("|", "\\|")
        rows.append(f"| `{name}` | {about} | {what} | {unit} | {allowed} | {default} |")
    return "\n".join(rows)


def _default(value: Any, here: Slot) -> str:
    if value is None or (not isinstance(value, BaseModel) and not isinstance(value, float | int) and not value):
        return "none"
    plain = to_plain(value, here)
    if isinstance(plain, list):
        return f"`[{', '.join(map(str, plain))}]`"
    if isinstance(plain, dict):
        inner = ", ".join(f"{k}: {v}" for k, v in plain.items())
        return f"`{{{inner}}}`" if inner else "its own defaults"
    return f"`{plain:g}`" if isinstance(plain, float) else f"`{plain}`"


def meaning(here: Slot) -> tuple[str, str, str]:
    """What belongs into a field, its SI unit, its range."""
    q = here.quantity
    if q is not None:
        kind = DIMENSIONS[q.dimension]
        bounded = q.minimum is not None or q.maximum is not None
        also = f" or [{words(q.group).lower()}](#{anchor(q.group)})" if isinstance(q, QuantityOrGroup) else ""
        return kind.name + also, kind.unit, q.allowed() if bounded else "any"
    if any(type(m).__name__ == "_PlaceField" for m in here.metadata):
        return "`tip`, `root`, or one of the rod's marks", "", ""
    hint, args = here.hint, get_args(here.hint)
    origin = get_origin(hint)
    signal = next((mark for mark in here.metadata if isinstance(mark, SignalOf)), None)
    if signal is not None:
        of = slot(signal.quantity).quantity
        kind = "smooth [signal](#signals)" if signal.motion else "[signal](#signals)"
        return f"{kind} of {DIMENSIONS[of.dimension].with_article()}", "", ""
    if isinstance(hint, TypeVar):
        return {"Q": "the quantity", "S": "its rate", "T": "a signal of the quantity"}[hint.__name__], "", ""
    if isinstance(hint, type) and issubclass(hint, BaseModel):
        quantity = f" of {DIMENSIONS[hint.dimension].with_article()}" if _generic(hint) is not hint else ""
        return f"[{words(_generic(hint)).lower()}](#{anchor(_generic(hint))}){quantity}", "", ""
    if origin in (Union, UnionType):
        choices = [a for a in args if a is not NoneType]
        if len(choices) == 1:
            return meaning(slot(choices[0], tuple(here.metadata)))
        links = [meaning(slot(a))[0] for a in choices]
        return f"{', '.join(links[:-1])} or {links[-1]}", "", ""
    if origin is Literal:
        return " or ".join(f"`{a}`" for a in args), "", ""
    if origin is dict:
        what, unit, allowed = meaning(slot(args[1]))
        keys = meaning(slot(args[0]))[0] if get_origin(slot(args[0]).hint) is Literal else "name"
        return f"{keys}: {what}", unit, allowed
    if origin is tuple:
        what, unit, allowed = meaning(slot(args[0]))
        if any(type(m).__name__ == "NamedAxis" for m in here.metadata):
            return "`x`, `y`, `z` or three numbers", "", "not all zero"
        if args[-1] is Ellipsis:
            short = any(type(m).__name__ == "OneOrMany" for m in here.metadata)
            return f"{'one or ' if short else ''}several: {what}", unit, allowed
        each = [meaning(slot(arg)) for arg in args]
        if any(one[2] != allowed for one in each):
            told = [f"{name}, {limits}" if limits else name for name, _, limits in each]
            return "; ".join(told), unit, ""
        return f"{len(args)} x {what}", unit, allowed
    names = {int: "whole number", float: "number", str: "text", bool: "yes or no"}
    return names[hint], "", _limits(here)


def _limits(here: Slot) -> str:
    words = {"ge": "at least", "gt": "more than", "le": "at most", "lt": "less than"}
    found = [f"{text} {getattr(m, key)}" for m in here.metadata for key, text in words.items() if hasattr(m, key)]
    return ", ".join(found)


def signals() -> str:
    """A row for each kind of signal that a plan plays."""
    rows = ["| kind | what | fields; those behind the semicolon may be left out |", "|---|---|---|"]
    for kind, model in PlannedKinds().kinds(PlannedSignal).items():
        own = {name: field.is_required() for name, field in model.model_fields.items() if name != "kind"}
        needed, others = (", ".join(f"`{name}`" for name in own if own[name] is given) for given in (True, False))
        what = first_paragraph(model).replace(" [SI; SI/s]", "").replace(" [SI; Hz; rad]", "").replace(" [SI]", "")
        rows.append(f"| `{kind}` | {what} | {'; '.join(filter(None, (needed, others)))} |")
    return "\n".join(rows)


def units() -> str:
    """Kinds of quantity, their SI units, and how they may be written."""
    rows = ["| quantity | SI unit | as in |", "|---|---|---|"]
    for kind in DIMENSIONS.values():
        example = kind.example.replace('"', "`")
        rows.append(f"| {kind.name} | {kind.unit or '1'} | {example} |")
    return "\n".join(rows) + "\n"


def quantities() -> str:
    """What a design may want or limit."""
    rows = ["| quantity | what | unit | wanted |", "|---|---|---|---|"]
    for q in QUANTITIES.values():
        rows.append(f"| `{q.name}` | {q.about} | {q.unit} | {q.best} |")
    return "\n".join(rows) + "\n"
