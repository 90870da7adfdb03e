"""Problems with known solutions, and ways to make them harder; importable, so that worker processes find them."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from nectosome.search import Evaluation, Task


@dataclass(frozen=True)
class Problem:
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    constraints: int
    function: Callable  # x -> objective, constraints; analytic, so that complex steps give exact derivatives
    best: float
    where: tuple[float, ...]


def _disc(x):
    return (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2, [x[0] ** 2 + x[1] ** 2 - 1]


def _valley(x):
    return (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2, []


def _line(x):
    return (x[0] - 0.3) ** 2, [0.5 - x[0]]


def _rosen_suzuki(x):
    a, b, c, d = x
    f = a * a + b * b + 2 * c * c + d * d - 5 * a - 5 * b - 21 * c + 7 * d
    return f, [
        (a * a + b * b + c * c + d * d + a - b + c - d - 8) / 8,
        (a * a + 2 * b * b + c * c + 2 * d * d - a - d - 10) / 10,
        (2 * a * a + b * b + c * c + 2 * a - b - d - 5) / 5,
    ]


def _hs71(x):
    a, b, c, d = x
    equal = (a * a + b * b + c * c + d * d) / 40 - 1
    return a * d * (a + b + c) + c, [1 - a * b * c * d / 25, equal, -equal]


def _g06(x):
    a, b = x
    return (a - 10) ** 3 + (b - 20) ** 3, [
        (100 - (a - 5) ** 2 - (b - 5) ** 2) / 100,
        ((a - 6) ** 2 + (b - 5) ** 2 - 82.81) / 82.81,
    ]


def _g08(x):
    a, b = x
    f = -(np.sin(2 * np.pi * a) ** 3) * np.sin(2 * np.pi * b) / (a**3 * (a + b))
    return f, [a * a - b + 1, 1 - a + (b - 4) ** 2]


def _two_circles(x):
    """Distance to (0, 0) against distance to (1, 0), both squared: the front is the line between."""
    return x[0] ** 2 + x[1] ** 2, [(x[0] - 1) ** 2 + x[1] ** 2 - 1]


# Hock and Schittkowski 1981 (hs), Koziel and Michalewicz 1999 (g); the disc is the first example of Matlab's fmincon
PROBLEMS = {
    "disc": Problem((-1.5, -1.5), (1.5, 1.5), 1, _disc, 0.0456748, (0.78641515, 0.61769831)),
    "valley": Problem((-1.5, -1.5), (1.5, 1.5), 0, _valley, 0.0, (1, 1)),
    "line": Problem((0,), (2,), 1, _line, 0.04, (0.5,)),
    "hs43": Problem((-5,) * 4, (5,) * 4, 3, _rosen_suzuki, -44.0, (0, 1, 2, -1)),
    "hs71": Problem((1,) * 4, (5,) * 4, 3, _hs71, 17.0140173, (1, 4.7429994, 3.8211503, 1.3794082)),
    "g06": Problem((13, 0), (100, 100), 2, _g06, -6961.81388, (14.095, 0.84296)),
    "g08": Problem((0.01, 0.01), (10, 10), 2, _g08, -0.095825, (1.2279713, 4.2453733)),
    "circles": Problem((-1, -1), (2, 2), 1, _two_circles, 0.0, (0, 0)),
}


@dataclass(frozen=True)
class Known(Task):
    """A known problem in the unit box.

    - holes: (x..., radius) without a solution, in the problem's own variables.
    - anywhere: infeasible starts are accepted too.
    - levels: of each variable.
    - pause: time an evaluation takes [s]; log: where computed evaluations are counted, one byte each.
    """

    problem: str
    holes: tuple[tuple[float, ...], ...] = ()
    anywhere: bool = False
    pause: float = 0.0
    log: str = ""
    levels: tuple[int, ...] = ()
    names: tuple[str, ...] = field(init=False)
    constraint_names: tuple[str, ...] = field(init=False)

    def __post_init__(self):
        known = PROBLEMS[self.problem]
        object.__setattr__(self, "names", tuple(f"x{i}" for i in range(len(known.lower))))
        object.__setattr__(self, "constraint_names", tuple(f"g{i}" for i in range(known.constraints)))

    def key(self) -> str:
        return f"{self.problem} {self.holes} {self.anywhere} {self.levels}"

    def accepts(self, evaluation: Evaluation) -> str:
        return evaluation.reason if self.anywhere else super().accepts(evaluation)

    def own(self, u):
        """The design in the problem's own variables."""
        lower, upper = map(np.array, (PROBLEMS[self.problem].lower, PROBLEMS[self.problem].upper))
        return lower + u * (upper - lower)

    def prepare(self):
        function, m = PROBLEMS[self.problem].function, len(self.constraint_names)
        centers = [(np.array(hole[:-1]), hole[-1]) for hole in self.holes]

        def evaluate(u, derivatives, memory):
            if self.log:
                with (Path(self.log) / str(os.getpid())).open("ab") as file:
                    file.write(b".")
            if self.pause:
                time.sleep(self.pause)
            x = self.own(u)
            if any(np.linalg.norm(x - center) < radius for center, radius in centers):
                return Evaluation.unsolved(u, m, "in a hole")
            f, g = function(x)
            e = Evaluation(u, float(f), np.array(g, dtype=float), outputs={"x0": float(x[0])})
            if not derivatives:
                return e
            columns = [function(self.own(u + 1e-30j * row)) for row in np.eye(u.size)]
            df = np.array([np.imag(f) for f, _ in columns]) / 1e-30
            dg = np.array([np.imag(g) for _, g in columns]).T.reshape(m, u.size) / 1e-30
            return replace(e, gradient=df, jacobian=dg)

        return evaluate


class Compiled(Known):
    """One whose program takes two seconds to compile."""

    def prepare(self):
        from nectosome.core.programs import remember  # loads JAX, which the others do without

        with remember._told("program"):
            time.sleep(2.0)
        return super().prepare()
