"""A robot that is described and built, as tables: its parts and what they weigh, and what loads take by default."""

import re
from collections import Counter
from typing import Any

from nectosome.core import Assumed, Load
from nectosome.description import Rigid, RobotDescription, Rod, get_value, numeric_paths
from nectosome.description.left_open import CHAIN, start_up_choices
from nectosome.description.meshes import MeshShape
from nectosome.description.plates import PlateShape
from nectosome.description.shape_facts import mesh_branches, mesh_table, plate_branch, plate_table
from nectosome.description.webs import WebDescription
from nectosome.io.schema.structure import to_plain, value_at
from nectosome.io.summary import Summary
from nectosome.io.tables import AXES, Branch, Number, Table
from nectosome.mechanism import PartWeight, Robot
from nectosome.solve.weights import Hydrostatics
from nectosome.units import DIMENSIONS, count, dimension_of, format_quantity, show_quantity

_PLACED = ("at", "offset", "rotation")
_OWN_LINES = "on", "kind", "joint", "drive", "loads"
_FEW_HINGES = f"fewer than {CHAIN} hinges"
_MOST = 40  # values of a row that are shown


def part_table(parts: list[PartWeight]) -> Table:
    """Parts, what they weigh, and which of their coordinates are free."""
    heads = {"part": "part", "mass": "mass", "displaced": "displaces", "free": "free to move"}
    rows = [(one.name, Number(one.mass, "kg"), Number(one.displaced, "kg"), ", ".join(one.freedoms)) for one in parts]
    return Table("parts", heads, rows)


def assumed_table(built: Robot, description: RobotDescription) -> Table:
    """What loads take by default or work out; parts on which it is the same together."""
    choices = start_up_choices(description.parts)
    found = dict[tuple[str, ...], tuple[list[str], str | Number]]()
    for at in built.load_groups.one_by_one():
        part = built.tree.names[at.part]
        described = description.carriers[part].loads.get(at.name)
        if isinstance(at.load, Load) and described is not None:
            why = choices.get((part, at.name))
            chosen = () if why is None else (Assumed("start-up", "none" if why else "yes", why or _FEW_HINGES),)
            for one in (*chosen, *at.load.assumed(described, built.water)):
                value = one.value
                if not isinstance(value, str):
                    number = float(value)
                    shown = show_quantity(number, dimension_of(one.unit)) if one.unit else ""
                    value = Number(number, one.unit, shown=shown)
                same = at.name, one.what, value if isinstance(value, str) else f"{value.value:.6g}", one.source
                found.setdefault(same, ([], value))[0].append(part)
    rows = [
        (
            f"{name.replace('_', ' ')} on {parts[0] if len(parts) == 1 else count(len(parts), 'part')}",
            what,
            value,
            source,
        )
        for (name, what, _, source), (parts, value) in found.items()
    ]
    heads = {"of": "assumed", "what": "what", "value": "value", "source": "source"}
    return Table("assumed", heads, rows, listed=True)


def _centres(found: Hydrostatics) -> Table:
    places = {"mass": found.centre_of_mass, "buoyancy": found.centre_of_buoyancy}
    rows = [(name, *(Number(float(x), "m") for x in place)) for name, place in places.items()]
    return Table("centres", {"of": "centre of", **AXES}, rows)


def robot_facts(
    description: RobotDescription,
    found: Hydrostatics,
    parts: list[PartWeight],
    whole: list[tuple[str, str]],
    assumed: Table,
) -> Summary:
    """The robot, its parts on one another with sizes, masses, joints and loads, batteries, pairs, tendons, and aliases.

    `whole` has rows about all parts together.
    """
    plain, water = to_plain(description), description.water
    known = {"density": format_quantity(water.density, "density")}
    known |= {"gravity": format_quantity(water.gravity, "acceleration"), **to_plain(water)}
    pairs = [(name, _flat(pair)) for name, pair in plain.get("pairs", {}).items()]
    batteries = [(f"battery {name}", _flat(one)) for name, one in plain.get("batteries", {}).items()]
    tendons = [(f"tendon {name}", _flat(one)) for name, one in plain.get("tendons", {}).items()]
    rows = [("water", _flat(known)), *whole, *batteries, *pairs, *tendons]
    numbers = {"mass": sum(part.mass for part in parts), "displaced": sum(part.displaced for part in parts)}
    return Summary(
        f"{description.name}: {count(len(parts), 'part')}",
        above=[description.about] if description.about else [],
        values={name: Number(value, "kg") for name, value in numbers.items()},
        facts=[
            part_table(parts),
            _centres(found),
            mesh_table(description),
            plate_table(description),
            _aliases(description),
            assumed,
        ],
        after=[
            Table("robot", {"what": "", "text": ""}, rows),
            *_trees(description, parts),
            assumed,
            _aliases(description),
        ],
    )


