"""What `nectosome control ROBOT` is asked for, in words, and what it tells of a run."""

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Group
from rich.text import Text

from nectosome.cli.options import read_quantity
from nectosome.cli.page import columns, ending, number, page
from nectosome.io import (
    InputError,
    RobotDescription,
    did_you_mean,
    get_value,
    numeric_paths,
    resolve,
    show_quantity,
)
from nectosome.io.errors import shorten
from nectosome.io.units import unit_to_si

if TYPE_CHECKING:
    import numpy as np

    from nectosome.control import Beat, Followed

SHAPES = ("sine", "triangle")


class Range(NamedTuple):
    """What the command may be, SI, and the unit in which that was written."""

    name: str
    paths: tuple[str, ...]
    low: float
    high: float
    resting: float
    dimension: str
    unit: str
    unit_size: float

    @property
    def largest(self) -> float:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))

    def show(self, value: float) -> str:
        """A value in the unit in which it was written."""
        return f"{number(value / self.unit_size)} {self.unit}".strip()


def read_range(text: str, description: RobotDescription) -> Range:
    """Read `bias=-8:8mN m`; the unit of the last number counts for both. Raises InputError."""
    name, equals, rest = (part.strip() for part in text.partition("="))
    low, colon, high = (part.strip() for part in rest.partition(":"))
    if not (name and equals and low and colon and high):
        message = f'"{shorten(text)}" has no range. Write PATH=LOW:HIGH, as in "bias=-8:8mN m".'
        raise InputError(message, field="--command")
    try:
        paths = tuple(resolve(description, name))
    except InputError as error:
        aliases = f" Aliases: {', '.join(description.aliases)}." if description.aliases else ""
        raise InputError(error.message + aliases, field="--command") from None
    unit = _unit_of(high)
    quantity = numeric_paths(description)[paths[0]]
    texts = [low if _unit_of(low) else f"{low} {unit}".strip(), high]
    try:
        ends = [quantity.read(end, units_required=True) for end in texts]
    except ValueError as error:
        raise InputError(str(error), field=f"--command {name}") from None
    resting = float(get_value(description, name))
    size = unit_to_si(unit)[0] if unit else 1.0
    found = Range(name, paths, ends[0], ends[1], resting, quantity.dimension, unit or quantity.unit, size)
    if not found.low < found.high:
        message = f"{low}:{high} is empty. Write the smaller end first."
        raise InputError(message, field=f"--command {name}")
    if not found.low <= resting <= found.high:
        message = f"it starts at {found.show(resting)}, outside of {found.show(found.low)} to {found.show(found.high)}."
        raise InputError(f"{message} Put it inside first, with --set.", field=f"--command {name}")
    return found


def read_beat(description: RobotDescription, reach: Range, mean: bool) -> "Beat | None":
    """The beat of the robot; None without one, where its mean is not asked for. Raises InputError."""
    from nectosome.control import beat_of

    try:
        beat = beat_of(description, reach.paths, reach.resting)
    except InputError as error:
        if mean:
            told = f"{error.field}: " if error.field and "." in error.field else ""
            raise InputError(f"there is no beat to take it of: {told}{error.message}", field="--mean") from None
        return None
    if mean and beat.follows and reach.low <= 0:
        message = f"a beat never ends at {reach.show(0.0)}. Let the range begin above that."
        raise InputError(message, field=f"--command {reach.name}")
    return beat


class Wanted(NamedTuple):
    """A reference as it was asked for, SI, and the unit in which that was written."""

    kind: str
    size: float
    dimension: str
    unit: str
    unit_size: float

    @classmethod
    def read(cls, reference: str, amplitude: str | None, dimension: str) -> "Wanted":
        """Raises InputError."""
        text, option = (reference, "--reference") if amplitude is None else (amplitude, "--amplitude")
        if amplitude is None and not re.match(r"\s*[-+.\d]", reference):
            message = f'"{shorten(reference)}" is no reference: a quantity, sine or triangle.'
            raise InputError(message + did_you_mean(reference, SHAPES), field=option)
        size = read_quantity(text, dimension, option)
        if amplitude is not None and size <= 0:
            raise InputError(f'"{amplitude}" is out of range: it must be more than 0.', field=option)
        from nectosome.io.dimensions import DIMENSIONS

        unit = _unit_of(text)
        size_of_unit = unit_to_si(unit)[0] if unit else 1.0
        kind = "constant" if amplitude is None else reference
        return cls(kind, size, dimension, unit or DIMENSIONS[dimension].unit, size_of_unit)

    def samples(self, start: float, turns: float, time: float, dt: float) -> "np.ndarray":
        """At even times; what goes to and fro does so about where the robot starts."""
        import numpy as np

        from nectosome.control import sine, times, triangle

        if self.kind == "constant":
            return np.full(times(time, dt).size, self.size)
        return start + (sine if self.kind == "sine" else triangle)(self.size, turns, time, dt)

    def show(self, value: float) -> str:
        """A value in the unit in which it was written."""
        return f"{number(value / self.unit_size)} {self.unit}".strip()


