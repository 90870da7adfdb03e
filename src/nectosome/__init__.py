"""nectosome: from a drawing to a tuned underwater soft robot.

    import nectosome as ns

    robot = ns.describe("flagellum")                        # or the path of a robot file
    robot = ns.apply_settings(robot, ["omega=14.4rad/s"])   # any quantity, by its path or alias, with its unit
    run = ns.simulate(ns.build(robot), 2.5)                 # 2.5 s from rest
    data = run.to_dataset(robot)                            # an xarray.Dataset in SI units

Names are loaded when they are first used, so that importing the package is quick; the rooms are too, as in
`ns.measure.read("run.csv")`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .description import apply_settings, drive_period, load_robot, save_robot
    from .designs import sweep
    from .io import load_dataset, save_dataset
    from .model import bind, build, read
    from .robots import beetle, beetle_free, describe, flagella, names
    from .solve import periodic, simulate, static, steady
    from .units import InputError
    from .view import show_run, show_sweep

_ROOMS = {
    "description": ("apply_settings", "drive_period", "load_robot", "save_robot"),
    "designs": ("sweep",),
    "io": ("load_dataset", "save_dataset"),
    "model": ("bind", "build", "read"),
    "robots": ("beetle", "beetle_free", "describe", "flagella", "names"),
    "solve": ("periodic", "simulate", "static", "steady"),
    "units": ("InputError",),
    "view": ("show_run", "show_sweep"),
}
_OTHERS = (
    "controllers",
    "core",
    "drives",
    "identification",
    "loads",
    "measure",
    "mechanism",
    "papers",
    "rigs",
    "search",
    "vision",
)
_HOME = {name: room for room, inside in _ROOMS.items() for name in inside}

__all__ = [
    "InputError",
    "apply_settings",
    "beetle",
    "beetle_free",
    "bind",
    "build",
    "describe",
    "drive_period",
    "flagella",
    "load_dataset",
    "load_robot",
    "names",
    "periodic",
    "read",
    "save_dataset",
    "save_robot",
    "show_run",
    "show_sweep",
    "simulate",
    "static",
    "steady",
    "sweep",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    if name in _ROOMS or name in _OTHERS:
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"nectosome has no {name}")


def __dir__() -> list[str]:
    return sorted({*__all__, *_ROOMS, *_OTHERS})
