"""`nectosome control`: a robot, or a rig, simulated or real, made to follow a reference."""

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from cyclopts import App, Parameter

from nectosome.cli.control_robot import control_robot
from nectosome.cli.options import read_count
from nectosome.cli.output import check_target, tell, write
from nectosome.cli.progress import progress_bar
from nectosome.io import load_dataset
from nectosome.units import InputError, did_you_mean, parse_quantity, read_positive

if TYPE_CHECKING:
    import numpy as np

    from nectosome.papers.fishtail.bench import BenchRun

_CONTROLLERS = ("pid", "scheduled", "ff-pid", "ilc", "mpc")
_NEEDS = {
    "sine": ("--amplitude", "--frequency"),
    "triangle": ("--amplitude", "--frequency"),
    "chirp": ("--amplitude", "--frequency", "--to", "--time"),
}
_RIGS = ("sim", "ni")
_CODES = {"finished": 0, "aborted": 1, "failed": 1, "interrupted": 130}
_PER_BAR = 1e-5

control = App(name="control", help="Make a robot, or a rig, follow a reference: control ROBOT ..., or control RIG ...")
control.default(control_robot)


@control.command
def fishtail(
    *,
    reference: Annotated[
        str, Parameter(help="sine, triangle, chirp, variable (Fig. 10), or a recording with a displacement.")
    ],
    amplitude: Annotated[str | None, Parameter(help="Such as 6mm.", allow_leading_hyphen=True)] = None,
    frequency: Annotated[str | None, Parameter(help="Such as 0.04Hz.", allow_leading_hyphen=True)] = None,
    to: Annotated[str | None, Parameter(help="Last frequency of a chirp.", allow_leading_hyphen=True)] = None,
    time: Annotated[str | None, Parameter(help="How long; two periods unless told.", allow_leading_hyphen=True)] = None,
    controller: Annotated[
        str, Parameter(help="pid (the paper's), scheduled, ff-pid, mpc, or ilc, which learns run by run.")
    ] = "ff-pid",
    gains: Annotated[
        str | None,
        Parameter(help="K_p,K_i,K_d of pid, ff-pid, ilc; bar, mm and s.", allow_leading_hyphen=True),
    ] = None,
    model: Annotated[
        Path | None, Parameter(help="What `identify fishtail --save` wrote (.nc), instead of the paper's actuator.")
    ] = None,
    rig: Annotated[str, Parameter(help="sim, or ni.")] = "sim",
    config: Annotated[Path | None, Parameter(help="What the rig is wired like, and its limits (.yaml).")] = None,
    real_time: Annotated[bool, Parameter(help="A simulated rig by the clock.")] = False,
    rounds: Annotated[str, Parameter(help="Runs of ilc.", allow_leading_hyphen=True)] = "5",
    save: Annotated[
        Path | None, Parameter(help="Where the log goes (.nc); never overwritten. fishtail_1.nc, ... unless told.")
    ] = None,
    plot: Annotated[Path | None, Parameter(help="Where the page with figures goes (.html).")] = None,
) -> int:
    """Rehearse on a model, then run it on the rig, with its guards, and log it.

    The rig is vented on every way out. What would be stopped on the model does not begin.
    """
    for name, value, known in (("--controller", controller, _CONTROLLERS), ("--rig", rig, _RIGS)):
        if value not in known:
            raise InputError(f'"{value}" is not known: {", ".join(known)}.{did_you_mean(value, known)}', field=name)
    runs = read_count(rounds, "--rounds", least=1, most=100) if controller == "ilc" else 1
    if plot is not None:
        check_target(plot, "--plot", ".html")
    if rig != "sim" and config is None:
        raise InputError("a real rig needs a file that says how it is wired.", field="--config")
    if rig == "sim" and config is not None:
        raise InputError("a simulated rig has no wires: leave it out, or take another rig.", field="--config")
    if real_time and rig != "sim":
        raise InputError("a real rig has no other time: leave it out.", field="--real-time")
    course = _course(reference, amplitude, frequency, to, time)
    numbers = None if gains is None else _gains(gains)
    logs = _logs(save, runs)

    from nectosome.papers.fishtail.bench import Bench
    from nectosome.papers.fishtail.comparison import DT

    identified = None if model is None else load_dataset(model)
    if config is None:
        bench = Bench.of(identified, numbers)
    else:
        from nectosome.rigs.files import load_rig

        file = load_rig(config)
        if file.rig.command_unit != "Pa":
            told = f"is of a rig that takes {file.rig.command_unit}; the tail takes pressures."
            raise InputError(told, file=str(config), field="kind")
        if file.dt != DT:
            raise InputError(f"is {file.dt:g} s; the gains are for {DT:g} s.", file=str(config), field="dt")
        bench = Bench.of(identified, numbers, file.limits, file.rig)
    wanted = course.samples(DT)
    found: list[BenchRun] = []
    with progress_bar("rehearsing"):
        bench.check(controller, wanted)
    with progress_bar("running") as update:
        for outcome in bench.runs(
            controller, wanted, reference, logs, real_time, lambda k, share: update(logs[k].name, share)
        ):
            found.append(outcome)
            if outcome.run.status != "finished":
                break
    for outcome in found:
        write(*_told(outcome), wrap=False)
    last = found[-1].run
    if last.status != "finished":
        tell(f"{last.status}: {last.reason}")
    if plot is not None:
        from nectosome.view import show_experiment

        show_experiment([one.run.data for one in found], plot)
        write(f"written: {plot}")
    return _CODES[last.status]


