"""`nectosome control ROBOT --rig FILE`: the controller of a robot, rehearsed on its model, on the rig of the robot."""

import json
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from nectosome.cli.control_rig import CODES, log_of
from nectosome.cli.layout import Label, Number, Table
from nectosome.cli.loop_errors import tracking_errors
from nectosome.cli.options import ReferenceOptions, named_options
from nectosome.cli.output import Outputs, report, tell, write
from nectosome.cli.page import Summary
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance, save_dataset
from nectosome.units import InputError, show_quantity

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.controllers.robot_control import ControlTask, LoopGains
    from nectosome.rigs.robot_bench import RobotBench


@Parameter(name="*")
@dataclass(frozen=True)
class RigOptions:
    """A rig of the robot, as options of the command line."""

    rig: Annotated[
        Path | None,
        Parameter(
            help="Rig file (.yaml) on which to run it, after a rehearsal on the model; its dt is the sample time."
        ),
    ] = None
    rig_command: Annotated[
        str | None, Parameter(help="Command of the rig that is --command; may be left out where it has one.")
    ] = None
    rig_measure: Annotated[
        str | None, Parameter(help="Measurement of the rig that is --measure; may be left out where it has one.")
    ] = None


def control_on_rig(
    on: RigOptions, robot: str, given: dict[str, Any], reference: ReferenceOptions, outputs: Outputs
) -> int:
    """Find gains on the model, rehearse under the guards of the rig, then run the rig, and log it.

    `given` are the other arguments of `controllers.control`.
    """
    assert on.rig is not None
    if given.pop("rate"):
        raise InputError("is not possible with --rig: dt of the rig file is the sample time.", field="--rate")

    from nectosome.controllers.robot_control import ControlTask
    from nectosome.rigs import Pair
    from nectosome.rigs.files import load_rig
    from nectosome.rigs.robot_bench import RobotBench, check_pair

    file = load_rig(on.rig)
    try:
        pair = Pair.of(file.rig, on.rig_command, on.rig_measure)
    except InputError as error:
        option = {"command": "--rig-command", "measurement": "--rig-measure"}[error.field or ""]
        raise InputError(error.message, field=option) from None
    with named_options(), progress_bar(Path(robot).stem) as update:
        task = ControlTask.parse(robot, reference=reference.reference, rate=1 / file.dt, **given, **reference.shape())
        check_pair(task, file.rig, file.limits, pair)
        seconds = reference.seconds() or task.reference.duration(file.dt)
        gains = cancellable(lambda progress: task.find_gains(seconds, progress), update)
        if gains is None:
            tell("cancelled while gains were found.")
            return 130
        bench = RobotBench.of(task, gains, seconds, file.rig, file.limits, pair)
        rehearsed = bench.rehearse(_named("rehearsing", update))
    with tempfile.TemporaryDirectory() as folder, progress_bar(file.rig.name) as update:
        log = Path(folder) / "run.nc" if outputs.save is None else log_of(outputs.save)
        run = bench.run(log, _named("running", update))
        if outputs.save is not None and run.path == log != outputs.save:
            save_dataset(run.data, outputs.save)
            log.unlink()
    settings = {"robot": robot, **given, "rig": str(on.rig), "reference": reference.reference, "time": seconds}
    settings |= {"gains": task.gains_text(gains), **reference.shape()}
    attributes = {"status": run.status, "status_reason": run.reason}
    attributes["provenance"] = json.dumps(provenance({name: x for name, x in settings.items() if x is not None}))
    title = f"{task.robot.description.name}: {task.robot.reading.name} by {task.command.name} on {file.rig.name}"
    title += f": {run.status}, {run.data.sizes['time']} samples"
    tables = [_errors(bench, task, {"model": rehearsed, "rig": run.data})]
    write(Summary(title, tables, notes=_notes(task, gains, run.data), attributes=attributes))
    if run.status != "finished":
        tell(f"{run.status}: {run.reason}")
    if outputs.plot is not None:
        from nectosome.view import show_experiment

        show_experiment([rehearsed, run.data], outputs.plot)
    report(outputs.save, outputs.plot)
    return CODES[run.status]


def _named(what: str, update: Callable[[str, float], None]) -> Callable[[float], None]:
    return lambda share: update(what, share)


def _errors(bench: "RobotBench", task: "ControlTask", runs: "dict[str, xr.Dataset]") -> Table:
    """Tracking errors on the model and on the rig; a step begins with the second sample."""
    import numpy as np

    from nectosome.rigs.robot_bench import tracked

    (loop,) = bench.loops.values()
    rows: dict[Label, list[Number]] = {}
    for data in runs.values():
        measured, reference = (signal[1:] for signal in tracked(data, loop.measurement))
        if not len(measured):
            continue
        time = bench.dt * np.arange(len(measured))
        for label, number in tracking_errors(time, measured, reference, task.robot.reading.unit, task.reference.show):
            rows.setdefault(label, []).append(number)
    heads = {"what": f"{task.robot.reading.name} by {task.command.name}", **{name: name for name in runs}}
    return Table("tracking", heads, [(label, *numbers) for label, numbers in rows.items()])


def _notes(task: "ControlTask", gains: "LoopGains", data: "xr.Dataset") -> list[str]:
    """Gains, sampling, and late samples."""
    found = f"gains: {task.gains_text(gains)} ({', '.join(task.gain_units())})"
    if gains.experiment is not None:
        found += ", from a relay experiment on the model"
        found += f", detuned to {gains.speed:g} of their speed" if gains.speed < 1 else ""
    sampled = f"sampled at {show_quantity(1 / task.robot.dt, 'frequency')}"
    if late := int(data.attrs["overruns"]):
        sampled += f"; {late} samples late, {show_quantity(float(data.attrs['latest']), 'time')} at most"
    return [found, sampled]
