"""What there is to say of a loop: how well it tracks its reference, its gains, its model and its command."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from nectosome.io.tables import Label, Number, Table
from nectosome.units import count

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from jaxtyping import Float

    from nectosome.controllers import CommandRange, ControlTask, FoundController


def tracking_errors(
    time: "Float[np.ndarray, 'k']",
    output: "Float[np.ndarray, 'k']",
    reference: "Float[np.ndarray, 'k']",
    unit: str,
    show: Callable[[float], str],
) -> list[tuple[Label, Number]]:
    """Rise, overshoot and settling of a step, and errors of any reference; `show` writes a value of it."""
    import numpy as np

    from nectosome.controllers import rms_error, step_response

    rows = list[tuple[Label, Number]]()

    def add(key: str, name: str, value: float, unit: str, shown: str) -> None:
        rows.append((Label(key, name), Number(float(value), unit, shown=shown if np.isfinite(value) else "never")))

    answer, largest = step_response(time, output, reference), np.abs(output - reference).max()
    if answer is not None:
        add("rise", "rise, 10 to 90 %", answer.rise, "s", f"{answer.rise:.4g} s")
        add("overshoot", "overshoot", answer.overshoot, "", f"{100 * answer.overshoot:.4g} %")
        add("settling", "settled within 5 %, from", answer.settling, "s", f"{answer.settling:.4g} s")
        add("steady_error", "steady error", answer.steady_error, unit, show(answer.steady_error))
    rms = rms_error(output, reference)
    add("rms_error", "rms error", rms, unit, show(rms))
    add("largest_error", "largest error", largest, unit, show(largest))
    return rows


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


def errors_on_rig(key: str, task: "ControlTask", measurement: str, runs: "Mapping[str, xr.Dataset]") -> Table:
    """Tracking errors of a measurement in some runs, such as on the model and on the rig, by their names.

    A step begins with the second sample. Where the controller takes the mean over a beat, so do the errors.
    """
    import numpy as np

    rows: dict[Label, list[Number]] = {}
    for data in runs.values():
        measured, reference = _tracked(task, measurement, data)
        if not len(measured):
            continue
        time = task.robot.dt * np.arange(len(measured))
        for label, number in tracking_errors(time, measured, reference, task.robot.reading.unit, task.reference.show):
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
    import numpy as np

    saturated = np.isclose(command, span.low) | np.isclose(command, span.high)
    ends = f"{span.show(command.min())} to {span.show(command.max())}"
    last = span.show(command[-max(len(command) // 10, 1) :].mean())
    share = f"saturated in {100 * np.mean(saturated):.0f} % of the samples"
    return f"command: {ends}, mean of the last tenth {last}; {share}"
