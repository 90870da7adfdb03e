"""`nectosome control ROBOT --rig FILE`: the controller of a robot, rehearsed on its model, on a rig of the robot."""

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from nectosome import view
from nectosome.cli.options import ReferenceOptions, named_options
from nectosome.cli.output import Outputs, check_target, report, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance, save_dataset
from nectosome.io.file_system import exists
from nectosome.io.results import SUFFIXES
from nectosome.io.summary import Summary
from nectosome.io.tables import Label, Number, Table
from nectosome.units import InputError, count, show_quantity

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from jaxtyping import Float

    from nectosome.controllers import CommandRange, ControlTask, FoundController
    from nectosome.rigs import Bench, Pair, RigRun
    from nectosome.rigs.rig_file import RigFile

CODES = {"finished": 0, "aborted": 1, "failed": 1, "interrupted": 130}
_OWN_RIG = (
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
    from nectosome.rigs import Pair

    assert on.rig is not None
    file, timing, pairs = rig_file(on.rig), dict[str, Any](), None
    if file is not None:
        if given.pop("rate"):
            raise InputError("is not possible with --rig: dt of the rig file is the sample time.", field="--rate")
        timing = {"rate": 1 / file.dt}
    elif on.rig_command or on.rig_measure:
        option = "--rig-command" if on.rig_command else "--rig-measure"
        raise InputError("names a channel of a rig file, and --rig simulated is the robot itself.", field=option)
    with named_options():
        with progress_bar(Path(robot).stem):
            task = ControlTask.parse(robot, reference=reference.reference, **timing, **given, **reference.shape())
            seconds = reference.seconds() or task.reference.duration(task.robot.dt)
        if file is not None:
            try:
                pairs = {"": Pair.of(file.rig, on.rig_command, on.rig_measure)}
            except InputError as error:
                raise InputError(error.message, field=f"--rig-{error.field}") from None
        settings = {"robot": robot, **given, "rig": str(on.rig), "reference": reference.reference, **reference.shape()}
        return loops_on_rig({"": task}, seconds, file, pairs, settings, outputs)


def rig_file(rig: Path) -> "RigFile | None":
    """A rig file; None where the rig is the robot itself. Raises InputError."""
    from nectosome.rigs.rig_file import load_rig
    from nectosome.rigs.robot_bench import SIMULATED

    return None if str(rig) == SIMULATED else load_rig(rig)


def loops_on_rig(
    tasks: "Mapping[str, ControlTask]",
    seconds: float,
    file: "RigFile | None",
    pairs: "Mapping[str, Pair] | None",
    settings: dict[str, Any],
    outputs: Outputs,
    errors_of: Callable[[str], AbstractContextManager[None]] = lambda _: nullcontext(),
) -> int:
    """Find the controller of each task alone, rehearse all together, run the rig, and write what came out.

    - tasks: by the names of their loops; the only one of a robot has none.
    - file, pairs: the rig and its channels for each loop; None for the robot itself.
    - settings: for the provenance.
    - errors_of: where errors of a loop are placed.
    """
    from nectosome.rigs.robot_bench import check_pair, own_rig, robot_bench

    every = [*tasks.values()]
    name = every[0].robot.description.name
    if file is None or pairs is None:
        rig, limits, own = own_rig(every, seconds)
        pairs = dict(zip(tasks, own, strict=True))
    else:
        rig, limits = file.rig, file.limits
    for key, task in tasks.items():
        with errors_of(key):
            check_pair(task, rig, limits, pairs[key])
    slews = {key: limits.commands[pair.command].slew for key, pair in pairs.items()}
    rounds = max(task.rounds for task in every)
    with progress_bar(name) as update:
        laws = cancellable(lambda progress: _laws(tasks, seconds, slews, errors_of, progress), update)
        if laws is None:
            tell(f"cancelled while the controller{'s were' if len(tasks) > 1 else ' was'} found.")
            return 130
        saved = names_of_runs(outputs, rounds)
        bench = robot_bench(every, [*laws.values()], seconds, rig, limits, [*pairs.values()])
        rehearsed = bench.rehearse(rounds, lambda share: update("rehearsing", share))
    runs = run_and_save(bench, saved, rounds)
    run, notes = runs[-1], list[str]()
    last = {"model": rehearsed[-1], "rig": run.data}
    tables = [errors_on_rig(key or "tracking", task, pairs[key].measurement, last) for key, task in tasks.items()]
    each = {"model": rehearsed, "rig": [one.data for one in runs]}
    for key, task in tasks.items():
        learned = rounds_on_rig(f"rounds {key}".strip(), task, pairs[key].measurement, each)
        tables += [] if learned is None else [learned]
        written = run.data[f"{pairs[key].command}.command"].values
        words = [*law_notes(task, laws[key]), *([command_note(task.command, written)] if written.size else [])]
        notes += [f"{key}, {one}" if key else one for one in words]
    notes += [_sampling_note(run.data), *([_OWN_RIG] if file is None else [])]
    texts = {key: task.gains_text(gains) for key, task in tasks.items() if (gains := laws[key].gains)}
    settings = settings | {"time": seconds, "gains": texts.get("", texts)}
    attributes = {"status": run.status, "status_reason": run.reason}
    attributes["provenance"] = json.dumps(provenance({key: x for key, x in settings.items() if x is not None}))
    what = f"{every[0].robot.reading.name} by {every[0].command.name}" if "" in tasks else count(len(tasks), "loop")
    title = f"{name}: {what} on {rig.name}: {run.status}, {run.data.sizes['time']} samples"
    summary = Summary(title, tables, notes=notes, attributes=attributes)
    return conclude(summary, runs, [rehearsed[-1], run.data], saved, outputs)


def _laws(
    tasks: "Mapping[str, ControlTask]",
    seconds: float,
    slews: Mapping[str, float],
    errors_of: Callable[[str], AbstractContextManager[None]],
    progress: Callable[[str, float], bool],
) -> "dict[str, FoundController] | None":
    """The controller of each loop, found alone; None where `progress` returns False."""
    found: dict[str, FoundController] = {}
    for k, (key, task) in enumerate(tasks.items()):

        def report(what: str, share: float, k: int = k, key: str = key) -> bool:
            return progress(f"{key}, {what}" if key else what, (k + share) / len(tasks))

        with errors_of(key):
            law = task.find_law(seconds, report, slew=slews[key])
        if law is None:
            return None
        found[key] = law
    return found


def names_of_runs(outputs: Outputs, runs: int) -> list[Path]:
    """Files of all runs, numbered where there are several; none where nothing is saved. Raises InputError."""
    save = outputs.save
    if save is None:
        return []
    saved = [save if runs == 1 else save.with_stem(f"{save.stem}_{k + 1}") for k in range(runs)]
    for path in saved:
        check_target(path, "--save", SUFFIXES, outputs.force)
    return saved


def run_and_save(
    bench: "Bench", saved: Sequence[Path], rounds: int, seen: "Callable[[RigRun], None]" = lambda _: None
) -> "list[RigRun]":
    """The runs on the rig, whose logs go to files where these are given; `seen` is called after each."""
    runs: list[RigRun] = []
    with tempfile.TemporaryDirectory() as folder, progress_bar(bench.rig.name) as update:
        logs = [_log_of(path) for path in saved] or [Path(folder) / f"run_{k}.nc" for k in range(rounds)]
        for k, run in enumerate(bench.runs(logs, lambda share: update("running", share))):
            if saved and run.path == logs[k] != saved[k]:
                save_dataset(run.data, saved[k])
                logs[k].unlink()
            runs.append(run)
            seen(run)
    return runs


def _log_of(path: Path) -> Path:
    """Where the log of a run is written: netCDF, of which a table is made, or a file replaced, at its end."""
    return path if path.suffix == ".nc" and not exists(path) else path.with_name(f"{path.stem}_log.nc")


def conclude(
    summary: Summary,
    runs: "Sequence[RigRun]",
    drawn: "Sequence[xr.Dataset]",
    saved: Sequence[Path],
    outputs: Outputs,
) -> int:
    """Exit code of the last run, after its summary, why it ended, and a page of the runs that are `drawn`."""
    write(summary)
    run = runs[-1]
    if run.status != "finished":
        tell(f"{run.status}: {run.reason}")
    if remarks := run.data.attrs.get("remarks"):
        tell(remarks)
    if outputs.plot is not None:
        view.show_experiment(drawn, outputs.plot)
    report(*filter(exists, saved[: len(runs)]), outputs.plot)
    return CODES[run.status]


def _sampling_note(data: "xr.Dataset") -> str:
    """Rate of samples, and those that are late."""
    sampled = f"sampled at {show_quantity(1 / float(data.attrs['dt']), 'frequency')}"
    if late := int(data.attrs["overruns"]):
        sampled += f"; {late} samples late, {show_quantity(float(data.attrs['latest']), 'time')} at most"
    return sampled


def law_notes(task: "ControlTask", law: "FoundController") -> list[str]:
    """Gains and where they come from, and the model that the controller has."""
    gains, model = law.gains, law.model
    if gains is None:
        return []
    notes = [f"gains: {task.gains_text(gains)} ({', '.join(task.gain_units())})"]
    if gains.experiment is not None:
        period = gains.experiment.ultimate.period
        notes[0] += f", from a relay experiment on the model, which oscillates with a period of {period:.3g} s"
        slowed = ", ".join(f"{speed:g}" for speed in gains.speeds)
        notes[0] += f", detuned to {slowed} of their speed" if min(gains.speeds) < 1 else ""
    if model is not None:
        order = len(model.poles) - 1
        parts = [count(n, what) for n, what in ((model.integrators, "integrator"), (order, "pole")) if n]
        parts += [f"a delay of {count(model.delay, 'sample')}"] if model.delay else []
        share = f"explains {100 * model.explained:.3g} % of what the command does"
        notes.append(f"linear model: {', '.join(parts)}; it {share} in a run of the robot about the reference")
    return notes


def loop_notes(task: "ControlTask", laws: "Sequence[FoundController]") -> tuple[list[str], list[str]]:
    """Notes on controllers and sampling, and warnings; none stands twice."""
    beat, dt, warnings = task.beat, task.robot.dt, list[str]()
    found = [law.gains.experiment for law in laws if law.gains is not None]
    if any(experiment is not None and experiment.ultimate.period <= 3 * dt for experiment in found):
        warnings.append(
            "under the relay a period takes three samples or fewer, so the gains are rough; take a higher --rate"
        )
    sampling = f"sampled at {show_quantity(1 / dt, 'frequency')}"
    if task.sensor.beat is not None:
        sampling += f", averaged over a beat of {show_quantity(1 / task.sensor.beat.frequency, 'time')}"
        sampling += " at first" if task.sensor.beat.nominal else ""
    if beat is not None and task.sensor.beat is None and beat.frequency * dt > 0.5:
        beats = show_quantity(beat.frequency, "frequency")
        warnings.append(f"a beat of {beats} appears as an offset at this rate (aliasing); see --mean")
    return [*dict.fromkeys(note for law in laws for note in law_notes(task, law)), sampling], warnings


def errors_on_rig(key: str, task: "ControlTask", measurement: str, runs: "Mapping[str, xr.Dataset]") -> Table:
    """Tracking errors of a measurement in some runs, such as on the model and on the rig, by their names.

    A step begins with the second sample. Where the controller takes the mean over a beat, so do the errors.
    """
    import numpy as np

    from nectosome.controllers import tracking_rows

    rows: dict[Label, list[Number]] = {}
    for data in runs.values():
        measured, reference = _tracked(task, measurement, data)
        if not len(measured):
            continue
        time = task.robot.dt * np.arange(len(measured))
        for label, number in tracking_rows(time, measured, reference, task.robot.reading.unit, task.reference.show):
            rows.setdefault(label, []).append(number)
    heads = {"what": f"{task.robot.reading.name} by {task.command.name}", **{name: name for name in runs}}
    return Table(key, heads, [(label, *numbers) for label, numbers in rows.items()])


def rounds_on_rig(
    key: str, task: "ControlTask", measurement: str, runs: "Mapping[str, Sequence[xr.Dataset]]"
) -> Table | None:
    """The rms error of each round of a controller that learns, on the model and on the rig; None for one round."""
    from nectosome.controllers import rms_error

    if task.rounds == 1:
        return None
    rows = list[tuple[str | Number, ...]]()
    for k in range(max(map(len, runs.values()))):
        errors = [rms_error(*_tracked(task, measurement, rounds[k])) for rounds in runs.values() if k < len(rounds)]
        unit, show = task.robot.reading.unit, task.reference.show
        rows.append((str(k + 1), *(Number(error, unit, shown=show(error)) for error in errors)))
    return Table(key, {"round": "rms error of round", **{name: name for name in runs}}, rows)


def _tracked(task: "ControlTask", measurement: str, data: "xr.Dataset") -> "tuple[np.ndarray, np.ndarray]":
    """Measurement and reference from the second sample on."""
    from nectosome.controllers import BeatMean
    from nectosome.rigs.bench import tracked

    measured, reference = tracked(data, measurement)
    if task.sensor.beat is not None and len(measured):
        measured = BeatMean.of_samples(task.sensor.beat, measured, task.robot.dt)
    return measured[1:], reference[1:]


def command_note(span: "CommandRange", command: "Float[np.ndarray, 'k']") -> str:
    """Range, last mean and saturation of a command at its samples."""
    ends = f"{span.show(command.min())} to {span.show(command.max())}"
    last = span.show(command[-max(len(command) // 10, 1) :].mean())
    share = f"saturated in {100 * span.at_limits(command).mean():.0f} % of the samples"
    return f"command: {ends}, mean of the last tenth {last}; {share}"
