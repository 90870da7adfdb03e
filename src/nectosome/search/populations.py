"""Ways to search a box without derivatives, a generation at a time; each asks for candidates and is told their values.

A search is a generator: it yields places in the unit box [m, n], is sent the values of the objectives there [m, k], inf
where a candidate has none, and returns in words why it has ended. The same n, seed and values make it ask for the same
places. The number of candidates may differ from one generation to the next.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.search.covariance import covariance_strategy, need
from nectosome.units import InputError

Search = Generator[Float[np.ndarray, "m n"], Float[np.ndarray, "m k"], str]
_SETTLED = 1e-8  # of the box: differences as small move nothing
_REDRAWN = 10  # generations without a single value, after which a run is given up
_WEIGHT, _CROSSOVER = 0.8, 0.9  # of differences, and the share of parameters taken over: Storn and Price 1997


class Evolver(ABC):
    """A way to search; a frozen dataclass with its options as fields."""

    objectives: ClassVar[int] = 1

    @abstractmethod
    def search(self, n: int, seed: int) -> Search:
        """Search over n parameters."""


@dataclass(frozen=True)
class CmaEs(Evolver):
    r"""CMA-ES (Hansen 2016) from anywhere in the box, with restarts from elsewhere (BIPOP, Hansen 2009).

    Restarts alternate, so that both kinds get as many evaluations: larger populations, twice as many each time, see the
    coarse shape of the objective; small ones $\lambda_0 (\lambda / 2 \lambda_0)^{u^2}$ with steps $\sigma_0 10^{-2u'}$,
    u and u' drawn from 0..1, look closely.

    - population: of the first run, 4 + 3 ln n unless given.
    - spread: first standard deviation, as a share of the box.
    - tolerance: spread at which a run ends.
    - restarts: how many there are, 0 for one run.
    """

    population: int | None = None
    spread: float = 0.3
    tolerance: float = 1e-6
    restarts: int = 20

    def __post_init__(self):
        _at_least(self, 4, "population")
        _at_least(self, 0, "restarts")
        if not 0 < self.tolerance < self.spread <= 1:
            told = f"{self.tolerance:g} and {self.spread:g} do not go together: 0 < tolerance < spread <= 1."
            raise InputError(told, field="CmaEs: tolerance, spread")

    def search(self, n: int, seed: int) -> Search:
        """Raise InputError for a single parameter."""
        if n < 2:
            raise InputError("needs two parameters or more. Take DifferentialEvolution for one.", field="CmaEs")
        rng = np.random.default_rng(seed)
        first = self.population or 4 + int(3 * math.log(n))
        size, start, spread, spent = first, rng.uniform(size=n), self.spread, [0, 0]
        large, doublings = True, 0
        for _ in range(1 + self.restarts):
            strategy = covariance_strategy(start, spread, self.tolerance, size, rng, tolfun=0, tolfunhist=0)
            spent[large] += yield from _one_run(strategy)
            large, start = spent[True] <= spent[False] or doublings == 0, rng.uniform(size=n)
            if large:
                doublings += 1
                size, spread = first * 2**doublings, self.spread
            else:
                u, narrow = rng.uniform(size=2)
                size = int(first * (2 ** (doublings - 1)) ** (u * u))
                spread = max(self.spread * 10 ** (-2 * narrow), 10 * self.tolerance)
        return f"the population has settled in each of {1 + self.restarts} runs"


@dataclass(frozen=True)
class Genetic(Evolver):
    """Genetic algorithm with real numbers: simulated binary crossover and polynomial mutation (Deb 2001); pymoo."""

    population: int = 100

    def __post_init__(self):
        _at_least(self, 4, "population")

    def search(self, n: int, seed: int) -> Search:
        """Raise InputError where pymoo is not installed."""
        need("pymoo", "Genetic")
        from pymoo.algorithms.soo.nonconvex.ga import GA  # pyright: ignore[reportMissingImports]

        return (yield from _of_pymoo(GA(self.population), n, self.objectives, seed))


@dataclass(frozen=True)
class DifferentialEvolution(Evolver):
    """Differential evolution, best/1/bin with weight 0.8 and crossover 0.9 (Storn and Price 1997; Price 2005); pymoo.

    - population: ten times the number of parameters unless given.
    """

    population: int | None = None

    def __post_init__(self):
        _at_least(self, 4, "population")

    def search(self, n: int, seed: int) -> Search:
        """Raise InputError where pymoo is not installed."""
        need("pymoo", "DifferentialEvolution")
        from pymoo.algorithms.soo.nonconvex.de import DE  # pyright: ignore[reportMissingImports]

        size = self.population or 10 * n
        algorithm = DE(size, variant="DE/best/1/bin", F=_WEIGHT, CR=_CROSSOVER)
        return (yield from _of_pymoo(algorithm, n, self.objectives, seed, _SETTLED))


@dataclass(frozen=True)
class ParetoFront(Evolver):
    """The front between several objectives: NSGA-II (Deb 2002); pymoo."""

    objectives: int = 2  # pyright: ignore[reportIncompatibleVariableOverride]
    population: int = 100

    def __post_init__(self):
        _at_least(self, 2, "objectives")
        _at_least(self, 4, "population")

    def search(self, n: int, seed: int) -> Search:
        """Raise InputError where pymoo is not installed."""
        need("pymoo", "ParetoFront")
        from pymoo.algorithms.moo.nsga2 import NSGA2  # pyright: ignore[reportMissingImports]

        return (yield from _of_pymoo(NSGA2(self.population), n, self.objectives, seed))


def _one_run(strategy: Any) -> Generator[np.ndarray, np.ndarray, int]:
    """Run a strategy to its end; how many candidates it asked for. What has no value is told as the worst."""
    asked = empty = 0
    while empty < _REDRAWN and not strategy.stop():
        drawn = strategy.ask()
        values = (yield np.clip(drawn, 0.0, 1.0))[:, 0]
        asked += len(values)
        found = values[np.isfinite(values)]
        if not found.size:
            empty += 1  # nothing to tell: it draws again
            continue
        empty, worst = 0, found.max()
        beyond = worst + max(worst - found.min(), abs(worst), 1.0)
        strategy.tell(drawn, np.where(np.isfinite(values), values, beyond).tolist())
    return asked


def _of_pymoo(algorithm: Any, n: int, objectives: int, seed: int, settled: float = 0.0) -> Search:
    """Run an algorithm of pymoo until its population is as small as `settled`, as a share of the box.

    What has no value counts as infeasible: it loses every comparison.
    """
    from pymoo.core.problem import Problem  # pyright: ignore[reportMissingImports]
    from pymoo.core.termination import NoTermination  # pyright: ignore[reportMissingImports]

    problem = Problem(n_var=n, n_obj=objectives, n_ieq_constr=1, xl=np.zeros(n), xu=np.ones(n))
    algorithm.setup(problem, termination=NoTermination(), seed=seed)
    while True:
        asked = algorithm.ask()
        if asked is None:
            return "there are no new candidates"
        values = yield asked.get("X")
        found = np.isfinite(values).all(axis=1, keepdims=True)
        asked.set("F", np.where(found, values, 0.0))
        asked.set("G", np.where(found, -1.0, 1.0))
        for one in asked:
            one.evaluated.update(("F", "G", "H"))
        algorithm.tell(infills=asked)
        if np.ptp(algorithm.pop.get("X"), axis=0).max() < settled:
            return "the population has settled"


def _at_least(evolver: Evolver, least: int, field: str) -> None:
    number = getattr(evolver, field)
    if number is not None and number < least:
        raise InputError(f"is {number}; it must be at least {least}.", field=f"{type(evolver).__name__}: {field}")
