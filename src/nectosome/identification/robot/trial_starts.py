"""How the robot starts in each recording."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nectosome.description import STRAIN_NAMES, RobotDescription, Rod, apply_settings, get_value, resolve
from nectosome.description.robot_file import read_value
from nectosome.description.variables import Variable, read_variable
from nectosome.io.schema.quantity import Si
from nectosome.units import InputError, shorten
from nectosome.units.ranges import split_range

from .trial_clocks import Span

_READING = "reading"
EQUILIBRIUM = "equilibrium"
BEFORE = "before"
_JOINT = re.compile(r"(.+)\.joint\.(position|velocity|start\..+)")
_STRAIN = re.compile(rf"(.+)\.start\.((?:rate\.)?({'|'.join(STRAIN_NAMES)}))(?:\.(\d+))?")
_MOVING = re.compile(r"\.(velocity|rate|angular_velocity|angular_speed)\b")
_COORDINATES = "angle", "position"


class RobotStart(NamedTuple):
    """A number with which a robot starts in a recording: of a joint, of a rod's strains, or one it had before."""

    paths: tuple[str, ...]
    value: Variable | float  # unknown within a range, or known [SI]
    how: str  # in words
    before: bool = False  # whether the robot had it before the start, in equilibrium, and has another one since


def read_starts(
    given: Mapping[str, Span], described: RobotDescription, first: Mapping[str, float], trial: str
) -> tuple[RobotDescription, tuple[RobotStart, ...], bool]:
    """The robot with the starts that are known, all that are given, and whether it starts from an equilibrium.

    By path or alias: a joint's start, a strain of a rod, where one without an index is all of its coefficients, and
    `before.PATH`, what the robot had before it was let go; it then begins at rest in the static equilibrium with that.
    `before: equilibrium` is the one of the robot as it is described. Each is a range `LOW..HIGH` of what is unknown, a
    number with its unit, or `reading`, the first reading of the column that measures it; `first` has these by the
    readings' names [SI]. Raises InputError that names the start.
    """
    described, given = _each_strain(given, described)
    found, released = list[RobotStart](), BEFORE in given
    if released and given[BEFORE] != EQUILIBRIUM:
        raise InputError(
            f'"{shorten(given[BEFORE])}" is nothing that it could be before its start. Write {EQUILIBRIUM}, or name '
            f"what was different, as in {BEFORE}.limbs.tip.mass.",
            field="start",
        )
    for name, span in ((name, span) for name, span in given.items() if name != BEFORE):
        before = name.startswith(f"{BEFORE}.")
        released |= before
        quantity = name.removeprefix(f"{BEFORE}.")
        paths = tuple(resolve(described, quantity))
        known = [_JOINT.fullmatch(path) or _STRAIN.fullmatch(path) for path in paths]
        if before and any(known):
            raise InputError(
                f"{quantity} is how the robot starts, which the equilibrium before says. Name a load, a mass, a "
                "stiffness that was different.",
                field="start",
            )
        if not before and not all(known):
            raise InputError(
                f'"{shorten(name)}" is no start of a joint or of a rod. Name one, as in body.joint.position, '
                "body.joint.velocity, body.joint.start.position.0, body.start.bending_y.0; or what was different "
                f"before it was let go, as in {BEFORE}.{shorten(name)}.",
                field="start",
            )
        if not isinstance(span, str) or split_range(span):
            variable = read_variable(quantity, span, described)
            if not before:
                _with_start(described, name, variable.upper)  # what is moved has no start of its own
            own = replace(variable, name=f"{name} of {trial}")
            found.append(RobotStart(paths, own, f"{name} unknown", before))
            continue
        if before:
            value = read_value(quantity, span, described)[paths[0]]
            found.append(RobotStart(paths, value, f"{name} given", before))
            continue
        if span.strip() == _READING:
            names = [one for match in known if match for one in _readings(*match.groups()[:2])]
            value = next((first[one] for one in names if one in first), np.nan)
            if not np.isfinite(value):
                raise InputError(
                    f"{name}: no first reading tells it. Compare {' or '.join(names) or 'its coordinate'} in a column "
                    "that has a first value, or give a number or a range.",
                    field="start",
                )
            described, how = _with_start(described, name, value), "first reading"
        else:
            described, how = apply_settings(described, {name: span}), "given"
        found.append(RobotStart(paths, float(get_value(described, paths[0])), f"{name} {how}"))
    places = [path for one in found if not one.before for path in one.paths if not _MOVING.search(path)]
    if released and places:
        raise InputError(
            f"{places[0]} is given, and so is what the robot was before: its equilibrium says where it starts. Leave "
            "one of both out; velocities may stand beside it.",
            field="start",
        )
    return described, tuple(found), released


def _each_strain(given: Mapping[str, Span], described: RobotDescription) -> tuple[RobotDescription, dict[str, Span]]:
    """The robot with a place for each start of a strain that is named, and a range of all of one for each."""
    out = dict[str, Span]()
    for name, span in given.items():
        match = _STRAIN.fullmatch(name)
        rod = match and next((x for part, x in described.parts.items() if described.place_of(part) == match[1]), None)
        if not match or not isinstance(rod, Rod):
            out[name] = span
            continue
        row, strain = f"{match[1]}.start.{match[2]}", match[3]
        count = {str(one): order for one, order in rod.strains.items()}.get(strain, 0) + 1
        own = rod.start.rate if "rate." in match[2] else rod.start
        values = [*getattr(own, strain), *[0.0] * count][:count]
        described = apply_settings(described, {row: [Si(x) for x in values]})
        every = match[4] is None and (not isinstance(span, str) or split_range(span))
        out |= {f"{row}.{k}": span for k in range(count)} if every else {name: span}
    return described, out


def _readings(part: str, what: str) -> list[str]:
    """Names of the readings that tell a start of a hinge or a slide; none for other joints."""
    ends = {"position": "", "velocity": ".rate"}
    return [f"{part.split('.')[-1]}.{one}{ends[what]}" for one in _COORDINATES] if what in ends else []


def _with_start(described: RobotDescription, name: str, value: float) -> RobotDescription:
    return apply_settings(described, {name: Si(value)})
