"""Every optimiser by its name: a class below `Optimiser` in a file of its own here is known by being written."""

from dataclasses import fields
from typing import Any

from nectosome.io.discovery import classes_below, load_modules
from nectosome.units import InputError, did_you_mean

from ..contract import Optimiser
from .cmaes import CmaEs
from .genetic import Differential, Genetic, Nsga2
from .gradient import Gradient
from .pattern import Pattern

__all__ = ["CmaEs", "Differential", "Genetic", "Gradient", "Nsga2", "Pattern"]

load_modules(__name__)
OPTIMISERS: dict[str, type[Optimiser]] = {kind.name: kind for kind in classes_below(Optimiser) if "name" in vars(kind)}


def make_optimiser(name: str, **options: Any) -> Optimiser:
    """Return an optimiser by its name. Raises InputError for an unknown name or option, and a wrong value."""
    if name not in OPTIMISERS:
        raise InputError(f'there is no optimiser "{name}".{did_you_mean(name, OPTIMISERS)}')
    known = [f.name for f in fields(OPTIMISERS[name])]  # pyright: ignore[reportArgumentType]
    for option in options:
        if option not in known:
            raise InputError(f'{name} has no option "{option}".{did_you_mean(option, known)}')
    try:
        # JSON has lists for tuples
        return OPTIMISERS[name](**{k: tuple(v) if isinstance(v, list) else v for k, v in options.items()})
    except TypeError as error:
        raise InputError(f"{name}: {error}") from None