def _logs(save: Path | None, runs: int) -> list[Path]:
    """Files of the runs. Raises InputError where one is there, or cannot be written."""
    if save is None:
        free = (Path(f"fishtail_{k}.nc") for k in itertools.count(1))
        logs = list(itertools.islice((path for path in free if not path.exists()), runs))
    else:
        logs = [save] if runs == 1 else [save.with_stem(f"{save.stem}_{k + 1}") for k in range(runs)]
    for log in logs:
        check_target(log, "--save", ".nc")
        if log.exists():
            raise InputError(f"{log} is there already, and what was measured is not overwritten.", field="--save")
    return logs


def _told(outcome: "BenchRun") -> list[str]:
    """What a person wants to know of a run."""
    data = outcome.run.data
    errors = {"measured": outcome.measured, "true": outcome.true}
    command = _PER_BAR * data["command"].values
    lines = [f"{data.attrs['title']}: {outcome.run.status}, {data.sizes['time']} samples"]
    lines += [f"  error, {what}: {both[0]:.3g} % rms, {both[1]:.3g} % at most" for what, both in errors.items() if both]
    if command.size:
        lines.append(f"  command: {command.min():.3g} to {command.max():.3g} bar")
    if data.attrs["overruns"]:
        lines.append(f"  late: {data.attrs['overruns']:g} samples, by up to {1e3 * data.attrs['latest']:.3g} ms")
    return [*lines, f"written: {outcome.run.path}"]


class _Course(NamedTuple):
    """A reference as asked for."""

    name: str
    amplitude: float = 0.0  # [m]
    frequencies: tuple[float, ...] = ()  # [Hz]
    time: float = 0.0  # [s]

    def samples(self, dt: float) -> "np.ndarray":
        """At even times."""
        from nectosome.controllers import chirp, sine, triangle
        from nectosome.papers.fishtail.bench import recorded_reference
        from nectosome.papers.fishtail.comparison import VARIABLE

        if self.name == "variable":
            return VARIABLE
        if self.name not in _NEEDS:
            return recorded_reference(Path(self.name), dt)
        first, last = self.frequencies[0], self.frequencies[-1]
        if self.name == "chirp":
            return chirp(self.amplitude, first, last, self.time, dt)
        return (sine if self.name == "sine" else triangle)(self.amplitude, first, self.time, dt)


def _course(name: str, amplitude: str | None, frequency: str | None, to: str | None, time: str | None) -> _Course:
    """Read the options. Raises InputError for some that are missing, or are not for this reference."""
    asked = {"--amplitude": amplitude, "--frequency": frequency, "--to": to, "--time": time}
    needed = _NEEDS.get(name, ())
    for option, text in asked.items():
        if text is None and option in needed:
            raise InputError(f"{name} needs it.", field=option)
        if text is not None and option not in (*needed, "--time" if needed else ""):
            raise InputError(f"{name} does not take it.", field=option)
    if not needed:
        if name != "variable" and not Path(name).suffix:
            raise InputError(
                f'"{name}" is no reference.{did_you_mean(name, (*_NEEDS, "variable"))}', field="--reference"
            )
        return _Course(name)
    size = read_positive(amplitude or "", "length", "--amplitude")
    options = [option for option in ("--frequency", "--to") if option in needed]
    turns = tuple(read_positive(asked[option] or "", "frequency", option) for option in options)
    return _Course(name, size, turns, 2 / turns[0] if time is None else read_positive(time, "time", "--time"))


def _gains(text: str) -> list[float]:
    """Three numbers, none below 0. Raises InputError."""
    try:
        numbers = [parse_quantity(part, "number") for part in text.split(",")]
    except ValueError as error:
        raise InputError(str(error), field="--gains") from None
    if len(numbers) != 3 or min(numbers) < 0:
        raise InputError(f'"{text}" is not three numbers of 0 and more, such as 0.0004,0.5,0.0002.', field="--gains")
    return numbers
