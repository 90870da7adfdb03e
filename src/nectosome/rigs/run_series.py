"""A series of runs on a rig by a plan, in a folder that is a campaign; it goes on after an interruption or a kill.

The folder has `run_001.nc` and so on, one for each finished run, `campaign.yaml` that lists them with their conditions,
and `runs.json`, what plan and rig consisted of. Runs that a guard or a person ended, and what was recovered of a run
that was killed, are in `set_aside`: nothing that was measured is lost, and nothing of it is in the campaign.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nectosome.io import load_dataset, save_dataset, write_atomic
from nectosome.io.atomic import lock
from nectosome.io.file_system import entries, exists, make_folder, reason
from nectosome.units import InputError, count, shorten

from .experiment import Experiment, RigRun, Status
from .laws import Played
from .log import recovered
from .run_plan import PlannedRun, RunPlan

CAMPAIGN, CONTENTS, SET_ASIDE = "campaign.yaml", "runs.json", "set_aside"
_NAP = 0.2  # between looks at Ctrl-C while the rig rests [s]
_MOST_DIFFERENCES = 5

Progress = Callable[[str, float], object]
Tell = Callable[[str], object]


@dataclass
class Series:
    """What became of a series: finished runs, those left out with the reason, and how it ended."""

    finished: list[str] = field(default_factory=list)
    repeated: dict[str, int] = field(default_factory=dict)  # attempts that were set aside, by run
    left_out: dict[str, str] = field(default_factory=dict)
    status: Status = "finished"
    reason: str = "all runs are there."


def run_series(plan: RunPlan, folder: Path, progress: Progress, tell: Tell, *, anew: bool = False) -> Series:
    """Take the runs of a plan that are not in the folder yet, in their order.

    A run that a guard ends is repeated, and left out after `attempts`. The series ends where a device fails, and with
    Ctrl-C. `anew` sets aside what another plan has left there.

    Raises InputError, before anything moves, for a folder of another plan or rig, with what differs, for one in which
    another process is at work, and for a rig that cannot be opened.
    """
    make_folder(folder, "--out")
    with _claimed(folder):
        _check_contents(folder, plan.contents, anew)
        series = Series()
        for run in plan.runs:
            if _is_there(folder, run.name, tell):
                series.finished.append(run.name)
        write_campaign(plan, folder, series.finished)
        if series.finished:
            tell(f"{count(len(series.finished), 'run')} of {len(plan.runs)} there already; it goes on.")
        _Taking(plan, folder, progress, tell, series).all()
        return series


@dataclass
class _Taking:
    """Takes runs one after another."""

    plan: RunPlan
    folder: Path
    progress: Progress
    tell: Tell
    series: Series
    done: float = 0.0  # time of runs that are there [s]
    rested: bool = True

    def all(self) -> None:
        """Take all that lack."""
        there, rest = {*self.series.finished}, self.plan.description.rest
        self.done = sum(self.plan.seconds(run) + rest for run in self.plan.runs if run.name in there)
        for run in self.plan.runs:
            if run.name in there:
                continue
            if self.series.status == "finished":
                self._take(run)
            self.done += self.plan.seconds(run) + rest
        if (lacking := len(self.series.left_out)) and self.series.status == "finished":
            self.series.reason = f"{lacking} of {count(len(self.plan.runs), 'run')} left out."

    def _take(self, run: PlannedRun) -> None:
        """Take a run, again where a guard ends it."""
        attempts, path = self.plan.description.attempts, self.folder / f"{run.name}.nc"
        signals, why = self.plan.signals(run), ""
        for attempt in range(1, attempts + 1):
            self._rest()
            result = self._experiment(run, signals).run(path, lambda share: self._report(run, share))
            self.rested = False
            if result.status == "finished":
                self.series.finished.append(run.name)
                write_campaign(self.plan, self.folder, self.series.finished)
                self._tell_of_limits(run, result)
                return
            _set_aside(result.path, run.name)
            if result.status != "aborted":
                self.series.status, self.series.reason = result.status, f"{run.name}: {result.reason}"
                return
            self.series.repeated[run.name], why = attempt, result.reason
            self.tell(f"{run.name} ({run.words}), attempt {attempt} of {attempts}: {result.reason}")
        self.series.left_out[run.name] = why

    def _experiment(self, run: PlannedRun, signals: Mapping[str, Any]) -> Experiment:
        plan = self.plan
        begin, end = plan.window(run)
        attributes = {
            "run": run.name,
            "conditions": json.dumps({**plan.constants, **run.conditions}),
            "window": json.dumps([begin, end]),
            "clock": _clock(plan.rig.rig.devices.values()),
            "devices": json.dumps(plan.contents["rig"]["devices"]),
            "plan": json.dumps(plan.contents["plan"]),
        }
        law = Played(plan.rig.rig, signals)
        return Experiment(plan.rig.rig, law, plan.rig.limits, plan.rig.dt, run.name, attributes)

    def _tell_of_limits(self, run: PlannedRun, result: RigRun) -> None:
        """Signals keep within the limits, but samples that come early leave less time for a change."""
        for what in ("clamped", "slowed"):
            if number := int(result.data.attrs[what]):
                self.tell(f"{run.name} ({run.words}): {count(number, 'sample')} {what} by the limits of commands.")
        if remarks := result.data.attrs.get("remarks"):
            self.tell(f"{run.name} ({run.words}): {remarks}")

    def _report(self, run: PlannedRun, share: float) -> None:
        self._show(f"{run.name}, {run.words}", self.done + share * self.plan.seconds(run))

    def _rest(self) -> None:
        """Wait before the next run, unless none was before."""
        rig, rest = self.plan.rig.rig, 0.0 if self.rested else self.plan.description.rest
        begin = rig.now()
        while (gone := rig.now() - begin) < rest - 1e-9:
            self._show("at rest", self.done)
            rig.wait(begin + min(gone + _NAP, rest))

    def _show(self, what: str, seconds: float) -> None:
        self.progress(what, min(seconds / self.plan.total, 1.0))


def _clock(devices: Any) -> str:
    """Where the time of a run comes from, for its attributes."""
    virtual = all(getattr(device, "pace", "real") == "virtual" for device in devices)
    what = "of the simulation" if virtual else "of this machine, monotonic"
    return f"{what}; 0 s is the first sample"


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """The folder for this process alone. Raises InputError."""
    try:
        file = (folder / "lock").open("ab")
    except OSError as error:
        raise InputError(f"cannot be written: {reason(error)}.", file=str(folder)) from None
    with file:
        if not lock(file, wait=2.0):
            raise InputError("another process is at work in this folder.", file=str(folder))
        yield


def _check_contents(folder: Path, contents: Mapping[str, Any], anew: bool) -> None:
    """Raise InputError where the folder is of another plan or rig, with what differs, or holds other files."""
    path = folder / CONTENTS
    if exists(path) and not anew:
        try:
            before = json.loads(path.read_bytes())
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be read: {shorten(error)}.", file=str(path)) from None
        differing = list(_differences(before, json.loads(json.dumps(contents)), ""))
        if differing:
            more = f"; and {len(differing) - _MOST_DIFFERENCES} more" * (len(differing) > _MOST_DIFFERENCES)
            raise InputError(
                f"was begun with another plan or rig: {'; '.join(differing[:_MOST_DIFFERENCES])}{more}. Take another "
                "folder, or write them as they were; --force starts anew and sets aside the runs that are there.",
                file=str(folder),
            )
        return
    runs = [one for one in entries(folder, "run_*") if one.suffix in (".nc", ".csv")]
    if runs and not anew:
        raise InputError(
            f"has {runs[0].name}, and no {CONTENTS}: it is of something else. Take another.", file=str(folder)
        )
    for one in runs:
        _set_aside(one, one.stem)
    write_atomic(path, json.dumps(contents, indent=1).encode())


def _differences(before: Any, now: Any, at: str) -> Iterator[str]:
    """What differs in two sets of data, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        for name in {**before, **now}:
            yield from _differences(before.get(name), now.get(name), f"{at}.{name}" if at else name)
    elif before != now:
        yield f"{at} is {shorten(json.dumps(now))} and was {shorten(json.dumps(before))}"