class Words(NamedTuple):
    """What is known of a run beside its numbers, to tell it."""

    reach: Range
    wanted: Wanted
    gains: "np.ndarray"  # in the units of reach and wanted
    found: Any
    pace: float  # of the gains that were found
    beat: "Beat | None"
    mean: bool
    rate: float

    def gains_text(self) -> str:
        """K_p,K_i,K_d as --gains takes them."""
        return ",".join(f"{x:.4g}" for x in self.gains)

    def lines(self, run: "Followed") -> list[str]:
        """Gains, sampling, what the beat does."""
        import numpy as np

        c, m = self.reach.unit or "1", self.wanted.unit or "1"
        m = f"({m})" if re.search("[ /]", m) else m
        lines = [f"gains: {self.gains_text()} ({c}/{m}, {c}/({m} s), {c} s/{m})"]
        if self.found is not None:
            swing = self.found.ultimate
            lines[0] += f", from a relay under which the model swings every {swing.period:.3g} s"
            lines[0] += f", at {self.pace:g} of their pace" if self.pace < 1 else ""
            if swing.period <= 3 / self.rate:
                lines.append(
                    "warning: that is at most three samples, which makes rough gains; a higher --rate tells more"
                )
        told = f"sampled at {show_quantity(self.rate, 'frequency')}"
        if self.mean and self.beat is not None:
            told += f", as the mean over a beat of {show_quantity(1 / self.beat.frequency, 'time')}"
            told += " at first" if self.beat.follows else ""
        lines.append(told)
        at_ends = np.isclose(run.command, self.reach.low) | np.isclose(run.command, self.reach.high)
        ends = f"{self.reach.show(run.command.min())} to {self.reach.show(run.command.max())}"
        lines.append(f"command: {ends}, at an end of its range for {np.mean(at_ends):.0%} of the samples")
        if self.beat is not None and not self.mean and self.rate < 2 * self.beat.frequency:
            beats = show_quantity(self.beat.frequency, "frequency")
            lines.append(f"warning: what beats at {beats} looks like an offset when sampled so rarely; see --mean")
        return lines

    def missed(self, run: "Followed") -> str:
        """Why a constant reference was not reached, where the command could do no more; empty where it was."""
        import numpy as np

        from nectosome.control import step_response

        answer = step_response(run.time, run.output, run.reference)
        if answer is None:
            return ""
        last = slice(-max(len(run.time) // 10, 1), None)
        ends = [end for end in (self.reach.low, self.reach.high) if np.allclose(run.command[last], end)]
        left, step = answer.steady_error, run.reference[0] - run.output[0]
        if not ends or abs(left) <= 0.05 * abs(step):
            return ""
        held, name = f"{run.robot.command} stands at {self.reach.show(ends[0])}", run.robot.reading.name
        now = self.wanted.show(run.output[-1])
        if left * step < 0 and abs(left) > abs(step):
            return f"{held}, and {name} went the wrong way, to {now}. Try gains of the other sign."
        wanted = self.wanted.show(run.reference[-1])
        return f"the reference is out of reach: {held}, and {name} is {now} instead of {wanted}."


def followed(run: "Followed", words: Words, attributes: dict[str, Any]) -> Group:
    """How the reference was followed."""
    import numpy as np

    from nectosome.control import rms_error, step_response

    size, unit = words.wanted.unit_size, words.wanted.unit
    table = columns(f"{run.robot.reading.name} by {run.robot.command}", "", "unit")
    answer = step_response(run.time, run.output, run.reference)
    if answer is not None:
        rows = (
            ("rise, 10 to 90 %", answer.rise, "s"),
            ("overshoot", 100 * answer.overshoot, "%"),
            ("settled within 5 %, from", answer.settling, "s"),
            ("steady error", answer.steady_error / size, unit),
        )
        for name, value, of in rows:
            table.add_row(name, number(value) if np.isfinite(value) else "never", of)
    table.add_row("rms error", number(rms_error(run.output, run.reference) / size), unit)
    table.add_row("largest error", number(float(np.abs(run.output - run.reference).max()) / size), unit)
    title = Text(f"{attributes['title']}, {run.time[-1]:.4g} s", "bold")
    return page(title, [table], [*words.lines(run), ending(attributes)])


def _unit_of(text: str) -> str:
    """What stands behind a number."""
    return re.sub(r"^\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", "", text).strip()
