"""Controllers of one robot side by side: each tracks the same reference, from the same start, with the same sensor."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from nectosome.core import Status
from nectosome.io import provenance
from nectosome.model.inputs import RobotLike
from nectosome.units import InputError, count, shorten

from . import contract
from .contract import Controller
from .robot_control import (
    ControllerLike,
    ControlResult,
    ControlTask,
    FoundOnce,
    Progress,
    ReferenceLike,
    Shape,
    controller_of,
    given_settings,
)
from .tracking_errors import rms_error

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class ControllerScore:
    """How one controller tracks. Numbers are NaN where it has no run to the end, and in SI units."""

    name: str
    outcome: str  # "tracks", "poor", "failed" (the simulation) or "refused" (before it)
    cause: str  # why it does not track, in a sentence; else ""
    rms_error: float = np.nan  # output less reference, in the last round
    largest_error: float = np.nan
    effort: float = np.nan  # rms of the command less the one that the robot starts with
    change: float = np.nan  # rms of the change of the command from sample to sample
    at_limits: float = np.nan  # share of the samples at which the command is at an end of its range
    result: ControlResult | None = None  # None where it is refused

    @classmethod
    def of(cls, name: str, result: ControlResult) -> "ControllerScore":
        """That of a run which was not cancelled."""
        run, span, cause = result.record, result.task.command, result.missed()
        if run.status != Status.SOLVED:
            cause = f"the simulation ended at {run.time[-1]:.4g} s: {run.status.reason}."
            return cls(name, "failed", cause, result=result)
        return cls(
            name,
            "poor" if cause else "tracks",
            cause,
            rms_error=rms_error(run.output, run.reference),
            largest_error=float(np.abs(run.output - run.reference).max()),
            effort=rms_error(run.command, np.full_like(run.command, span.initial)),
            change=rms_error(run.command[1:], run.command[:-1]),
            at_limits=float(span.at_limits(run.command).mean()),
            result=result,
        )


@dataclass(frozen=True)
class ControllerComparison:
    """Scores of controllers of one task, in the order given; `cancelled` names the one at which it was cancelled."""

    task: ControlTask
    seconds: float  # length of each run [s]
    scores: tuple[ControllerScore, ...]
    settings: dict[str, Any]  # the arguments, for provenance
    cancelled: str = ""

    @property
    def best(self) -> ControllerScore | None:
        """The one that tracks with the least rms error; None where none does."""
        tracks = [score for score in self.scores if score.outcome == "tracks"]
        return min(tracks, key=lambda score: score.rms_error, default=None)

    @property
    def title(self) -> str:
        """Robot, measured quantity, command, and how many controllers."""
        robot = self.task.robot
        each = f"{robot.description.name}: {robot.reading.name} by {robot.command}"
        return f"{each}, {count(len(self.scores), 'controller')}"

    def to_dataset(self) -> "xr.Dataset":
        """`reference` over `sample` [s]; `output`, `measured`, `command` over `controller` too; scores beside it.

        All in SI units. NaN where a controller has no run, or after its end.
        """
        import xarray as xr

        task, samples = self.task, self.task.samples(self.seconds)
        of, by = task.robot.reading.unit or "1", task.robot.quantity.unit or "1"
        shape = len(self.scores), len(samples)
        signals = {name: np.full(shape, np.nan) for name in ("output", "measured", "command")}
        for k, score in enumerate(self.scores):
            if score.result is not None:
                for name, rows in signals.items():
                    run = getattr(score.result.record, name)
                    rows[k, : len(run)] = run
        units = {"output": of, "measured": of, "command": by}
        numbers = {"rms_error": of, "largest_error": of, "effort": by, "change": by, "at_limits": "1"}
        each = {
            name: ("controller", [getattr(score, name) for score in self.scores], {"units": unit})
            for name, unit in numbers.items()
        }
        words = {name: ("controller", [getattr(score, name) for score in self.scores]) for name in ("outcome", "cause")}
        time = task.robot.dt * np.arange(len(samples))
        return xr.Dataset(
            {
                "reference": ("sample", samples, {"units": of}),
                **{name: (("controller", "sample"), rows, {"units": units[name]}) for name, rows in signals.items()},
            },
            coords={
                "sample": ("sample", time, {"units": "s"}),
                "controller": [score.name for score in self.scores],
                **each,
                **words,
            },
            attrs={
                "title": self.title,
                "measured": task.robot.reading.name,
                "commanded": task.robot.command,
                "command_range": [task.command.low, task.command.high],
                "provenance": json.dumps(provenance(self.settings)),
            },
        )


def compare(
    robot: RobotLike,
    *,
    controllers: str | Sequence[str] | Mapping[str, ControllerLike],
    command: str,
    measure: str,
    reference: ReferenceLike,
    time: str | float | None = None,
    settings: Iterable[str] = (),
    rounds: int | None = None,
    gains: str | Sequence[float] | None = None,
    rate: str | float | None = None,
    mean: bool = False,
    noise: str | float | None = None,
    delay: str | float | None = None,
    progress: Progress | None = None,
    **shape: Unpack[Shape],
) -> ControllerComparison:
    """Simulate a robot under several controllers, one after the other, as `control` does under one.

    Gains and the linear model are found once for all that use them. One that is refused has the reason in its score;
    the others go on.

    - controllers: names, as in `pid,mpc`, or controllers of one's own by names of one's own.
    - rounds: of those that learn; gains: of all that have a name, not of `scheduled` beside others.
    - progress(what, share): what begins with the name of the controller; all is cancelled where it returns False.

    The other arguments are those of `control`. Raises InputError, whose field is the argument.
    """
    settings = [settings] if isinstance(settings, str) else list(settings)
    kinds = controllers_of(controllers)
    first, *others = [kind for kind in kinds.values() if not isinstance(kind, Controller)] or [*kinds.values()]
    if gains is not None and any(one.scheduled != first.scheduled for one in others):
        message = "are rows by frequency for scheduled, and one row for the others. Leave them out, or scheduled."
        raise InputError(message, field="gains")
    options = {"command": command, "measure": measure, "reference": reference, "gains": gains, "rate": rate, **shape}
    options |= {"mean": mean, "noise": noise, "delay": delay}
    learning = next((name for name, kind in kinds.items() if kind.learns), None)
    leading = first if rounds is None or learning is None else kinds[learning]
    task = ControlTask.parse(
        robot,
        settings=settings,
        controller=leading.name if isinstance(leading, type) else leading,
        rounds=rounds,
        **options,
    )
    seconds, known = task.seconds(time), FoundOnce()
    task.samples(seconds)
    scores, cancelled = list[ControllerScore](), ""
    for k, (name, kind) in enumerate(kinds.items()):

        def report(what: str, share: float, k: int = k, name: str = name) -> bool | None:
            return True if progress is None else progress(f"{name}, {what}", (k + share) / len(kinds))

        try:
            result = task.under(kind, rounds).run(seconds, report, known)
        except InputError as error:
            scores.append(ControllerScore(name, "refused", error.message))
            continue
        if result.status == Status.CANCELLED:
            cancelled = name
            break
        scores.append(ControllerScore.of(name, result))
    given = options | {"controller": ",".join(kinds), "rounds": rounds}
    return ControllerComparison(
        task, seconds, tuple(scores), given_settings(robot, settings, task, seconds, given), cancelled
    )


def controllers_of(
    given: str | Sequence[str] | Mapping[str, ControllerLike],
) -> dict[str, type[Controller] | Controller]:
    """Controllers by their names, or by names of one's own. Raises InputError for an unknown or repeated name."""
    kinds = dict[str, type[Controller] | Controller]()
    if isinstance(given, Mapping):
        pairs = [*given.items()]
    else:
        pairs = [(name.strip(), name.strip()) for name in (given.split(",") if isinstance(given, str) else given)]
    for name, one in pairs:
        if name in kinds:
            message = f'"{shorten(name)}" stands twice. Each of {", ".join(contract.controllers())} may be there once.'
            raise InputError(message, field="controller")
        kinds[name] = controller_of(one)
    if not kinds:
        raise InputError(f"names none of {', '.join(contract.controllers())}.", field="controller")
    return kinds
