"""Studies by data alone: a `replay.toml` says what is recorded of a robot, or set, and what is read of it.

    robot = "tail.yaml"                         # a file beside it, or the name of a robot that ships
    settings = ["E = 300 kPa"]                  # of all runs
    campaign = "campaign.yaml"                  # recordings, as for `nectosome identify`
    drive = {angle = "limbs.tail.joint.motion"} # columns that drove the robot, and the signals that they stand for
    compare = {force = "body.force.x"}          # columns, and the readings that they are held against

    [runs.slow]                                 # of the robot with settings of its own
    verb = "simulate"                           # or static, steady, periodic
    time = "5 s"                                # of a simulation
    settings = ["f = 1 Hz"]
    read = {speed = "velocity.x"}               # readings by the names that rows and figures give them

Each recording and run is a dataset: readings in SI units over `time`, and `measured_NAME` of a recording; the summary
of a run is in its attributes. Rows of `printed.toml` have `ours`, an expression of these, as in
`slow.speed.mean()` or `100 * rms(first.force - first.measured_force) / ptp(first.measured_force)`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from pydantic import BaseModel, ConfigDict

import nectosome as ns
from nectosome.description import RobotDescription, apply_settings
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.solve.readings import reading_of
from nectosome.units import InputError, read_quantity
from nectosome.view.style import Panel, titled

from . import charts
from .evaluate import Names, value_of
from .study import FOLDER, Progress, StudyPart, printed, read_book, read_table

_SAMPLES = 401


class ReplayRun(BaseModel):
    """A run of the robot."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    verb: Literal["simulate", "static", "steady", "periodic"] = "simulate"
    time: str = ""
    settings: list[str] = []
    read: dict[str, str]


class Replay(BaseModel):
    """A `replay.toml`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    robot: str
    settings: list[str] = []
    campaign: str = ""
    drive: dict[str, str] = {}
    compare: dict[str, str] = {}
    runs: dict[str, ReplayRun] = {}


def part(study: str, progress: Progress) -> StudyPart:
    """Numbers of all rows that say how they are computed. Raises InputError, as what it calls does."""
    replay = read_table(Replay, read_book(study, "replay.toml"), study, "replay.toml")
    folder = FOLDER / study
    file = folder / replay.robot
    robot = apply_settings(ns.describe(str(file) if file.is_file() else replay.robot), replay.settings)
    data = dict[str, xr.Dataset]()
    if replay.campaign:
        progress("recordings", 0.0)
        data |= _recorded(robot, replay, folder)
    for k, (name, run) in enumerate(replay.runs.items()):
        progress(name, k / len(replay.runs))
        data[name] = _computed(robot, run)
    names = Names(data)
    numbers = dict[str, float | None]()
    for row, entry in printed(study).items():
        if "ours" not in entry and entry["kind"] != "missing":
            why = 'does not say how it is computed. Give it `ours`, as in ours = "mean(slow.speed)".'
            raise InputError(why, file=f"{study}/printed.toml", field=row)
        numbers[row] = float(value_of(entry["ours"], names)) if "ours" in entry else None
    return StudyPart(numbers, data)


def panels(data: Mapping[str, xr.Dataset]) -> list[Panel]:
    """Every reading over time, beside what was measured."""
    return [charts.panel(_chart(name, one), data) for name, one in data.items() if one.sizes["time"] > 1]


def _chart(name: str, one: xr.Dataset) -> charts.Chart:
    plots = [
        charts.Subplot(
            x="time (s)",
            y=titled(read, one[read].attrs.get("units", "")),
            over="time",
            lines=[
                charts.Trace(y=f"measured_{read}", name="measured", color="black", if_there=f"measured_{read}"),
                charts.Trace(y=str(read), name="computed"),
            ],
        )
        for read in one.data_vars
        if not str(read).startswith("measured_")
    ]
    caption = "Of the recording, and as computed." if "file" in one.attrs else "Computed."
    return charts.Chart(title=name, caption=caption, data=name, plots=plots, height=120 + 260 * len(plots))


def _recorded(robot: RobotDescription, replay: Replay, folder: Path) -> dict[str, xr.Dataset]:
    """The robot as it was driven in each recording, beside what was measured."""
    built = ns.build(robot)
    compared = [read_compared(column, name, built) for column, name in replay.compare.items()]
    datasets = dict[str, xr.Dataset]()
    for trial in robot_trials(recordings_of(folder / replay.campaign), robot, compared, replay.drive):
        run = ns.simulate(trial.description, float(trial.time[-1]), samples=trial.time.tolist())
        table: dict[str, Any] = {}
        for one, measured in zip(compared, trial.measured, strict=True):
            units = {"units": one.reading.unit}
            table[one.column] = ("time", one.sign * ns.reading(run, one.reading.name), units)
            table[f"measured_{one.column}"] = ("time", one.sign * measured, units)
        time = {"time": ("time", trial.time, {"units": "s"})}
        datasets[trial.name] = xr.Dataset(table, time, {"file": trial.file})
    return datasets


def _computed(robot: RobotDescription, run: ReplayRun) -> xr.Dataset:
    """Readings of a run of its own."""
    described = apply_settings(robot, run.settings)
    built = ns.build(described)
    if run.verb == "simulate":
        done = ns.simulate(described, read_quantity(run.time, "time", "time"), samples=_SAMPLES)
    else:
        done = getattr(ns, run.verb)(described)
    whole = done.to_dataset()
    table = {
        name: ("time", np.atleast_1d(ns.reading(done, text)), {"units": reading_of(built, text).unit})
        for name, text in run.read.items()
    }
    return xr.Dataset(table, {"time": np.atleast_1d(whole["time"].values)}, whole.attrs)
