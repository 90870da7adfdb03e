"""Names and modules that moved in 0.3: for one minor version they work as before, with a warning, or say what to use.

A room with such names has `__getattr__ = former(__name__)`. Remove a row with the version after the next.
"""

import sys
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

MODULES = {
    "description.files": "nectosome.description.robot_file",
    "export.folder": "nectosome.export.robot_folder",
    "measure.parts": "nectosome.measure.recordings",
    "mechanism.plates": "nectosome.mechanism.shapes.plates",
    "papers": "nectosome_studies",
    "rigs.files": "nectosome.rigs.rig_file",
    "search.folder": "nectosome.search.search_folder",
}
MODULES |= {
    f"rigs.{name}": f"nectosome.rigs.devices.{name}"
    for name in ("dynamixel", "dynamixel_models", "imu", "ni", "serial_line", "serial_motor", "simulated_robot")
}
MODULES |= {
    f"search.{name}": f"nectosome.search.executors.{name}" for name in ("afar", "processes", "shares", "spread")
}
MODULES = {f"nectosome.{old}": new for old, new in MODULES.items()}


def _in(room: str) -> Any:
    return import_module(f"nectosome.{room}")


def _names(needs_model: bool) -> tuple[str, ...]:
    known = _in("controllers").controllers()
    return tuple(name for name, kind in known.items() if kind.needs_model or not needs_model)


def _signal(kind: str, length: float | None, dt: float, **fields: Any) -> Any:
    reference = _in("controllers").Reference.parse(kind, "number", **fields)
    return reference.samples(reference.duration(dt) if length is None else length, dt)


def _sine(kind: str) -> Callable[..., Any]:
    return lambda amplitude, frequency, time, dt: _signal(kind, time, dt, amplitude=amplitude, frequency=frequency)


def _chirp(amplitude: float, first: float, last: float, time: float, dt: float) -> Any:
    return _signal("chirp", time, dt, amplitude=amplitude, frequency=first, to=last, time=time)


def _varying(amplitudes: Sequence[float], frequencies: Sequence[float], dt: float) -> Any:
    return _signal("varying", None, dt, amplitude=[*amplitudes], frequency=[*frequencies])


def _run_closed_loop(robot: Any, controller: Any, reference: Any, sensor: Any = None, **options: Any) -> Any:
    loop = _in("controllers").RobotLoop(robot, *(() if sensor is None else (sensor,)))
    return loop.run(controller, reference, **options)


def _controller_of(name: str, *data: Any, **more: Any) -> Any:
    return _in("controllers").controller_named(name).from_loop(_in("controllers").LoopData(*data, **more))


def _relay_gains(loop: Any, amplitude: float) -> Any:
    return _in("controllers").relay_gains(loop, -amplitude, amplitude, 0.0)


class _RobotBench:
    """A bench of one loop of a robot."""

    @staticmethod
    def of(task: Any, law: Any, time: float, rig: Any, limits: Any, pair: Any) -> Any:
        """Return `robot_bench` of one task."""
        return _in("rigs").robot_bench([task], [law], time, rig, limits, [pair])


def _data(room: str, fit: str) -> Callable[..., Any]:
    return lambda *parts, **more: getattr(_in(f"identification.{room}"), fit)(*parts, **more).to_dataset()


NAMES: dict[str, tuple[str, Callable[[], Any] | None]] = {  # what to write instead, and what makes the former object
    "controllers.CONTROLLERS": ("controllers()", lambda: _names(False)),
    "controllers.WITH_MODEL": ("needs_model of a controller's class", lambda: _names(True)),
    "controllers.block_relay_gains": ("relay_gains(loop, -amplitude, amplitude, 0.0)", lambda: _relay_gains),
    "controllers.chirp": ('Reference.parse("chirp", "number", ...).samples(time, dt)', lambda: _chirp),
    "controllers.controller_of": ("controller_named(name).from_loop(LoopData(...))", lambda: _controller_of),
    "controllers.run_closed_loop": ("RobotLoop(robot, sensor).run(controller, reference)", lambda: _run_closed_loop),
    "controllers.schedule_of": ("that of controllers.autotune", lambda: _in("controllers.autotune").schedule_of),
    "controllers.sine": ('wave("sine", time, dt, amplitude=..., frequency=...)', lambda: _sine("sine")),
    "controllers.triangle": ('wave("triangle", time, dt, amplitude=..., frequency=...)', lambda: _sine("triangle")),
    "controllers.varying": ('wave("varying", None, dt, amplitude=[...], frequency=[...])', lambda: _varying),
    "gym.Reward": (
        "nectosome.units.expression.Expression",
        lambda: lambda text: _in("units.expression").Expression(text, "reward"),
    ),
    "identification.gait.fit.gait_data": ("GaitResult(...).to_dataset()", lambda: _data("gait.fit", "GaitResult")),
    "identification.hysteresis.files.hysteresis_data": (
        "HysteresisFit(found, train, test).to_dataset()",
        lambda: _data("hysteresis.files", "HysteresisFit"),
    ),
    "identification.surge.files.surge_data": (
        "SurgeFit(found, train, test).to_dataset()",
        lambda: _data("surge.files", "SurgeFit"),
    ),
    "rigs.BenchRun": ("Bench.runs gives the runs, Bench.errors their errors", None),
    "rigs.bench.Bench.of": ("actuator_bench(...)", lambda: _in("rigs").actuator_bench),
    "rigs.robot_bench.RobotBench": ("robot_bench([task], [law], time, rig, limits, [pair])", lambda: _RobotBench),
}


def former(room: str) -> Callable[[str], Any]:
    """`__getattr__` of a room that knows its former names. Raises InputError for one that nothing stands for."""

    def look_up(name: str) -> Any:
        instead, make = NAMES.get(f"{room}.{name}".removeprefix("nectosome."), ("", None))
        if not instead:
            raise AttributeError(f"module {room} has no attribute {name}")
        if make is None:
            raise import_module("nectosome.units").InputError(f"{room}.{name} is gone: {instead}.")
        _warn(f"{room}.{name}", instead, 3)
        return make()

    return look_up


def former_method(old: str) -> Callable[..., Any]:
    """What stands for a class's former method, with a warning when it is called."""

    def call(*args: Any, **options: Any) -> Any:
        instead, make = NAMES[old]
        _warn(f"nectosome.{old}", instead, 3)
        assert make is not None
        return make()(*args, **options)

    return call


class _Moved:
    """Finds and loads modules by their former names."""

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None) -> Any:
        """Spec of a module that is the one that it became; None for others."""
        if not fullname.startswith("nectosome."):
            return None
        old = next((old for old in MODULES if f"{fullname}.".startswith(f"{old}.")), None)
        if old is None:
            return None
        loader: Any = self
        return ModuleSpec(fullname, loader, loader_state=MODULES[old] + fullname.removeprefix(old))

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Import the module, and warn."""
        _warn(spec.name, spec.loader_state, 3)
        module = import_module(spec.loader_state)
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give it back its own spec."""
        assert module.__spec__ is not None
        module.__spec__ = module.__spec__.loader_state


def _warn(old: str, instead: str, level: int) -> None:
    words = f"{old} goes with the next minor version: take {instead}."
    warnings.warn(words, DeprecationWarning, stacklevel=level)


if not any(isinstance(one, _Moved) for one in sys.meta_path):
    sys.meta_path.insert(0, _Moved())  # before modules of a package that moved are found in its new place
