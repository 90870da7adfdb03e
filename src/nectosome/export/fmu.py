"""A robot as an FMU for co-simulation (FMI 2): commands in, held over a step, and readings out.

The FMU holds the robot file and a script; it runs where Python has nectosome and pythonfmu.
"""

import json
import keyword
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import jax.numpy as jnp

from nectosome.core import Status
from nectosome.description import RobotDescription, dump_robot, get_value, parse_robot
from nectosome.io.atomic import write_atomic
from nectosome.io.extras import package
from nectosome.io.file_system import reason
from nectosome.solve import SampledPlant
from nectosome.units import InputError, check_share

_ROBOT, _SIGNALS = "robot.yaml", "signals.json"  # files beside the script
_EVEN = 1e-6  # of a step: how far a communication step may be off from whole steps


class HeldRobot:
    """A robot in samples of dt seconds, its commands held in each one; tolerances of time steps as in `simulate`."""

    def __init__(
        self,
        description: RobotDescription,
        commands: Sequence[str],
        readings: Sequence[str],
        dt: float,
        rtol: float = 1e-4,
        atol: float = 1e-6,
    ):
        self._plant = SampledPlant(description, tuple(commands), tuple(readings), dt)
        self.dt, self.tolerances = dt, {"solver.rtol": rtol, "solver.atol": atol}
        self.commands = {name: float(get_value(description, name)) for name in commands}
        self._state, _ = self._plant.start()
        self.readings = self._named()
        self.units = {
            **{name: one.unit for name, one in zip(commands, self._plant.quantities, strict=True)},
            **{one.name: one.unit for one in self._plant.readings},
        }

    @classmethod
    def of_folder(cls, folder: Path) -> "HeldRobot":
        """The one that an FMU carries."""
        signals = json.loads((folder / _SIGNALS).read_text(encoding="utf-8"))
        return cls(parse_robot((folder / _ROBOT).read_text(encoding="utf-8"), _ROBOT), **signals)

    def advance(self, time: float, step: float) -> str:
        """Go on from `time` by `step` [s], and return why it cannot, or nothing.

        Both are whole numbers of dt, and `time` is where the robot is.
        """
        samples = round(step / self.dt)
        if samples < 1 or abs(step / self.dt - samples) > _EVEN:
            return f"a step of {step:g} s is no whole number of {self.dt:g} s, the step of this FMU"
        if abs(time / self.dt - self._state.sample) > _EVEN * max(1, self._state.sample):
            return (
                f"it is at {self._state.sample * self.dt:g} s, not at {time:g} s: it begins at 0 s and does not go back"
            )
        for name, value in self.tolerances.items():
            if not 0 < value < 1:
                return f"{name} is {value:g}: it must be more than 0 and less than 1"
        rtol, atol = map(jnp.asarray, self.tolerances.values())
        self._plant.settings = replace(self._plant.settings, rtol=rtol, atol=atol)
        for _ in range(samples):
            self._state, interval, status = self._plant.hold(self._state, *self.commands.values())
            if interval is None:
                return Status(status).reason
        self.readings = self._named()
        return ""

    def _named(self) -> dict[str, float]:
        each = zip(self._plant.readings, self._state.readings, strict=True)
        return {one.name: float(value) for one, value in each}


def write_fmu(
    description: RobotDescription,
    commands: Sequence[str],
    readings: Sequence[str],
    dt: float,
    target: Path,
    rtol: float = 1e-4,
    atol: float = 1e-6,
) -> None:
    """Write the FMU of a robot, whole or not at all.

    - commands: paths or aliases, the inputs; readings: names of outputs (see `nectosome.solve.reading_of`).
    - dt: the step for which inputs are held [s]; communication steps are whole numbers of it.
    - rtol, atol: tolerances of time steps, as in `simulate`; parameters `solver.rtol` and `solver.atol` of the FMU.

    Raises InputError for what is no command or reading, without the extra `fmu`, and where a file cannot be written.
    """
    builder = package("pythonfmu", "fmu").FmuBuilder
    check_share(rtol, "rtol")
    check_share(atol, "atol")
    HeldRobot(description, commands, readings, dt)  # says what is wrong with the names
    signals = {"commands": [*commands], "readings": [*readings], "dt": dt, "rtol": rtol, "atol": atol}
    try:
        with TemporaryDirectory() as folder:
            content = _built(builder, description, signals, Path(folder))
    except OSError as error:
        raise InputError(
            f"cannot make the FMU in the folder for temporary files: {reason(error)}. "
            "Free space there, or set TMPDIR to another folder."
        ) from None
    write_atomic(target, content)


def _built(builder: Any, description: RobotDescription, signals: dict[str, Any], here: Path) -> bytes:
    """The FMU, made in the folder `here`."""
    name = _identifier(description.name)
    module = f"{name}_slave"
    script, built = here / f"{module}.py", here / f"{name}.fmu"
    about = json.dumps(description.name)
    script.write_text(_SCRIPT.format(name=name, about=about, dt=signals["dt"]), encoding="utf-8")
    (here / _ROBOT).write_text(dump_robot(description), encoding="utf-8")
    (here / _SIGNALS).write_text(json.dumps(signals), encoding="utf-8")
    before = [*sys.path]
    try:
        sys.path.insert(0, str(here))
        builder.build_FMU(script, dest=built, project_files=[here / _ROBOT, here / _SIGNALS], **_OPTIONS)
        return built.read_bytes()
    finally:
        sys.path[:] = before
        sys.modules.pop(module, None)


_OPTIONS = {
    "needsExecutionTool": True,
    "canHandleVariableCommunicationStepSize": False,  # only whole numbers of dt
    "canGetAndSetFMUstate": False,
}
_SCRIPT = '''"""{name} as a slave of FMI 2."""

import sys
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.default_experiment import DefaultExperiment
from pythonfmu.enums import Fmi2Status

from nectosome.export.fmu import HeldRobot


class {name}(Fmi2Slave):
    description = {about}

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.default_experiment = DefaultExperiment(start_time=0.0, step_size={dt!r})
        self.robot = HeldRobot.of_folder(Path(self.resources))
        for name in self.robot.commands:
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.input,
                    variability=Fmi2Variability.discrete,
                    start=self.robot.commands[name],
                    description=self.robot.units[name],
                    getter=lambda name=name: self.robot.commands[name],
                    setter=lambda value, name=name: self.robot.commands.update({{name: value}}),
                )
            )
        for name, start in self.robot.tolerances.items():
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.parameter,
                    variability=Fmi2Variability.tunable,
                    start=start,
                    getter=lambda name=name: self.robot.tolerances[name],
                    setter=lambda value, name=name: self.robot.tolerances.update({{name: value}}),
                )
            )
        for name in self.robot.readings:
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.output,
                    initial=Fmi2Initial.exact,
                    start=self.robot.readings[name],
                    description=self.robot.units[name],
                    getter=lambda name=name: self.robot.readings[name],
                )
            )

    def do_step(self, current_time, step_size):
        why = self.robot.advance(current_time, step_size)
        if why:
            self.log(why, Fmi2Status.error)
            print("{name}:", why, file=sys.stderr)  # importers show a log only when asked to
            raise RuntimeError(why)  # False would be a step that is discarded: importers may go on after it
        return True
'''


def _identifier(name: str) -> str:
    """A name of a class like that of the robot."""
    identifier = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_") or "robot"
    return f"robot_{identifier}" if not identifier[0].isalpha() or keyword.iskeyword(identifier) else identifier
