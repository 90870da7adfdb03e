"""Every optimiser once, by what it is; a new one is a class in a file of its own, and stands here."""

from ..contract import Optimiser
from .cmaes import CmaEs
from .differential import Differential
from .genetic import Genetic
from .gradient import Gradient
from .nsga2 import Nsga2
from .pattern import Pattern

__all__ = ["CmaEs", "Differential", "Genetic", "Gradient", "Nsga2", "Pattern"]

OPTIMISERS: dict[str, type[Optimiser]] = {
    kind.name: kind for kind in (Gradient, Pattern, CmaEs, Genetic, Differential, Nsga2)
}
