"""What `nectosome control ROBOT` tells of a run."""

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import Group
from rich.text import Text

from nectosome.cli.page import columns, ending, number, page
from nectosome.io import show_quantity

if TYPE_CHECKING:
    import numpy as np

    from nectosome.control import Beat, Followed, Range, Wanted


class Words(NamedTuple):
    """What is known of a run beside its numbers, to tell it."""

    reach: "Range"
    wanted: "Wanted"
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
        last = self.reach.show(run.command[-max(len(run.time) // 10, 1) :].mean())
        lines.append(
            f"command: {ends}, {last} on the mean of the last tenth; at an end of its range for "
            f"{np.mean(at_ends):.0%} of the samples"
        )
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


def followed(run: "Followed", words: Words, seconds: float) -> Group:
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
    title = Text(f"{run.title}, {run.time[-1]:.4g} s", "bold")
    attributes = {"status": run.status.name, "status_reason": run.status.reason, "seconds": seconds}
    return page(title, [table], [*words.lines(run), ending(attributes)])
