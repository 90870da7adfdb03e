"""`nectosome control ROBOT --controller pid,mpc`: several controllers of a robot, compared on its model."""

import json
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome import view
from nectosome.cli.control_on_rig import loop_notes
from nectosome.cli.options import ReferenceOptions, named_options
from nectosome.cli.output import Outputs, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import show_quantity, unit_to_si

if TYPE_CHECKING:
    from nectosome.controllers import ControllerComparison, ControllerScore, ControlTask

_HEADS = {
    "controller": "controller",
    "outcome": "outcome",
    "rms_error": "rms error",
    "largest_error": "largest",
    "effort": "effort",
    "change": "change",
    "at_limits": "at limits",
    "cause": "cause",
}


def compare_controllers(robot: str, given: dict[str, Any], reference: ReferenceOptions, outputs: Outputs) -> int:
    """Simulate the robot under each controller, and print a row for each; `given` are other arguments of `compare`.

    The exit code is 0 where one of them tracks.
    """
    from nectosome import controllers

    names, start = given.pop("controller"), time.perf_counter()
    with progress_bar(Path(robot).stem) as update, named_options():
        found = cancellable(
            lambda progress: controllers.compare(
                robot,
                controllers=names,
                reference=reference.reference,
                time=reference.time,
                progress=progress,
                **given,
                **reference.shape(),
            ),
            update,
        )
    if found.cancelled:
        tell(f"cancelled at {found.cancelled}: nothing is written.")
        return 130
    seconds = round(time.perf_counter() - start, 3)
    write(_summary(found, seconds))
    ran = any(score.result is not None for score in found.scores)
    if outputs.given and ran:
        outputs.write(found.to_dataset().assign_attrs(seconds=seconds), view.show_side_by_side)
    if found.best is None:
        names = ", ".join(score.name for score in found.scores)
        unwritten = "; nothing is written" if outputs.given and not ran else ""
        tell(f"{found.task.robot.description.name}: none of {names} tracks{unwritten}.")
        return 1
    return 0


def _summary(found: "ControllerComparison", seconds: float) -> Summary:
    """A row for each controller, why some do not track, gains, model and sampling."""
    task, laws = found.task, [s.result.law for s in found.scores if s.result is not None and s.result.law is not None]
    rows = [_row(score, task) for score in found.scores]
    table = Table("controllers", _HEADS, rows, hidden=("cause",))
    why = dict[str, list[str]]()  # names by what is said of them
    for score in found.scores:
        words = f", refused: {score.cause}" if score.outcome == "refused" else f": {score.cause}"
        why.setdefault(words * bool(score.cause), []).append(score.name)
    causes = [f"{', '.join(names)}{words}" for words, names in why.items() if words]
    meaning = "effort: rms of the command less its initial value; change: rms of its change from sample to sample"
    notes, warnings = loop_notes(task, laws)
    best = [f"least rms error of those that track: {found.best.name}"] if found.best is not None else []
    attributes = {"seconds": seconds, "provenance": json.dumps(provenance(found.settings))}
    title = f"{found.title}, {show_quantity(found.seconds, 'time')}"
    return Summary(title, [table], notes=[*best, *causes, meaning, *notes], warnings=warnings, attributes=attributes)


def _row(score: "ControllerScore", task: "ControlTask") -> tuple[str | Number, ...]:
    """Numbers of a controller in the units in which reference and command are written."""
    of, by = (unit_to_si(one.unit)[1] if one.unit else "" for one in (task.reference, task.command))
    show, show_command = task.reference.show, task.command.show

    def shown(value: float, unit: str, text: str) -> Number:
        return Number(value, unit, shown=text if math.isfinite(value) else "")

    return (
        score.name,
        score.outcome,
        shown(score.rms_error, of, show(score.rms_error)),
        shown(score.largest_error, of, show(score.largest_error)),
        shown(score.effort, by, show_command(score.effort)),
        shown(score.change, by, show_command(score.change)),
        shown(score.at_limits, "", f"{100 * score.at_limits:.0f} %"),
        score.cause,
    )
