"""nectosome: from a drawing to a tuned underwater soft robot.

    import nectosome as ns

    robot = ns.describe("flagellum")                        # or the path of a robot file
    robot = ns.apply_settings(robot, ["omega=14.4rad/s"])   # any quantity, by its path or alias, with its unit
    run = ns.simulate(robot, "2.5s")                        # from rest
    data = run.to_dataset()                                 # an xarray.Dataset in SI units

What works on a robot takes its name, the path of its file, its description, or what `build` makes of one:
`ns.simulate("flagellum", 2.5)`. Names are loaded when they are first used, so that importing the package is quick; the
rooms are too, as in `ns.measure.read("run.csv")`.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from . import _renamed as _renamed  # finds modules by their former names

if TYPE_CHECKING:
    from .controllers import control
    from .description import apply_settings, drive_period, load_robot, save_robot
    from .designs import design, spread, sweep
    from .identification import correct, fit, identify
    from .io import load_dataset, save_dataset
    from .model import bind, build
    from .robots import beetle, beetle_free, describe, flagella, names
    from .solve import critical, forces, modes, periodic, reading, simulate, static, steady
    from .units import InputError
    from .view import show_intervals, show_run, show_sweep

_ROOMS = {
    "controllers": ("control",),
    "description": ("apply_settings", "drive_period", "load_robot", "save_robot"),
    "designs": ("design", "spread", "sweep"),
    "identification": ("correct", "fit", "identify"),
    "io": ("load_dataset", "save_dataset"),
    "model": ("bind", "build"),
    "robots": ("beetle", "beetle_free", "describe", "flagella", "names"),
    "solve": ("critical", "forces", "modes", "periodic", "reading", "simulate", "static", "steady"),
    "units": ("InputError",),
    "view": ("show_intervals", "show_run", "show_sweep"),
}
_OTHERS = (
    "core",
    "drives",
    "export",
    "geometry",
    "gym",
    "loads",
    "measure",
    "mechanism",
    "rigs",
    "search",
    "vision",
)
_HOME = {name: room for room, inside in _ROOMS.items() for name in inside}

__all__ = sorted(_HOME)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    if name in _ROOMS or name in _OTHERS or name == "papers":
        return import_module(f"{__name__}.{name}")
    raise AttributeError(f"nectosome has no {name}")


def __dir__() -> list[str]:
    return sorted({*__all__, *_ROOMS, *_OTHERS})
