"""`nectosome control ROBOT`: a robot under a controller that sets one of its quantities, and `loops`: under several."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from nectosome.cli.command_list import command
from nectosome.cli.control_on_rig import RigOptions, command_note, control_on_rig, law_notes, loops_on_rig, rig_file
from nectosome.cli.options import (
    ReferenceOptions,
    Robot,
    Settings,
    named_options,
    robot_named,
    tell_far_out,
    value,
    whole,
)
from nectosome.cli.output import Outputs, tell, unsolved, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import show_quantity, unit_to_si

if TYPE_CHECKING:
    from nectosome.controllers import ControlResult


control = command(
    App(
        name="control",
        help="Control a robot, in one loop or several, or a rig: control ROBOT ..., control loops ROBOT FILE, "
        "control rig --config FILE ...",
    )
)


@control.default
def control_robot(
    robot: Robot,
    /,
    *,
    command: Annotated[
        str, Parameter(help="Quantity that the controller sets, and its range: PATH=LOW..HIGH, such as bias=-8..8mN m.")
    ],
    measure: Annotated[
        str, Parameter(help="Reading that is measured: heading, depth, ... of the body, arm.angle of a joint.")
    ],
    reference: ReferenceOptions,
    controller: Annotated[
        str,
        Parameter(
            help="pid, scheduled (by frequency), or with a linear model of the robot ff-pid, mpc, or ilc, which learns."
        ),
    ] = "pid",
    rounds: Annotated[int | None, whole("Runs of ilc, 5 by default.", 1, 100)] = None,
    gains: Annotated[
        str | None,
        value(
            "K_p,K_i,K_d in the units of --command and --reference, and s, or such rows by frequency; by default "
            "found on the model."
        ),
    ] = None,
    rate: Annotated[str | None, value("Sampling rate; by default 20 Hz, or four a beat with --mean.")] = None,
    mean: Annotated[bool, Parameter(help="Average the measurement over the last beat of the drives.")] = False,
    noise: Annotated[str | None, value("Standard deviation of a measurement.")] = None,
    delay: Annotated[str | None, value("Delay of measurements.")] = None,
    settings: Settings = None,
    on: RigOptions = RigOptions(),
    outputs: Outputs = Outputs(),
) -> int:
    """Simulate a robot under a controller that makes a reading track a reference; with --rig, run it on its rig."""
    outputs.check()
    with named_options():
        reference.seconds()
    given = {"command": command, "measure": measure, "controller": controller, "rounds": rounds, "gains": gains}
    given |= {"rate": rate, "mean": mean, "noise": noise}
    given |= {"delay": delay, "settings": settings or ()}
    tell_far_out(robot_named(robot, settings), robot)
    if on.rig is not None:
        return control_on_rig(on, robot, given, reference, outputs)

    from nectosome import controllers

    start = time.perf_counter()
    with progress_bar(Path(robot).stem) as update, named_options():
        result = cancellable(
            lambda progress: controllers.control(
                robot,
                reference=reference.reference,
                time=reference.time,
                progress=progress,
                **given,
                **reference.shape(),
            ),
            update,
        )
    if result.law is None:
        tell("cancelled while the controller was found.")
        return 130
    seconds = round(time.perf_counter() - start, 3)
    write(_summary(result, seconds))
    run = result.record
    if outputs.given and len(run.intervals) > 1:
        from nectosome.view import show_closed_loop

        table = outputs.save is not None and outputs.save.suffix == ".csv"
        data = run.samples() if table else result.to_dataset().assign_attrs(seconds=seconds)
        outputs.write(data, lambda _, path: show_closed_loop(run.signals(), path))
    return _code(result)


def _code(result: "ControlResult") -> int:
    """Exit code, after a sentence about what went wrong."""
    from nectosome.core import Status

    run, name = result.record, result.record.robot.description.name
    if run.status == Status.CANCELLED:
        tell(f"cancelled at {run.time[-1]:.4g} s.")
        return 130
    if run.status != Status.SOLVED:
        return unsolved(name, run.status, f"{run.status.reason}, at {run.time[-1]:.4g} s.")
    if why := result.missed():
        tell(f"{name}: {why}")
        return 1
    return 0


def _summary(result: "ControlResult", seconds: float) -> Summary:
    """Tracking errors, gains, sampling and commands of a run."""
    from nectosome.controllers import tracking_rows

    run, reference = result.record, result.task.reference
    unit = unit_to_si(reference.unit)[1] if reference.unit else ""
    rows = tracking_rows(run.time, run.output, run.reference, unit, reference.show)
    tables = [Table("tracking", {"what": f"{run.robot.reading.name} by {run.robot.command}", "value": ""}, rows)]
    if len(result.errors) > 1:
        of_rounds = [(str(k), Number(x, unit, shown=reference.show(x))) for k, x in enumerate(result.errors, start=1)]
        tables.append(Table("rounds", {"round": "round", "rms_error": "rms error"}, of_rounds))
    attributes = {"status": run.status.name, "status_reason": run.status.reason, "seconds": seconds}
    attributes["provenance"] = json.dumps(provenance(result.settings))
    notes, warnings = _lines(result)
    title = f"{run.title}, {run.time[-1]:.4g} s"
    return Summary(title, tables, notes=notes, warnings=warnings, attributes=attributes)


def _lines(result: "ControlResult") -> tuple[list[str], list[str]]:
    """Notes on the controller, sampling and commands, and warnings."""
    task, law, run = result.task, result.law, result.record
    assert law is not None
    span, beat, dt = task.command, task.beat, task.robot.dt
    notes, warnings = law_notes(task, law), list[str]()
    if law.gains is not None and law.gains.experiment is not None and law.gains.experiment.ultimate.period <= 3 * dt:
        warnings.append(
            "under the relay a period takes three samples or fewer, so the gains are rough; take a higher --rate"
        )
    sampling = f"sampled at {show_quantity(1 / dt, 'frequency')}"
    if task.sensor.beat is not None:
        sampling += f", averaged over a beat of {show_quantity(1 / task.sensor.beat.frequency, 'time')}"
        sampling += " at first" if task.sensor.beat.nominal else ""
    notes.append(sampling)
    notes.append(command_note(span, run.command))
    if beat is not None and task.sensor.beat is None and beat.frequency * dt > 0.5:
        beats = show_quantity(beat.frequency, "frequency")
        warnings.append(f"a beat of {beats} appears as an offset at this rate (aliasing); see --mean")
    return notes, warnings


@control.command(name="loops")
def control_loops(
    robot: Robot,
    file: Annotated[Path, Parameter(help="File of loops (.yaml): command, measure and reference of each.")],
    /,
    *,
    rig: Annotated[
        Path, Parameter(help="Rig on which to run them: a rig file (.yaml), or simulated, the robot itself.")
    ] = Path("simulated"),
    settings: Settings = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Run several controllers of a robot at once on a rig, after a rehearsal on the model.

    Controllers are found on the model, loop by loop, with the other commands at their initial values. Then
    all loops are rehearsed together, under the guards of the rig.
    """
    outputs.check()

    from nectosome.rigs.loops_file import load_loops

    tell_far_out(robot_named(robot, settings), robot)
    loops, on = load_loops(file), rig_file(rig)
    pairs = None if on is None else loops.pairs(on.rig)
    with progress_bar(Path(robot).stem):
        tasks = loops.tasks(robot, settings or (), None if on is None else on.dt)
        seconds = loops.seconds(tasks)
    given = loops.given.model_dump(mode="json", exclude_none=True, exclude={"about"})
    given |= {"robot": robot, "set": settings or [], "rig": str(rig)}
    return loops_on_rig(tasks, seconds, on, pairs, given, outputs, loops.errors_of)
