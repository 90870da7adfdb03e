"""What searches for parameters and for designs share: the strategy of the package cma, and fronts."""

import importlib.util
import math
import warnings
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from nectosome.units import InputError


def covariance_strategy(
    start: Float[np.ndarray, "n"],
    spread: float,
    tolerance: float,
    population: int | None,
    rng: np.random.Generator,
    **options: Any,
) -> Any:
    """A `CMAEvolutionStrategy` in the unit box that draws from `rng` and leaves no files."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma's own, about options it is given on purpose
        from cma import CMAEvolutionStrategy  # pyright: ignore[reportMissingImports]

        own = {
            "bounds": [[0.0] * start.size, [1.0] * start.size],
            "randn": lambda *shape: rng.standard_normal(shape),  # cma's numbers are those of the whole process
            "seed": math.nan,
            "tolx": tolerance,
            "verbose": -9,
        }
        size = {} if population is None else {"popsize": population}
        return CMAEvolutionStrategy(start, spread, own | size | options)


def need(package: str, what: str) -> None:
    """Raise InputError where a package is not installed that an extra of the same name brings."""
    if importlib.util.find_spec(package) is None:
        raise InputError(f'{package} is needed for {what}: pip install "nectosome[{package}]".')


def undominated(values: Float[np.ndarray, "m k"]) -> Int[np.ndarray, "f"]:
    """Indices of the rows of k costs that no other row equals or beats in all, by rising first cost; of equals one."""
    kept: list[int] = []
    front = np.empty_like(values)
    for k in np.lexsort(values.T[::-1]):  # what beats a row comes before it
        if not (front[: len(kept)] <= values[k]).all(axis=1).any():
            front[len(kept)] = values[k]
            kept.append(int(k))
    return np.array(kept, dtype=int)
