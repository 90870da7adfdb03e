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
    "papers": "nectosome_studies",
    "rigs.dynamixel": "nectosome.rigs.devices.dynamixel",
    "rigs.files": "nectosome.rigs.rig_file",
    "rigs.ni": "nectosome.rigs.devices.ni",
    "rigs.serial_motor": "nectosome.rigs.devices.serial_motor",
    "search.folder": "nectosome.search.search_folder",
    "search.processes": "nectosome.search.executors.processes",
}
MODULES = {f"nectosome.{old}": new for old, new in MODULES.items()}


def _in(room: str) -> Any:
    return import_module(f"nectosome.{room}")


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


def _relay_gains(loop: Any, amplitude: float) -> Any:
    return _in("controllers").relay_gains(loop, -amplitude, amplitude, 0.0)


def _data(room: str, fit: str) -> Callable[..., Any]:
    return lambda *parts, **more: getattr(_in(f"identification.{room}"), fit)(*parts, **more).to_dataset()


NAMES: dict[str, tuple[str, Callable[[], Any] | None]] = {  # what to write instead, and what makes the former object
    "controllers.block_relay_gains": ("relay_gains(loop, -amplitude, amplitude, 0.0)", lambda: _relay_gains),
    "controllers.chirp": ('Reference.parse("chirp", "number", ...).samples(time, dt)', lambda: _chirp),
    "controllers.run_closed_loop": ("RobotLoop(robot, sensor).run(controller, reference)", lambda: _run_closed_loop),
    "controllers.sine": ('wave("sine", time, dt, amplitude=..., frequency=...)', lambda: _sine("sine")),
    "controllers.triangle": ('wave("triangle", time, dt, amplitude=..., frequency=...)', lambda: _sine("triangle")),
    "controllers.varying": ('wave("varying", None, dt, amplitude=[...], frequency=[...])', lambda: _varying),
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
    "rigs.CONTROLLERS": ("controllers()", lambda: tuple(_in("controllers").controllers())),
    "rigs.bench.Bench.of": ("actuator_bench(...)", lambda: _in("rigs").actuator_bench),
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
