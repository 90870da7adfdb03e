"""`nectosome control ROBOT`: any robot under a controller that sets one of its quantities by what is measured of it."""

import re
import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter
from rich.console import Group
from rich.text import Text

from nectosome.cli.output import check_target, tell, write
from nectosome.cli.page import columns, ending, number, page
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import save_dataset
from nectosome.units import InputError, parse_quantity, read_positive, read_quantity, show_quantity

if TYPE_CHECKING:
    import numpy as np

    from nectosome.controllers import Beat, ClosedLoopRecord, CommandRange, Reference


class Words(NamedTuple):
    """What is known of a run beside its numbers, to tell it."""

    reach: "CommandRange"
    wanted: "Reference"
    gains: "np.ndarray"  # in the units of reach and wanted
    found: Any
    pace: float  # of the gains that were found
    beat: "Beat | None"
    mean: bool
    rate: float

    def gains_text(self) -> str:
        """K_p,K_i,K_d as --gains takes them."""
        return ",".join(f"{x:.4g}" for x in self.gains)

    def lines(self, run: "ClosedLoopRecord") -> list[str]:
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
        last = self.reach.show(run.command[-max(len(run.time) // 10, 1) :].mean())
        lines.append(
            f"command: {ends}, {last} on the mean of the last tenth; at an end of its range for "
            f"{np.mean(at_ends):.0%} of the samples"
        )
        if self.beat is not None and not self.mean and self.rate < 2 * self.beat.frequency:
            beats = show_quantity(self.beat.frequency, "frequency")
            lines.append(f"warning: what beats at {beats} looks like an offset when sampled so rarely; see --mean")
        return lines

    def missed(self, run: "ClosedLoopRecord") -> str:
        """Why a constant reference was not reached, where the command could do no more; empty where it was."""
        import numpy as np

        from nectosome.controllers import step_response

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


def followed(run: "ClosedLoopRecord", words: Words, seconds: float) -> Group:
    """How the reference was followed."""
    import numpy as np

    from nectosome.controllers import rms_error, step_response

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
    title = Text(f"{run.title}, {run.time[-1]:.4g} s", "bold")
    attributes = {"status": run.status.name, "status_reason": run.status.reason, "seconds": seconds}
    return page(title, [table], [*words.lines(run), ending(attributes)])


_USUAL = 20.0  # Hz, of samples where nothing is averaged
_A_BEAT = 4  # samples, where it is
_MOST = 100_000  # samples


def control_robot(
    robot: Annotated[str, Parameter(help="Name of a robot that ships, or a robot file.")],
    /,
    *,
    command: Annotated[
        str, Parameter(help="What the controller sets, and its range: PATH=LOW:HIGH, such as bias=-8:8mN m.")
    ],
    measure: Annotated[
        str, Parameter(help="What is measured: heading, depth, velocity.x, ... of the body, arm.angle of a joint.")
    ],
    reference: Annotated[
        str, Parameter(help="Where that should be, such as 30deg; or sine, triangle.", allow_leading_hyphen=True)
    ],
    amplitude: Annotated[str | None, Parameter(help="Of a sine or triangle.", allow_leading_hyphen=True)] = None,
    frequency: Annotated[str | None, Parameter(help="Of a sine or triangle.", allow_leading_hyphen=True)] = None,
    time: Annotated[str, Parameter(help="How long, with its unit.", allow_leading_hyphen=True)] = "10s",
    gains: Annotated[
        str | None,
        Parameter(
            help="K_p,K_i,K_d in the units of --command and --reference, and s; left out, they are found on the model.",
            allow_leading_hyphen=True,
        ),
    ] = None,
    rate: Annotated[
        str | None, Parameter(help="Of samples; 20 Hz, or four a beat with --mean.", allow_leading_hyphen=True)
    ] = None,
    mean: Annotated[bool, Parameter(help="Measure the mean over the last beat of the drives.")] = False,
    noise: Annotated[
        str | None, Parameter(help="Standard deviation of a measurement.", allow_leading_hyphen=True)
    ] = None,
    delay: Annotated[str | None, Parameter(help="By which measurements are late.", allow_leading_hyphen=True)] = None,
    settings: Annotated[
        list[str] | None, Parameter("--set", help="PATH=VALUE, such as f=1.5Hz; may be repeated.")
    ] = None,
    save: Annotated[Path | None, Parameter(help="Write the run to this netCDF file (.nc).")] = None,
    plot: Annotated[Path | None, Parameter(help="Write a page with figures to this file (.html).")] = None,
) -> int:
    """Let a PID set a quantity of a robot, so that what is measured of it follows a reference."""
    for target, option, suffix in ((save, "--save", ".nc"), (plot, "--plot", ".html")):
        if target is not None:
            check_target(target, option, suffix)
    seconds = read_positive(time, "time", "--time")
    asked_rate = None if rate is None else read_positive(rate, "frequency", "--rate")
    late = 0.0 if delay is None else read_positive(delay, "time", "--delay")
    numbers = None if gains is None else _gains(gains)

    import numpy as np

    from nectosome import controllers as control
    from nectosome import robots, solve
    from nectosome.core import Status

    for option, given in (("--amplitude", amplitude), ("--frequency", frequency)):
        if (given is None) == (reference in control.SHAPES):
            told = f"a {reference} needs it" if given is None else "only a sine or triangle takes it"
            raise InputError(f"{told}.", field=option)
    turns = 0.0 if frequency is None else read_positive(frequency, "frequency", "--frequency")
    description = robots.describe(robot, settings or ())
    with _options():
        reach = control.read_range(command, description)
        beat = control.read_beat(description, reach, mean)
    hertz = asked_rate or (_A_BEAT * beat.at(reach.resting) if mean and beat is not None else _USUAL)
    samples = seconds * hertz
    if not 2 <= samples <= _MOST:
        told = f"{show_quantity(hertz, 'frequency')} for {show_quantity(seconds, 'time')} is {samples:.3g} samples"
        raise InputError(f"{told}; from 2 to {_MOST} are possible.", field="--rate")

    start = clock.perf_counter()
    with progress_bar(description.name) as update:

        def compute(going_on: Callable[[], bool]) -> Any:
            def progress(what: str) -> Callable[[float], bool]:
                def told(share: float) -> bool:
                    update(what, share)
                    return going_on()

                return told

            moments = 1 if beat is None else control.moments_of(beat, reach.largest, 1 / hertz)
            try:
                held = solve.SampledPlant(description, reach.name, measure, 1 / hertz, moments)
            except InputError as error:
                raise InputError(error.message, field=error.field or "--measure") from None
            with _options():
                wanted = control.Reference.read(reference, amplitude, held.reading.dimension)
            spread = 0.0 if noise is None else _noise(noise, held.reading.dimension)
            measuring = control.SensorModel(beat if mean else None, late, spread)
            begin = held.start()[0].reading
            course = wanted.samples(begin, turns, seconds, 1 / hertz)
            about = wanted.size if wanted.kind == "constant" else begin
            scale = np.array([reach.unit_size / wanted.unit_size])
            found, pace = None, 1.0
            if numbers is None:
                found = control.relay_gains(
                    held, reach.low, reach.high, about, measuring, progress=progress("finding gains")
                )
                pace = found and control.detune(
                    held, found.gains, reach.low, reach.high, course, measuring, progress=progress("rehearsing")
                )
                if found is None or pace is None:
                    return None, None
                used = control.time_scaled(found.gains, pace)
            else:
                used = scale * np.array(numbers)
            pid = control.smooth_pid(used, reach.low, reach.high, 1 / hertz)
            run = control.run_closed_loop(held, pid, course, measuring, progress=progress("following"))
            words = Words(reach, wanted, used / scale, found, pace, beat, mean, hertz)
            return run, words

        run, words = cancellable(compute)
    if run is None:
        tell("cancelled while gains were looked for.")
        return 130
    asked = {"robot": robot, "set": settings or [], "command": command, "measure": measure, "reference": reference}
    asked |= {"amplitude": amplitude, "frequency": frequency, "time": seconds, "rate": hertz, "mean": mean}
    asked |= {"noise": noise, "delay": late, "gains": words.gains_text()}
    seconds_taken = round(clock.perf_counter() - start, 3)
    write(followed(run, words, seconds_taken), wrap=False)
    if save is not None and len(run.pieces) > 1:
        data = run.to_dataset({key: value for key, value in asked.items() if value is not None})
        save_dataset(data.assign_attrs(seconds=seconds_taken), save)
    if plot is not None:
        from nectosome.view import show_following

        show_following(run.track(), plot)
    if run.status == Status.CANCELLED:
        tell(f"cancelled at {run.time[-1]:.4g} s of {seconds:.4g} s.")
        return 130
    if run.status != Status.SOLVED:
        tell(f"{description.name}: {run.status.reason}, at {run.time[-1]:.4g} s of {seconds:.4g} s.")
        return 1
    if why := words.missed(run):
        tell(f"{description.name}: {why}")
        return 1
    return 0


@contextmanager
def _options() -> Iterator[None]:
    """Fields of what goes wrong are options here."""
    try:
        yield
    except InputError as error:
        raise InputError(error.message, field=f"--{error.field}") from None


def _gains(text: str) -> list[float]:
    """Three numbers that do not pull against each other. Raises InputError."""
    try:
        numbers = [parse_quantity(part, "number") for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="--gains") from None
    if len(numbers) != 3 or not any(numbers):
        raise InputError(f'"{text}" is not three numbers that are not all 0, such as 4,0.5,0.', field="--gains")
    if min(numbers) < 0 < max(numbers):
        message = f'"{text}" pulls to both sides: give all of one sign, below 0 for what answers downwards.'
        raise InputError(message, field="--gains")
    return numbers


def _noise(text: str, dimension: str) -> float:
    value = read_quantity(text, dimension, "--noise")
    if value < 0:
        raise InputError(f'"{text}" is out of range: it must not be less than 0.', field="--noise")
    return value
