"""One idea, one spelling: every option of every command is in the table below, and means there what it says."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import pytest
from cyclopts import App

from nectosome.cli.app import app

SPELLINGS = {
    # what all commands share
    "--set": "set a quantity of the robot: PATH=VALUE",
    "--vary": "a quantity between two values: PATH=LOW..HIGH, in a design or unknown",
    "--over": "an axis of a sweep: PATH=LOW..HIGH:STEP or a list",
    "--save": "write the data, or the video, to a file",
    "--plot": "write a page with figures to a file",
    "--out": "write results to a folder, where an interrupted run continues",
    "--force": "overwrite files",
    "--json": "print one JSON object",
    "--campaign": "recordings and their conditions",
    "--test": "recordings that are predicted, not fitted",
    "--config": "settings of a device or a tracker",
    "--seed": "random numbers",
    "--starts": "number of starting points of a search",
    "--own-first": "the first start is the file as it is",
    "--unit": "unit of a mesh",
    "--cluster": "scheduler whose workers compute",
    "--part": "the share of a study that is computed",
    # of motions
    "--time": "length of a motion",
    "--samples": "number of times that are kept",
    "--mission": "modes that a robot goes through",
    "--period": "period of the drives",
    "--method": "the method of a computation",
    "--rtol": "relative tolerance of a time step",
    "--atol": "absolute tolerance of a time step",
    "--step": "length of a time step",
    "--loads": "print each load on each part",
    "--whole": "solve every limb",
    "--branch": "one of several shapes at rest",
    "--multipliers": "which multipliers of a cycle are computed and printed",
    "--order-error": "how far the orders of strains put tips of rods off",
    "--spread": "print the interval of every number",
    "--draws": "how many values of what is not known exactly",
    # of designs
    "--quantile": "the quantile over draws that a design makes as good as possible",
    "--optimiser": "the optimiser",
    "--maximise": "the quantity that a design makes as large as possible",
    "--minimise": "the quantity that a design makes as small as possible",
    "--keep": "a limit that a design keeps",
    "--forward": "direction in which speed counts",
    "--problem": "file of a design problem",
    "--core": "Young's modulus of a composite's core",
    "--shell": "Young's modulus of a composite's shell",
    "--young": "Young's modulus of a composite",
    "--ratio": "size of a composite's core, of the whole",
    # of recordings and fits
    "--compare": "a column and the reading that it measures",
    "--drive": "a column and the signal that it drives, or the number that it sets at rest",
    "--error": "standard error of a column",
    "--skip": "time at the beginning that is not compared",
    "--memory": "memory that the contents of one file may take",
    "--write": "write the robot with what was found to a file",
    "--mass": "mass of a swimmer",
    "--diameter": "diameter of a propeller",
    "--smooth": "window of a filter",
    "--order": "order of a transfer function",
    "--start": "start of a joint in all recordings",
    "--shift": "by how much the clock of all recordings is late",
    "--loss": "what a fit makes small of its residuals: squares, or less for outliers",
    "--slew": "fit the slew rate of a valve",
    "--zeros": "number of zeros of a transfer function",
    "--dead-band": "fit the dead band of a valve",
    "--resolution": "fit the resolution of a valve",
    "--dead-time": "fit the dead time of an actuator",
    "--target": "file of gaits that a robot should have",
    "--evaluations": "at most so many evaluations of each trial",
    "--goal": "discrepancy at which a search ends",
    # of corrections
    "--sim": "a grid that was simulated before",
    "--next": "number of experiments to propose",
    "--aim": "purpose of the proposed experiments",
    "--quantity": "the quantity that is corrected, or stands beside means",
    "--means": "column whose means by conditions are printed",
    "--against": "column beside another one, over which it makes a loop",
    "--parameter": "the parameter that the simulator takes",
    "--lowpass": "cutoff frequency for the peaks of recordings",
    # of control
    "--command": "the quantity that a controller sets, and its range",
    "--measure": "the reading that is measured",
    "--reference": "the reference of the reading",
    "--amplitude": "amplitude of a reference",
    "--frequency": "frequency of a reference",
    "--to": "what something goes to: the last frequency of a chirp, the format of an export",
    "--column": "quantity of a recording that is the reference",
    "--gains": "gains of a PID",
    "--rate": "sampling rate",
    "--mean": "average a measurement over a beat",
    "--noise": "standard deviation of a measurement",
    "--delay": "delay of a measurement",
    "--controller": "the kind of controller",
    "--rig": "the rig on which a robot is controlled",
    "--rig-command": "the command of a rig",
    "--rig-measure": "the measurement of a rig",
    "--model": "an identified model",
    "--rounds": "runs of a learning controller",
    # of rigs
    "--dry-run": "check all signals of a plan, and move nothing",
    "--channel": "a measurement of a rig",
    "--known": "known loads of a sensor",
    "--readings": "file with readings of known loads",
    "--apply": "write a zero, or a slope, into the rig file",
    # of videos and pictures
    "--overlay": "write the video with what was tracked drawn over it",
    "--propose": "print colours that stand out",
    "--at": "time of a frame or a picture",
    "--size": "width and height in pixels",
    "--fps": "frames per second",
    "--speed": "speed of a video over real time",
    "--camera": "position of the camera",
    # of the studio and of studies
    "--folder": "folder in which the studio opens and saves files",
    "--host": "address of the studio",
    "--port": "port of the studio",
    "--browser": "open the browser",
    "--quick": "shorter computations",
}
SAME_HELP = (
    "--set",
    "--vary",
    "--over",
    "--plot",
    "--force",
    "--json",
    "--campaign",
    "--test",
    "--write",
    "--loads",
    "--whole",
    "--seed",
    "--starts",
    "--cluster",
    "--part",
)
WRITING = ("--save", "--plot", "--out", "--overlay", "--write")  # each with --force


def commands(within: App, path: tuple[str, ...] = ()) -> Iterator[tuple[str, App]]:
    for name in within:
        if name not in (*within.help_flags, *within.version_flags):
            here = within[name]
            if here.default_command is not None:
                yield " ".join((*path, name)), here
            yield from commands(here, (*path, name))


COMMANDS = {name: command for name, command in commands(app) if not name.startswith("--")}


def arguments(command: App) -> list[Any]:
    every = command.assemble_argument_collection(default_parameter=app.default_parameter)
    return [argument for argument in every if argument.show]


def options() -> Iterator[tuple[str, str, Any]]:
    """Command, option and what is known of it."""
    for name, command in COMMANDS.items():
        for argument in arguments(command):
            long = next((spelling for spelling in argument.names if spelling.startswith("--")), None)
            if long is not None:
                yield name, long, argument


def test_the_commands_are_found():
    assert {"simulate", "identify", "identify gait", "control", "control rig", "rig run"} <= {*COMMANDS}


def test_every_option_is_in_the_table():
    unknown = [f"{command} {option}" for command, option, _ in options() if option not in SPELLINGS]
    assert unknown == [], "add it to the table, or spell it as another command does"


def test_every_idea_has_one_spelling():
    assert len({*SPELLINGS.values()}) == len(SPELLINGS)
    assert {*SPELLINGS} - {option for _, option, _ in options()} == set()


def test_every_command_argument_and_option_has_help():
    assert [name for name, command in COMMANDS.items() if not command.help] == []
    bare = [
        f"{name} {argument.names[0]}"
        for name, command in COMMANDS.items()
        for argument in arguments(command)
        if not (argument.parameter.help or "").endswith(".")
    ]
    assert bare == []


IN_PLACE = {("check", "--write")}  # it writes into the file that it reads, which is what is asked for


@pytest.mark.parametrize("option", SAME_HELP)
def test_an_option_has_the_same_help_in_all_commands(option):
    found = defaultdict(list)
    for command, name, argument in options():
        if name == option and (command, name) not in IN_PLACE:
            found[argument.parameter.help].append(command)
    assert len(found) == 1, dict(found)


def test_what_writes_files_can_be_forced():
    given = defaultdict(set)
    for command, option, _ in options():
        given[command] |= set() if (command, option) in IN_PLACE else {option}
    assert [name for name, all_ in given.items() if all_ & {*WRITING} and "--force" not in all_] == []


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_help_fits_into_80_columns(command, nectosome, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    answer = nectosome(*command.split(), "--help")
    assert answer.code == 0
    assert [line for line in answer.out.splitlines() if len(line) > 80] == []
