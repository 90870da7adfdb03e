"""`nectosome control`: a robot under a controller of one quantity; `loops`: under several; `rig`: a rig under one."""

import json
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from nectosome import view
from nectosome.cli.control_on_rig import (
    RigOptions,
    command_note,
    conclude,
    control_on_rig,
    loop_notes,
    loops_on_rig,
    names_of_runs,
    rig_file,
    run_and_save,
)
from nectosome.cli.control_side_by_side import compare_controllers
from nectosome.cli.output import Outputs, tell, unsolved, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import load_dataset, provenance
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table
from nectosome.units import InputError, dimension_of, show_quantity, unit_to_si

from .options import ReferenceOptions, Robot, Settings, command, named_options, robot_named, tell_far_out, value, whole

if TYPE_CHECKING:
    from nectosome.controllers import ControlResult
    from nectosome.rigs import RigRun


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
            help="pid, scheduled (by frequency), or with a linear model of the robot ff-pid, mpc, or ilc, which "
            "learns. Several, as in pid,mpc, are compared."
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
    several = "," in controller
    if on.rig is not None:
        if several:
            raise InputError("takes one --controller at a time. Compare them without it first.", field="--rig")
        return control_on_rig(on, robot, given, reference, outputs)
    if several:
        return compare_controllers(robot, given, reference, outputs)

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
        table = outputs.save is not None and outputs.save.suffix == ".csv"
        data = run.samples() if table else result.to_dataset().assign_attrs(seconds=seconds)
        outputs.write(data, lambda _, path: view.show_closed_loop(run.signals(), path))
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
    assert result.law is not None
    notes, warnings = loop_notes(result.task, [result.law])
    notes.append(command_note(result.task.command, run.command))
    title = f"{run.title}, {run.time[-1]:.4g} s"
    return Summary(title, tables, notes=notes, warnings=warnings, attributes=attributes)


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


@control.command(name="rig")
def control_rig(
    *,
    config: Annotated[Path, Parameter(help="Rig file (.yaml): device, sample time, limits.")],
    reference: ReferenceOptions,
    controller: Annotated[
        str | None,
        Parameter(
            help="pid, scheduled (by frequency), ff-pid, mpc, or ilc, which learns; ff-pid with a model, else pid."
        ),
    ] = None,
    gains: Annotated[
        str | None,
        value(
            "K_p,K_i,K_d in the units of the rig file's limits and of --reference, and s, or such rows by frequency; "
            "by default found on the model."
        ),
    ] = None,
    model: Annotated[
        Path | None,
        Parameter(help="Model of the rig (.nc), as `identify hysteresis --save` writes it; a simulated rig has one."),
    ] = None,
    rounds: Annotated[int, whole("Runs of ilc.", 1, 100)] = 5,
    command: Annotated[str | None, value("Command of the rig; may be left out where it has one.")] = None,
    measure: Annotated[
        str | None, value("Measurement that follows the reference; may be left out where the rig has one.")
    ] = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Rehearse on the model, where there is one, then run the rig with its guards, and log it.

    The rig is vented at the end of every run. A run that the guards would stop on the model does not begin.
    """
    outputs.check()

    from nectosome.controllers import PIDGains, Reference, controller_named
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.rigs import Pair, actuator_bench
    from nectosome.rigs.rig_file import load_rig

    with named_options():
        runs = rounds if controller is not None and controller_named(controller).learns else 1
    saved, file = names_of_runs(outputs, runs), load_rig(config)
    with named_options():
        pair = Pair.of(file.rig, command, measure)
        identified = file.models.get(pair.command) if model is None else saved_model(load_dataset(model), str(model))
        of = dimension_of(file.rig.measurements[pair.measurement])
        target = Reference.parse(reference.reference, of, **reference.shape())
        seconds = reference.seconds()
        samples = target.samples(target.duration(file.dt) if seconds is None else seconds, file.dt)
        given = None if gains is None else PIDGains.parse(gains, file.unit_size(pair.command) / target.unit_size)
        with progress_bar("rehearsing"):
            bench = actuator_bench(
                file.rig, file.limits, file.dt, samples, controller, given, identified, pair, target.kind
            )
            bench.rehearse()
    errors = list[dict[str, tuple[float, float]]]()
    done = run_and_save(bench, saved, runs, lambda run: errors.append(bench.errors(run)))
    summary = _rig_summary(done, errors, rehearsed=bench.model is not None)
    return conclude(summary, done, [run.data for run in done], saved, outputs)


def _rig_summary(found: "list[RigRun]", scored: list[dict[str, tuple[float, float]]], *, rehearsed: bool) -> Summary:
    """Errors and commands of each run."""
    notes = [] if rehearsed else ["not rehearsed: there is no --model"]
    heads = {"run": "run", "status": "ended", "samples": "samples", "command_min": "command from", "command_max": "to"}
    heads |= {"late": "late samples", "latest": "latest"}
    runs, errors = list[tuple[str | Number, ...]](), list[tuple[str | Number, ...]]()
    for k, (run, of_run) in enumerate(zip(found, scored, strict=True), start=1):
        data = run.data
        (of,) = json.loads(data.attrs["loops"])
        command, unit = data[f"{of}.command"].values, str(data[f"{of}.command"].attrs["units"])
        ends = map(float, (command.min(), command.max())) if command.size else (math.nan, math.nan)
        shown = (Number(x, unit, shown=show_quantity(x, dimension_of(unit)) if command.size else "") for x in ends)
        late = Number(int(data.attrs["overruns"])), Number(float(data.attrs["latest"]), "s")
        samples = Number(data.sizes["time"], shown=f"{data.sizes['time']}")
        runs.append((str(k), run.status, samples, *shown, *(late if late[0].value else ())))
        for name, error in of_run.items():
            errors.append((str(k), f"{name} error", *(Number(x / 100, shown=f"{x:.3g} %") for x in error)))
    of_errors = {"run": "run", "of": "of the reference's range", "rms": "rms", "largest": "largest"}
    tables = [Table("runs", heads, runs, listed=True), Table("errors", of_errors, errors, listed=True)]
    last = found[-1]
    attributes = {"status": last.status, "status_reason": last.reason}
    title = f"{last.data.attrs['title']}: {last.status}, {last.data.sizes['time']} samples"
    return Summary(title, tables, above=notes, attributes=attributes)