def _is_there(folder: Path, name: str, tell: Tell) -> bool:
    """Whether a finished run is there; anything else of it, such as the journal of a kill, is set aside."""
    path, journal = folder / f"{name}.nc", folder / f"{name}.csv"
    if exists(journal) and not exists(path):
        tell(f"{name} was broken off. {_recover(journal, path)}")
    journal.unlink(missing_ok=True)
    if not exists(path):
        return False
    try:
        finished = load_dataset(path).attrs.get("status") == "finished"
    except InputError:
        finished = False
    if not finished:
        _set_aside(path, name)
    return finished


def _recover(journal: Path, path: Path) -> str:
    """Save what a journal holds; what was done, in a sentence."""
    try:
        data = recovered(journal)
    except InputError:  # killed within its head: before the first sample
        return f"Its journal, which holds nothing, is {_set_aside(journal, path.stem)}."
    if data.attrs["status"] == "finished":
        save_dataset(data, path)
        return "All its samples are in its journal, of which it was recovered."
    save_dataset(data, path)
    return f"What it had measured is in {_set_aside(path, path.stem)}; it is taken again."


def _set_aside(path: Path, name: str) -> Path:
    """Move a file to where it is out of the way; where to."""
    folder = path.parent / SET_ASIDE
    make_folder(folder, "--out")
    number = 1
    while exists(target := folder / f"{name}_{number}{path.suffix}"):
        number += 1
    return path.rename(target)


def write_campaign(plan: RunPlan, folder: Path, finished: list[str]) -> None:
    """Write the campaign of finished runs; none where there are none.

    A command is held from its sample to the next one: straight lines between its samples lie half a sample too early,
    so that its columns have a clock of their own.
    """
    runs = {run.name: run for run in plan.runs}
    if not finished:
        return
    head: dict[str, Any] = {"about": plan.description.about} if plan.description.about else {}
    if plan.constants:
        head["conditions"] = dict(plan.constants)
    held = {f"{name}.command" for name in plan.rig.rig.commands}
    if held.intersection(plan.columns.values()):
        head["clocks"] = {"held": {"column": "time", "offset": f"{0.5 * plan.rig.dt:.9g} s"}}
    head["columns"] = {
        name: {"column": column} | ({"clock": "held"} if column in held else {})
        for name, column in plan.columns.items()
    }
    lines = [f"{name}: {json.dumps(value, ensure_ascii=False)}" for name, value in head.items()]
    lines.append("recordings:")
    for name in sorted(finished):
        begin, end = plan.window(runs[name])
        window = f"{begin:.9g}..{end:.9g} s"
        entry = {"file": f"{name}.nc", "conditions": dict(runs[name].conditions), "window": window}
        lines.append(f"  - {json.dumps(entry, ensure_ascii=False)}")
    write_atomic(folder / CAMPAIGN, ("\n".join(lines) + "\n").encode())
