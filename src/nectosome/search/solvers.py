"""Solvers by name, as files and command lines call them."""

from dataclasses import asdict, fields
from typing import Any

from nectosome.units import InputError, did_you_mean

from .evolution import Evolution
from .gradient import Gradient
from .pareto import Front
from .pattern import Pattern
from .task import Solver

SOLVERS: dict[str, type[Solver]] = {"pattern": Pattern, "gradient": Gradient, "evolution": Evolution, "front": Front}


def make_solver(name: str, **options: Any) -> Solver:
    """Return a solver by its name. Raises InputError for an unknown name or option, or a value that makes no sense."""
    if name not in SOLVERS:
        raise InputError(f'there is no solver "{name}".{did_you_mean(name, SOLVERS)}')
    known = [f.name for f in fields(SOLVERS[name])]  # pyright: ignore[reportArgumentType]
    for option in options:
        if option not in known:
            raise InputError(f'{name} has no option "{option}".{did_you_mean(option, known)}')
    try:
        # JSON has lists for tuples
        return SOLVERS[name](**{k: tuple(v) if isinstance(v, list) else v for k, v in options.items()})
    except (ValueError, TypeError) as error:
        raise InputError(str(error)) from None


def describe_solver(solver: Solver) -> dict[str, Any]:
    """Return the name and options that `make_solver` makes it of, as JSON data; other solvers go by their class."""
    names = {kind: name for name, kind in SOLVERS.items()}
    kind = type(solver)
    name = names.get(kind, f"{kind.__module__}.{kind.__qualname__}")
    return {"name": name, **asdict(solver)}  # pyright: ignore[reportArgumentType]
