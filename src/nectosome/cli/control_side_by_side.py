"""`nectosome control ROBOT --controller pid,mpc`: several controllers of a robot, compared on its model, and saved."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome import view
from nectosome.cli.control_on_rig import loop_notes
from nectosome.cli.options import ReferenceOptions, named_options
from nectosome.cli.output import Outputs, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import show_quantity, show_value

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.controllers import ControllerComparison

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
    data = found.to_dataset().assign_attrs(seconds=seconds)
    write(_summary(found, data))
    ran = any(score.result is not None for score in found.scores)
    if outputs.given and ran:
        outputs.write(data, view.show_side_by_side)
    if found.best is None:
        names = ", ".join(score.name for score in found.scores)
        unwritten = "; nothing is written" if outputs.given and not ran else ""
        tell(f"{found.task.robot.description.name}: none of {names} tracks{unwritten}.")
        return 1
    return 0


def comparison_summary(data: "xr.Dataset") -> Summary:
    """What such a command found, from a dataset that it saved."""
    from nectosome.solve.summaries.run_summary import origin

    def show(value: float, of: str) -> str:
        return show_value(value, _unit(data, of), digits=4)

    shown = _table(data, lambda value: show(value, "reference"), lambda value: show(value, "command"))
    return replace(shown, after=[origin(data.attrs)])


def _summary(found: "ControllerComparison", data: "xr.Dataset") -> Summary:
    """A row for each controller, why some do not track, gains, model and sampling."""
    task, laws = found.task, [s.result.law for s in found.scores if s.result is not None and s.result.law is not None]
    shown, (notes, warnings) = _table(data, task.reference.show, task.command.show), loop_notes(task, laws)
    return replace(shown, notes=[*shown.notes, *notes], warnings=warnings)


def _table(data: "xr.Dataset", show: Callable[[float], str], show_command: Callable[[float], str]) -> Summary:
    """A row for each controller, and why some do not track; `show` and `show_command` write values in some unit."""
    shows = {"rms_error": show, "largest_error": show, "effort": show_command, "change": show_command}
    shows |= {"at_limits": lambda value: f"{100 * value:.0f} %"}

    def number(name: str, k: int) -> Number:
        value = float(data[name].values[k])
        return Number(value, _unit(data, name), shown=shows[name](value) if math.isfinite(value) else "")

    words = [[str(word) for word in data[name].values] for name in ("controller", "outcome", "cause")]
    rows = [
        (name, outcome, *(number(of, k) for of in shows), cause)
        for k, (name, outcome, cause) in enumerate(zip(*words, strict=True))
    ]
    why = dict[str, list[str]]()  # names by what is said of them
    for name, outcome, cause in zip(*words, strict=True):
        said = f", refused: {cause}" if outcome == "refused" else f": {cause}"
        why.setdefault(said * bool(cause), []).append(name)
    causes = [f"{', '.join(names)}{said}" for said, names in why.items() if said]
    errors = {
        name: float(x) for name, outcome, x in zip(*words[:2], data["rms_error"], strict=True) if outcome == "tracks"
    }
    best = [f"least rms error of those that track: {min(errors, key=errors.__getitem__)}"] if errors else []
    meaning = "effort: rms of the command less its initial value; change: rms of its change from sample to sample"
    title = f"{data.attrs['title']}, {show_quantity(float(data['sample'][-1]), 'time')}"
    table = Table("controllers", _HEADS, rows, hidden=("cause",))
    attributes = {name: data.attrs[name] for name in ("seconds", "provenance") if name in data.attrs}
    return Summary(title, [table], notes=[*best, *causes, meaning], attributes=attributes)


def _unit(data: "xr.Dataset", name: str) -> str:
    """SI unit of a variable; "" of a number."""
    unit = str(data[name].attrs["units"])
    return "" if unit == "1" else unit
