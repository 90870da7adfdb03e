"""`nectosome control ROBOT --rig FILE`: the controller of a robot, rehearsed on its model, on a rig of the robot."""

import json
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from nectosome.cli.control_rig import CODES, log_of, names_of_runs
from nectosome.cli.loop_errors import command_note, errors_on_rig, law_notes, rounds_on_rig
from nectosome.cli.options import ReferenceOptions, named_options
from nectosome.cli.output import Outputs, report, tell, write
from nectosome.cli.page import Summary
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance, save_dataset
from nectosome.io.file_system import exists
from nectosome.units import InputError, show_quantity

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.controllers import ControlTask, FoundController
    from nectosome.rigs import Pair, Rig, RigRun
    from nectosome.rigs.robot_bench import RobotBench

OWN_RIG = (
    "the rig is the robot itself, simulated: it differs from its model by noise only. A rig file has another robot, or "
    "devices: see nectosome new rig"
)


@Parameter(name="*")
@dataclass(frozen=True)
class RigOptions:
    """A rig of the robot, as options of the command line."""

    rig: Annotated[
        Path | None,
        Parameter(
            help="Rig on which to run it, after a rehearsal on the model: a rig file (.yaml), whose dt is the sample "
            "time, or simulated, the robot itself."
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
    """Find the controller on the model, rehearse under the guards of the rig, then run the rig, and log it.

    `given` are the other arguments of `controllers.control`.
    """
    from nectosome.controllers import ControlTask
    from nectosome.rigs.files import load_rig
    from nectosome.rigs.robot_bench import RobotBench, check_pair
    from nectosome.rigs.robot_loops import SIMULATED, own_rig

    assert on.rig is not None
    file, timing = None, dict[str, Any]()
    if str(on.rig) != SIMULATED:
        if given.pop("rate"):
            raise InputError("is not possible with --rig: dt of the rig file is the sample time.", field="--rate")
        file = load_rig(on.rig)
        timing = {"rate": 1 / file.dt}
    elif on.rig_command or on.rig_measure:
        option = "--rig-command" if on.rig_command else "--rig-measure"
        raise InputError("names a channel of a rig file, and --rig simulated is the robot itself.", field=option)
    with named_options(), progress_bar(Path(robot).stem) as update:
        task = ControlTask.parse(robot, reference=reference.reference, **timing, **given, **reference.shape())
        seconds = reference.seconds() or task.reference.duration(task.robot.dt)
        if file is None:
            rig, limits, (pair,) = own_rig([task], seconds)
        else:
            rig, limits, pair = file.rig, file.limits, _pair(on, file.rig)
        check_pair(task, rig, limits, pair)
        slew = limits.commands[pair.command].slew
        law = cancellable(lambda progress: task.find_law(seconds, progress, slew=slew), update)
        if law is None:
            tell("cancelled while the controller was found.")
            return 130
        saved = names_of_runs(outputs, task.rounds)
        bench = RobotBench.of(task, law, seconds, rig, limits, pair)
        rehearsed = bench.rehearse(task.rounds, named("rehearsing", update))
    runs = run_and_save(bench, saved, task.rounds)
    run = runs[-1]
    settings = {"robot": robot, **given, "rig": str(on.rig), "reference": reference.reference, "time": seconds}
    settings |= {"gains": task.gains_text(law.gains), **reference.shape()}
    attributes = {"status": run.status, "status_reason": run.reason}
    attributes["provenance"] = json.dumps(provenance({name: x for name, x in settings.items() if x is not None}))
    title = f"{task.robot.description.name}: {task.robot.reading.name} by {task.command.name} on {rig.name}"
    title += f": {run.status}, {run.data.sizes['time']} samples"
    tables = [errors_on_rig("tracking", task, pair.measurement, {"model": rehearsed[-1], "rig": run.data})]
    rounds = rounds_on_rig("rounds", task, pair.measurement, {"model": rehearsed, "rig": [one.data for one in runs]})
    tables += [] if rounds is None else [rounds]
    notes = [*loop_notes(task, law, pair.command, run.data), sampling_note(run.data)]
    notes += [OWN_RIG] if file is None else []
    return conclude(Summary(title, tables, notes=notes, attributes=attributes), rehearsed[-1], runs, saved, outputs)


def _pair(on: RigOptions, rig: "Rig") -> "Pair":
    """Command and measurement of a rig. Raises InputError, whose field is the option."""
    from nectosome.rigs import Pair

    try:
        return Pair.of(rig, on.rig_command, on.rig_measure)
    except InputError as error:
        option = {"command": "--rig-command", "measurement": "--rig-measure"}[error.field or ""]
        raise InputError(error.message, field=option) from None


def run_and_save(bench: "RobotBench", saved: Sequence[Path], rounds: int) -> "list[RigRun]":
    """The runs on the rig, whose logs go to files where these are given."""
    runs: list[RigRun] = []
    with tempfile.TemporaryDirectory() as folder, progress_bar(bench.rig.name) as update:
        logs = [log_of(path) for path in saved] or [Path(folder) / f"run_{k}.nc" for k in range(rounds)]
        for k, run in enumerate(bench.runs(logs, named("running", update))):
            if saved and run.path == logs[k] != saved[k]:
                save_dataset(run.data, saved[k])
                logs[k].unlink()
            runs.append(run)
    return runs


def conclude(
    summary: Summary, rehearsed: "xr.Dataset", runs: "Sequence[RigRun]", saved: Sequence[Path], outputs: Outputs
) -> int:
    """Exit code of the last run, after its summary, why it ended, and its page."""
    write(summary)
    run = runs[-1]
    if run.status != "finished":
        tell(f"{run.status}: {run.reason}")
    if outputs.plot is not None:
        from nectosome.view import show_experiment

        show_experiment([rehearsed, run.data], outputs.plot)
    report(*filter(exists, saved[: len(runs)]), outputs.plot)
    return CODES[run.status]


def named(what: str, update: Callable[[str, float], None]) -> Callable[[float], None]:
    """Progress of a part of the work."""
    return lambda share: update(what, share)


def loop_notes(task: "ControlTask", law: "FoundController", command: str, data: "xr.Dataset") -> list[str]:
    """Gains and model of a loop, and what its command of the rig does."""
    written = data[f"{command}.command"].values
    return [*law_notes(task, law), *([command_note(task.command, written)] if written.size else [])]


def sampling_note(data: "xr.Dataset") -> str:
    """Rate of samples, and those that are late."""
    sampled = f"sampled at {show_quantity(1 / float(data.attrs['dt']), 'frequency')}"
    if late := int(data.attrs["overruns"]):
        sampled += f"; {late} samples late, {show_quantity(float(data.attrs['latest']), 'time')} at most"
    return sampled