def _aliases(description: RobotDescription) -> Table:
    quantities, rows = numeric_paths(description), list[tuple[str, str | Number, str]]()
    for alias, paths in description.aliases.items():
        if alias not in description.number_aliases:
            rows.append((alias, str(value_at(description, paths[0])), ", ".join(paths)))
            continue
        dimension, value = quantities[paths[0]].dimension, get_value(description, alias)
        shown = _short(format_quantity(value, dimension))
        rows.append((alias, Number(value, DIMENSIONS[dimension].unit, shown=shown), ", ".join(paths)))
    return Table("aliases", {"alias": "alias", "value": "value", "paths": "of"}, rows)


def _trees(description: RobotDescription, parts: list[PartWeight]) -> list[Branch]:
    """Trees of parts, each with what is on it."""
    branches, roots = dict[str, Branch](), list[Branch]()
    for (name, part), weighed in zip(description.carriers.items(), parts, strict=True):
        if isinstance(part, WebDescription):
            roots.append(_web_branch(to_plain(part), weighed))
            continue
        branches[name] = _branch(to_plain(part), weighed)
        if isinstance(part, Rigid) and isinstance(part.shape, MeshShape):
            branches[name].branches.extend(mesh_branches(part.shape, description.water))
        if isinstance(part, Rigid) and isinstance(part.shape, PlateShape):
            branches[name].branches.insert(0, plate_branch(part.shape))
        if isinstance(part, Rod) and part.rest.note:
            branches[name].branches.insert(0, Branch("at rest", part.rest.note))
        (branches[part.on].branches if name != "body" and part.on in branches else roots).append(branches[name])
    return roots


def _web_branch(web: dict[str, Any], weighed: PartWeight) -> Branch:
    sizes = {key: value for key, value in web.items() if key not in ("between", "loads")}
    said = [
        Branch("mass", f"{weighed.mass:.4g} kg, displaces {weighed.displaced:.4g} kg"),
        Branch("between", _flat(web["between"])),
        *(Branch(name, _flat(load)) for name, load in web.get("loads", {}).items()),
    ]
    return Branch(weighed.name, f"web, {_flat(sizes)}", said)


def _branch(part: dict[str, Any], weighed: PartWeight) -> Branch:
    placed = {key: part[key] for key in _PLACED if key in part}
    sizes = {key: value for key, value in part.items() if key not in (*_PLACED, *_OWN_LINES)}
    shape = sizes.pop("shape", sizes.pop("section", ""))
    if isinstance(shape, dict):
        mesh = ["mesh", *(f"{key} {shape[key]}" for key in ("thickness",) if key in shape)]
        shape = ", ".join(mesh) if "mesh" in shape else "plate"  # which have lines of their own
    said = [Branch("mass", f"{weighed.mass:.4g} kg, displaces {weighed.displaced:.4g} kg")]
    if placed:
        said.append(Branch("sits", _flat(placed)))
    said.append(Branch("joint", _flat(part.get("joint", {"kind": "fixed"}))))
    if weighed.freedoms:
        kinds = Counter(name.partition(".")[0] for name in weighed.freedoms)
        names = ", ".join(f"{n} {kind}" if n > 1 else kind for kind, n in kinds.items())
        said.append(Branch("moves", f"{count(len(weighed.freedoms), 'degree')} of freedom: {names}"))
    said += [Branch(f"drive of {name}", _flat(drive)) for name, drive in part.get("drive", {}).items()]
    said += [Branch(name, _flat(_written(load))) for name, load in part.get("loads", {}).items()]
    kind = f"{part['kind'].replace('_', ' ')} {shape}".rstrip()
    return Branch(weighed.name, f"{kind}, {_flat(sizes)}".removesuffix(", "), said)


def _written(load: dict[str, Any]) -> dict[str, Any]:
    """A load without what was computed, which is among the assumed numbers."""
    return {key: value for key, value in load.items() if key != "computed"}


_PACKED = re.compile(r"\S{200,}")


def _flat(value: Any) -> str:
    """Return plain data on one line, its kind first; long words, which are packed numbers, are left out."""
    if isinstance(value, dict):
        value = {key: item for key, item in value.items() if not (isinstance(item, str) and _PACKED.fullmatch(item))}
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
