"""What commands share: `@command`, options, readers of their text, and the robot that a command works on."""

import re
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import App, Parameter, Token

from nectosome.cli.output import tell
from nectosome.io.file_system import entries, is_folder
from nectosome.units import InputError, count, read_positive

if TYPE_CHECKING:
    from cyclopts.completion import CompletionContext

    from nectosome import mechanism
    from nectosome.controllers.robot_control import Shape
    from nectosome.description import RobotDescription

_FILES = (".yaml", ".yml", ".nc")  # that may stand where a robot or a run is named
_ARGUMENTS = ("command", "controller", "delay", "gains", "mean", "measure", "model", "noise", "rate", "rounds")
_NAMED = 6  # at most so many values by name
_C = TypeVar("_C", bound=Callable[..., Any] | App)

COMMANDS: list[Callable[..., Any] | App] = []  # of the modules of `cli` that are loaded


def value(about: str, *names: str) -> Parameter:
    """Return help and names of an option whose value is a number, which may begin with a minus."""
    return Parameter(names or None, help=about, allow_leading_hyphen=True)


def whole(about: str, least: int, most: int, *names: str) -> Parameter:
    """Likewise of a whole number from `least` to `most`."""

    def read(_: object, tokens: Sequence[Token]) -> int:
        text = tokens[0].value
        number = int(text) if re.fullmatch(r"-?\d{1,9}", text) else least - 1
        if not least <= number <= most:
            raise InputError(f'"{text}" must be a whole number from {least} to {most}.', field=tokens[0].keyword)
        return number

    return Parameter(names or None, converter=read, help=about, allow_leading_hyphen=True)


def starts(most: int) -> Parameter:
    """`--starts` of a search or a fit."""
    return whole("Number of starting points in the ranges.", 1, most, "--starts")


def _robots(context: "CompletionContext") -> list[str]:
    """Names of robots that ship, and files and folders that begin as the word does."""
    from nectosome import robots

    folder, slash, start = context.incomplete.rpartition("/")
    there = [path for path in entries(folder + slash) if path.name.startswith(start)]
    files = [path.name + "/" * is_folder(path) for path in there if is_folder(path) or path.suffix in _FILES]
    return [*robots.names(), *(f"{folder}{slash}{name}" for name in files)]


Robot = Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.", completer=_robots)]
RobotOrRun = Annotated[
    str, Parameter(help="Name of a robot that ships, a robot file, or what was saved (.nc).", completer=_robots)
]
Settings = Annotated[
    list[str] | None, Parameter("--set", help="Quantity to set, such as E=7.4MPa or f=1.5Hz; may be repeated.")
]
Loads = Annotated[
    bool, Parameter("--loads", help="Print force and power of each load on each part, and the energy of each part.")
]
Whole = Annotated[
    bool, Parameter("--whole", help="Solve every limb, also where equal limbs all do the same and one stands for them.")
]
Campaign = Annotated[Path, Parameter("--campaign", help="Campaign (.yaml): recordings and their conditions.")]
STARTS, SEED = 4, 1  # of searches and fits, the defaults of `designs.design` and `identification.identify`
Seed = Annotated[int, whole("Seed of random numbers.", 0, 999_999_999, "--seed")]
Vary = Annotated[
    list[str] | None, Parameter("--vary", help='PATH=LOW..HIGH, such as "E=1..9MPa log"; may be repeated.')
]
Over = Annotated[
    list[str] | None,
    Parameter("--over", help="PATH=LOW..HIGH:STEP or PATH=a,b,c, such as A=30..75:5deg; may be repeated."),
]
Test = Annotated[
    list[str] | None, Parameter("--test", help="Files that are predicted, not fitted.", consume_multiple=True)
]
WriteRobot = Annotated[Path | None, Parameter("--write", help="Write the robot that was found to this file (.yaml).")]


@Parameter(name="*")
@dataclass(frozen=True)
class ReferenceOptions:
    """A reference as options of the command line."""

    reference: Annotated[
        str,
        value("A constant, such as 30deg; a signal, such as sine or {kind: stroke, ...}; or a file with a recording."),
    ]
    amplitude: Annotated[str | None, value("Amplitude of a signal, such as 6mm; a list for varying.")] = None
    frequency: Annotated[str | None, value("Frequency of a signal, such as 0.04Hz; a list for varying.")] = None
    to: Annotated[str | None, value("Last frequency of a chirp.")] = None
    column: Annotated[str | None, Parameter(help="Quantity of the file, if several have the dimension.")] = None
    time: Annotated[str | None, value("Length; by default two periods, that of the file, or 10 s.")] = None

    def shape(self) -> "Shape":
        """Options that belong to the shape."""
        return {"amplitude": self.amplitude, "frequency": self.frequency, "to": self.to, "column": self.column}

    def seconds(self) -> float | None:
        """The length [s]. Raises InputError."""
        return None if self.time is None else read_positive(self.time, "time", "time")


@contextmanager
def named_options() -> Iterator[None]:
    """Errors of arguments name their options."""
    try:
        yield
    except InputError as error:
        known = (*ReferenceOptions.__dataclass_fields__, *_ARGUMENTS)
        if (error.field or "").partition(" ")[0] not in known or error.file:
            raise
        raise InputError(error.message, field=f"--{error.field}") from None


def robot_named(robot: str, settings: list[str] | None = None) -> "RobotDescription":
    """Description of what `Robot` names, with settings. Raises InputError."""
    from nectosome.robots import describe

    return describe(robot, settings or ())


def build_weighed(description: "RobotDescription", source: str) -> "mechanism.Robot":
    """Return the robot of a description, which comes from `source`, and tell of values that no robot has.

    Raises InputError as `weigh` does.
    """
    from nectosome.mechanism import weigh
    from nectosome.model import build

    robot = build(description)
    weigh(robot, source)
    tell_far_out(description, source)
    return robot


def tell_far_out(description: "RobotDescription", source: str) -> None:
    """Tell of values that no robot has, of a description that comes from `source`."""
    from nectosome.description.plausible import meaningless

    far_out = list(meaningless(description))
    for path, sentence in far_out[:_NAMED]:
        tell(f"{source}, {path}: {sentence}")
    if len(far_out) > _NAMED:
        tell(f"{source}: {count(len(far_out) - _NAMED, 'more value')} of this kind. nectosome check shows all.")


_T = TypeVar("_T")

Part = Annotated[
    str | None,
    Parameter("--part", help="Compute this share only, such as 2/8, the second of eight; nectosome gather joins them."),
]

Cluster = Annotated[
    str | None,
    Parameter("--cluster", help="Dask scheduler whose workers compute: tcp://HOST:PORT, or its scheduler file."),
]


def on_cluster(address: str | None, compute: Callable[[Executor | None], _T], kept: Path | None) -> _T | None:
    """Return compute(executor), with the executor of a cluster or None without one; None where the cluster is lost.

    - kept: where what is computed already lies, which the message names.
    """
    if address is None:
        return compute(None)
    from nectosome.search.executors.cluster import cluster
    from nectosome.search.executors.spread import LostError

    try:
        with cluster(address) as executor:
            return compute(executor)
    except LostError as error:
        tell(f"{error}{goes_on(kept)}")
        return None


def goes_on(kept: Path | None) -> str:
    """Say where a run that ended early goes on, if anything is kept."""
    return "" if kept is None or not entries(kept) else f" The same command goes on from what is in {kept}."


def command(made: _C) -> _C:
    """Mark a command: the function with its docstring as help, or the app of its subcommands."""
    COMMANDS.append(made)
    return made
