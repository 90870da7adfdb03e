"""`nectosome show`: parts of a robot and its weight in water, or the summary of a saved run."""

import re
from collections import Counter
from typing import Any

from rich.text import Text
from rich.tree import Tree

from nectosome import robots
from nectosome.cli.options import Loads, RobotOrRun
from nectosome.cli.output import Page, write
from nectosome.cli.page import number, origin, summary
from nectosome.cli.weights import PartWeight, hydrostatics, hydrostatics_rows, weigh
from nectosome.description import RobotDescription, get_value, numeric_paths
from nectosome.io import is_results, load_dataset
from nectosome.io.schema.plain import to_plain
from nectosome.units import InputError, count, format_quantity

_PLACED = ("at", "offset", "rotation")
_MOST = 40  # values of a row that are shown


def show(what: RobotOrRun, /, *, outputs: Page = Page(), loads: Loads = False) -> None:
    """Show the parts of a robot and how it lies in the water, or the summary of a saved run."""
    outputs.check()
    if is_results(what):
        _show_run(what, outputs, loads)
        return
    if loads:
        raise InputError("is for a saved run. Leave it out, or see nectosome simulate --loads.", field="--loads")

    description = robots.describe(what)

    from nectosome.model import build

    built = build(description)
    parts = weigh(built, what)
    found = hydrostatics(built)
    whole = hydrostatics_rows(description, built, found)
    write(_tree(description, parts, whole))
    if outputs.given:
        from nectosome.view import show_still, standing

        each = [(part.name, number(part.mass), number(part.displaced), ", ".join(part.freedoms)) for part in parts]
        tables = [[("the robot", ""), *whole], [("part", "mass (kg)", "displaces (kg)", "free to move"), *each]]
        outputs.write(standing(description, built), lambda data, path: show_still(data, path, tables))


def _show_run(path: str, outputs: Page, loads: bool) -> None:
    from nectosome.view.saved import check_run

    dataset = load_dataset(path)
    check_run(dataset, path)
    arrays = {str(name): variable.values for name, variable in dataset.variables.items()}
    write(summary(arrays, dataset.attrs, loads), origin(dataset.attrs))
    if outputs.given:
        from nectosome.view import show_run

        outputs.write(dataset, show_run)


def _tree(description: RobotDescription, parts: list[PartWeight], whole: list[tuple[str, str]]) -> Tree:
    """Return the parts on one another, each with its sizes, masses, joint and loads, and what acts between them.

    `whole` has rows about all parts together.
    """
    weighed = {part.name: part for part in parts}
    plain = to_plain(description)
    tree = Tree(_line(description.name, count(len(weighed), "part")))
    if description.about:
        tree.add(Text(description.about, "dim"))
    water = description.water
    known = {"density": format_quantity(water.density, "density")}
    known |= {"gravity": format_quantity(water.gravity, "acceleration"), **to_plain(water)}
    tree.add(_line("water", _flat(known)))
    for name, text in whole:
        tree.add(_line(name, text))
    branches: dict[str, Tree] = {"world": tree}
    for name, part in description.parts.items():
        parent = tree if name == "body" else branches[part.on]
        branches[name] = _add_part(parent, to_plain(part), weighed[name])
    for name, pair in plain.get("pairs", {}).items():
        tree.add(_line(name, _flat(pair)))
    if description.aliases:
        quantities = numeric_paths(description)
        names = tree.add(_line("aliases", ""))
        for alias, paths in description.aliases.items():
            value = format_quantity(get_value(description, alias), quantities[paths[0]].dimension)
            names.add(_line(f"{alias} = {_short(value)}", ", ".join(paths)))
    return tree


def _add_part(parent: Tree, part: dict[str, Any], weighed: PartWeight) -> Tree:
    placed = {key: part[key] for key in _PLACED if key in part}
    sizes = {key: value for key, value in part.items() if key not in (*_PLACED, "on", "kind", "joint", "loads")}
    shape = sizes.pop("shape", sizes.pop("section", ""))
    branch = parent.add(_line(weighed.name, f"{part['kind']} {shape}, {_flat(sizes)}".removesuffix(", ")))
    branch.add(_line("mass", f"{weighed.mass:.4g} kg, displaces {weighed.displaced:.4g} kg"))
    if placed:
        branch.add(_line("sits", _flat(placed)))
    branch.add(_line("joint", _flat(part.get("joint", {"kind": "fixed"}))))
    if weighed.freedoms:
        kinds = Counter(name.partition(".")[0] for name in weighed.freedoms)
        names = ", ".join(f"{n} {kind}" if n > 1 else kind for kind, n in kinds.items())
        branch.add(_line("moves", f"{count(len(weighed.freedoms), 'degree')} of freedom: {names}"))
    for name, load in part.get("loads", {}).items():
        branch.add(_line(name, _flat(load)))
    return branch


def _line(name: str, text: str) -> Text:
    return Text.assemble((name, "bold"), "  " if text else "", text)


def _flat(value: Any) -> str:
    """Return plain data on one line, its kind first."""
    if isinstance(value, dict):
        kind = str(value.get("kind", "")).replace("_", " ")
        rest = [f"{key.replace('_', ' ')} {_flat(item)}" for key, item in value.items() if key != "kind"]
        return ", ".join([kind, *rest] if kind else rest)
    if isinstance(value, list) and len(value) > _MOST:
        return f"({_flat(value[0])}, ..., {_flat(value[-1])}: {len(value)} values)"
    if isinstance(value, list):
        return f"({', '.join(_flat(item) for item in value)})"
    return _short(str(value))


def _short(text: str) -> str:
    """Return a number and its unit with at most six digits."""
    number, space, unit = text.partition(" ")
    if re.fullmatch(r"[-+]?[\d.]+(e[-+]?\d+)?", number):
        number = f"{float(number):.6g}"
    return f"{number}{space}{unit}"
