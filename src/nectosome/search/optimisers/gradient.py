"""Sequential quadratic programming in a trust region, with exact derivatives, around designs without a solution."""

import math
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from typing import ClassVar

import daqp
import numpy as np
from jaxtyping import Float
from scipy.optimize import linprog

from ..contract import OBJECTIVE_TOLERANCE, Ask, Optimiser, Outcome, Search
from ..task import Evaluation, Space

_FIRST_RADIUS = 0.2  # of the box
_ENOUGH = 1e-4  # share of the predicted decrease that a step must bring
_EXACT = 1e-12  # miss of a constraint, where solutions are of the order of 1
_NO_LIMIT = -1e30
_NEAR = 1e-3  # of each range: what so small a change promises is what an arrived search could still gain
_QUIET = 2  # steps in a row at least; as many as variables, so that the curvature along each is known


@dataclass(frozen=True)
class Gradient(Optimiser):
    r"""Sequential quadratic programming (Nocedal and Wright 2006, chapter 18): BFGS, exact penalty, trust region.

    A step minimises a quadratic model of the Lagrangian with linear constraints in a box around the design, and is kept
    where the merit \( f + \nu \sum \max(g, 0) \) falls with it. A design without a solution makes the box smaller, and
    steps keep to the near side of it from then on; no value is put in its place.

    Variables that take some values only stay at theirs while the others are searched; then the neighbouring value to
    which the Lagrangian falls is tried, with a search of its own, and kept where the objective falls. It ends where no
    neighbour is better: with convex problems that is the best there is.

    - tolerance: on the Karush-Kuhn-Tucker conditions, and the constraints.
    - objective_tolerance: as many steps in a row as there are variables, at least two, promised and brought less; what
      a step promises is counted over 0.001 of each range where it is shorter.
    - smallest_step: share of the box at which it gives up.
    - evaluations: each with derivatives.
    """

    tolerance: float = 1e-6
    objective_tolerance: float = OBJECTIVE_TOLERANCE
    smallest_step: float = 1e-7
    evaluations: int = 200
    name: ClassVar[str] = "gradient"
    derivatives: ClassVar[bool] = True
    needs_start: ClassVar[bool] = True

    def __post_init__(self):
        super().__post_init__()
        for name in ("tolerance", "smallest_step"):
            value = getattr(self, name)
            fits = math.isfinite(value) and 0 < value < 0.1
            self._require(name, fits, f"is {value}; it must lie between 0 and 0.1.")

    def likely(self, space: Space) -> int:
        """A step learns about one direction."""
        return min(self.evaluations, 10 + 3 * space.variables)

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Minimise from `start`, which must be solved; `seed` is not needed."""
        del seed
        assert start is not None
        steps, spent, accepted = space.steps, 0, 0
        best, outcome, left = None, None, [np.asarray(start, dtype=float)]  # designs to search from
        while left and spent < self.evaluations:
            (first,) = yield Ask(left.pop()[None], derivatives=True, iterations=accepted)
            spent += 1
            if not first.solved:
                outcome = outcome or Outcome(False, f"the start has no solution: {first.reason}", accepted)
                continue
            run = _Iterations(self, _Point.of(first), steps > 0, evaluations=spent, accepted=accepted)
            ended = yield from run.run()
            spent, accepted = run.evaluations, ended.iterations
            if best is None or run.better_than(best):
                best, outcome, left = run, ended, run.neighbours(steps)
        assert outcome is not None
        if steps.any() and outcome.converged:
            done = not left
            words = "no neighbouring value is better" if done else f"{self.evaluations} evaluations made"
            return Outcome(done, words, accepted)
        return Outcome(outcome.converged, outcome.message, accepted)


@dataclass(frozen=True, eq=False)
class _Point:
    """A solved design."""

    z: np.ndarray
    f: float
    g: np.ndarray
    df: np.ndarray
    dg: np.ndarray

    @classmethod
    def of(cls, e: Evaluation) -> "_Point":
        assert e.gradient is not None
        assert e.jacobian is not None
        return cls(e.u, e.objective, e.constraints, e.gradient, e.jacobian)

    def merit(self, penalty: float) -> float:
        return self.f + penalty * _broken(self.g)


def _broken(g: np.ndarray) -> float:
    return float(np.maximum(g, 0.0).sum())


@dataclass
class _Iterations:
    options: Gradient
    at: _Point
    held: np.ndarray  # mask of variables that stay
    radius: float = _FIRST_RADIUS
    penalty: float = 0.0
    evaluations: int = 1
    accepted: int = 0
    curvature: np.ndarray | None = None  # of the Lagrangian
    lowest: float = np.inf  # objective where all constraints are kept
    quiet: int = 0  # steps in a row that neither promised nor brought a change
    multipliers: np.ndarray = field(init=False)
    unsolved: list[np.ndarray] = field(default_factory=list)  # designs without a solution
    reason: str = ""  # of the last of them

    def __post_init__(self) -> None:
        self.multipliers = np.zeros(self.at.g.size)
        self._count(self.at)

    def better_than(self, other: "_Iterations") -> bool:
        """Whether the objective is clearly lower than where another search ended."""
        change = self.options.objective_tolerance * abs(self.lowest) if np.isfinite(self.lowest) else 0.0
        return self.lowest < other.lowest - change

    def neighbours(self, steps: np.ndarray) -> list[np.ndarray]:
        """Designs with the next value of one held variable, to where it gets better; the most promising one last."""
        kept = np.isfinite(self.lowest)
        slopes = self.at.df + self.at.dg.T @ (self.multipliers if kept else self.at.g > 0)
        gains = np.abs(slopes * steps)
        moved = self.at.z - np.diag(np.sign(slopes) * steps)
        inside = (moved.min(axis=1) > -1e-9) & (moved.max(axis=1) < 1 + 1e-9)
        return [moved[k] for k in np.argsort(gains) if gains[k] > 0 and inside[k]]

    def run(self) -> Search:
        while self.evaluations < self.options.evaluations:
            if self.radius < self.options.smallest_step:
                return Outcome(False, f"no change, however small, made it better{self._blame()}", self.accepted)
            d, self.multipliers = self._step(self.at.g)
            if self._optimal(self.multipliers):
                return Outcome(True, "the optimality conditions are met", self.accepted)
            predicted = self._predict(d, self.multipliers)
            if predicted <= 1e-13 * (1 + abs(self.at.f)):
                feasible = self.at.g.max(initial=0.0) <= self.options.tolerance
                what = "no step promises to be better" if feasible else "the constraints cannot be met from here"
                return Outcome(bool(feasible) and not self._blame(), what + self._blame(), self.accepted)
            yield from self._try(d, self.multipliers, predicted)
            kept = self.lowest <= self.at.merit(self.penalty) + self._change
            if self.quiet >= max(_QUIET, (~self.held).sum()) and kept:
                arrived = self.options._arrived(self.accepted)
                return replace(arrived, converged=not self._blame(), message=arrived.message + self._blame())
        return Outcome(False, f"{self.options.evaluations} evaluations made", self.accepted)

    @property
    def _change(self) -> float:
        """Of the objective, that does not count."""
        return self.options.objective_tolerance * abs(self.at.f)

    def _count(self, point: _Point) -> None:
        if point.g.max(initial=0.0) <= self.options.tolerance:
            self.lowest = min(self.lowest, point.f)

    def _blame(self) -> str:
        """Say so where designs without a solution are nearby."""
        near = any(np.abs(z - self.at.z).max() <= 1e-2 for z in self.unsolved)
        return f"; next to it there is no solution: {self.reason}" if near else ""

    def _try(self, d: np.ndarray, multipliers: np.ndarray, predicted: float) -> Generator[Ask, list[Evaluation]]:
        """Evaluate a step, go there if it is good, and adapt the radius."""
        length = float(np.abs(d).max())
        new = yield from self._at(self.at.z + d)
        if new is None:
            self.radius, self.quiet = 0.5 * min(self.radius, length), 0
            return
        gain = self.at.merit(self.penalty) - new.merit(self.penalty)
        small = max(predicted * max(1.0, _NEAR / self.radius), gain) < self._change
        self.quiet = self.quiet + 1 if small else 0
        if gain < _ENOUGH * predicted and _broken(new.g) > 0:
            # second-order correction: curved constraints spoil long steps that are good (Maratos)
            d = self._step(new.g - self.at.dg @ d)[0]
            better = yield from self._at(self.at.z + d)
            if better is not None:
                new, length = better, float(np.abs(d).max())
                gain = self.at.merit(self.penalty) - new.merit(self.penalty)
        if gain < _ENOUGH * predicted:
            self.radius = 0.5 * min(self.radius, length)
            return
        if gain > 0.75 * predicted and length > 0.8 * self.radius:
            self.radius = min(1.0, 2 * self.radius)
        elif gain < 0.25 * predicted:
            self.radius = 0.5 * self.radius
        self._learn(new, multipliers)
        self.at = new
        self.accepted += 1

    def _at(self, z: np.ndarray) -> Generator[Ask, list[Evaluation], _Point | None]:
        """The point at z; None, and a note of it, where there is no solution."""
        self.evaluations += 1
        (e,) = yield Ask(np.clip(z, 0, 1)[None], derivatives=True, iterations=self.accepted)
        if not e.solved:
            self.unsolved.append(z)
            self.reason = e.reason
            return None
        self._count(point := _Point.of(e))
        return point

    def _step(self, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The step that minimises the model with g + dg d <= 0, or comes nearest to it, and its multipliers [m]."""
        at, n, m = self.at, self.at.z.size, g.size
        B = np.eye(n) * max(1.0, float(np.abs(at.df).max())) if self.curvature is None else self.curvature
        low, high = np.maximum(-self.radius, -at.z), np.minimum(self.radius, 1 - at.z)
        low, high = np.where(self.held, 0.0, (low, high))
        offsets = [z - at.z for z in self.unsolved if np.abs(z - at.z).max() <= 2 * self.radius]
        walls = np.array([offset / np.linalg.norm(offset) for offset in offsets]).reshape(-1, n)
        halfway = np.array([0.5 * np.linalg.norm(offset) for offset in offsets])
        A = np.vstack([at.dg, walls, np.eye(n), -np.eye(n)])
        b = np.concatenate([-g, halfway, high, -low])
        minimum = minimise_quadratic(B, at.df, A, b, self.radius)
        if minimum is None:
            nearest = linprog(
                np.concatenate([np.zeros(n), np.ones(m)]),
                np.block([[at.dg, -np.eye(m)], [walls, np.zeros((len(offsets), m))]]),
                np.concatenate([-g, halfway]),
                bounds=[*zip(low, high, strict=True), *[(0, None)] * m],
            )
            if nearest.x is None:  # cannot be: d = 0 is one
                return np.zeros(n), np.zeros(m)
            d = np.clip(nearest.x[:n], low, high)
            minimum = minimise_quadratic(B, at.df, A, np.maximum(b, A @ d + 1e-9), self.radius) or (d, np.zeros(b.size))
        return np.clip(minimum[0], low, high), minimum[1][:m]

    def _optimal(self, multipliers: np.ndarray) -> bool:
        """Karush-Kuhn-Tucker: a projected step down the Lagrangian leads nowhere, constraints kept, active or free."""
        at, tolerance = self.at, self.options.tolerance
        scale = 1 + float(np.abs(at.df).max())
        down = np.clip(at.z - (at.df + at.dg.T @ multipliers) / scale, 0, 1) - at.z
        down[self.held] = 0.0
        return bool(
            np.abs(down).max() <= tolerance
            and at.g.max(initial=0.0) <= tolerance
            and np.abs(multipliers * at.g).max(initial=0.0) <= tolerance * scale
        )

    def _predict(self, d: np.ndarray, multipliers: np.ndarray) -> float:
        """Decrease of the merit by the model; the penalty grows until it is worth the constraints it mends."""
        at = self.at
        up = float(at.df @ d)
        bend = 0.0 if self.curvature is None else 0.5 * float(d @ self.curvature @ d)
        mended = _broken(at.g) - _broken(at.g + at.dg @ d)
        needed = 1.1 * float(multipliers.max(initial=0.0))
        if mended > 1e-12:
            needed = max(needed, (up + bend) / (0.7 * mended))
        self.penalty = max(needed, 0.5 * (self.penalty + needed))
        return self.penalty * mended - up - bend

    def _learn(self, new: _Point, multipliers: np.ndarray) -> None:
        """Damped BFGS update of the Lagrangian's curvature (Powell 1978)."""
        s = new.z - self.at.z
        y = np.where(self.held, 0.0, new.df - self.at.df + (new.dg - self.at.dg).T @ multipliers)
        if self.curvature is None:
            self.curvature = np.eye(s.size) * max(abs(float(y @ y / (s @ y))) if s @ y != 0 else 1.0, 1e-6)
        B = self.curvature
        Bs = B @ s
        sBs, sy = float(s @ Bs), float(s @ y)
        if sBs <= 0:
            return
        mix = 1.0 if sy >= 0.2 * sBs else 0.8 * sBs / (sBs - sy)
        r = mix * y + (1 - mix) * Bs
        B = B - np.outer(Bs, Bs) / sBs + np.outer(r, r) / float(s @ r)
        B = 0.5 * (B + B.T)
        values, vectors = np.linalg.eigh(B)
        values = np.clip(values, 1e-8 * max(values.max(), 1e-8), None)
        self.curvature = (vectors * values) @ vectors.T


def minimise_quadratic(
    B: Float[np.ndarray, "n n"],
    c: Float[np.ndarray, "n"],
    A: Float[np.ndarray, "k n"],
    b: Float[np.ndarray, "k"],
    length: float = 1.0,
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "k"]] | None:
    r"""Minimise \( c^T d + d^T B d / 2 \) with \( A d \le b \), B positive definite.

    By the dual active-set solver DAQP (Arnstrom, Bemporad and Axehill 2022); `length` is the order of d. Returns d and
    the multipliers (>= 0) of the rows of A, or None where no d fits them.
    """
    size = float(np.abs(B).max())
    lower = np.full(b.size, _NO_LIMIT)
    d, _, flag, info = daqp.solve(
        B / size, c / (size * length), np.ascontiguousarray(A), b / length, lower, primal_tol=_EXACT
    )
    return (d * length, info["lam"] * (size * length)) if flag == 1 else None
