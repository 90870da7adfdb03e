"""Model predictive control of an actuator with hysteresis: saturation and slew rate are constraints.

A discrete Kalman filter estimates the states and a disturbance of the input from noisy outputs.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import daqp
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.linalg import solve_discrete_are

from nectosome.core import Line
from nectosome.drives import TransferFunction, respond
from nectosome.units import InputError

from .contract import ActuatorLimits, Controller, LoopData, Regulator
from .hysteretic_model import HystereticModel, half_window


class DiscreteModel(NamedTuple):
    """x' = A x + B u with zero-order hold of the input, y = C x."""

    A: Float[np.ndarray, "n n"]
    B: Float[np.ndarray, "n"]
    C: Float[np.ndarray, "n"]


def discrete(dynamics: TransferFunction, dt: float) -> DiscreteModel:
    """Matrices of a transfer function. Raises ValueError for one with feedthrough."""
    linear: Any = dynamics.sampled(dt)
    if float(linear.E) != 0.0:
        raise ValueError("the degree of the numerator must be lower than that of the denominator.")
    return DiscreteModel(np.asarray(linear.A), np.asarray(linear.B), np.asarray(linear.D))


class KalmanFilter(eqx.Module):
    r"""States and a random-walk disturbance w of the input: $x' = A x + B (u + w)$, $y = C x + $ noise.

    The gain is the stationary one, of the discrete Riccati equation.
    """

    A: Float[Array, "n+1 n+1"]
    B: Float[Array, "n+1"]
    C: Float[Array, "n+1"]
    gain: Float[Array, "n+1"]

    def corrected(self, z: Float[Array, "n+1"], measured: Float[Array, ""]) -> Float[Array, "n+1"]:
        """Estimate after a measurement."""
        return z + self.gain * (measured - jnp.sum(self.C * z))

    def predicted(self, z: Float[Array, "n+1"], u: Float[Array, ""]) -> Float[Array, "n+1"]:
        """Estimate one sample later."""
        return jnp.sum(self.A * z, axis=1) + self.B * u


def kalman(model: DiscreteModel, wander: float, noise: float) -> KalmanFilter:
    """Filter for a disturbance with steps of standard deviation `wander` [input] a sample, and `noise` of y.

    Raises InputError where one is not above 0.
    """
    for name, value in (("wander", wander), ("noise", noise)):
        if not value > 0:
            raise InputError(f"is {value:g}; it must be more than 0.", field=name)
    n = len(model.B)
    A = np.block([[model.A, model.B[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
    C = np.append(model.C, 0.0)
    Q, R = np.diag([0.0] * n + [wander**2]), np.array([[noise**2]])
    P = solve_discrete_are(A.T, C[:, None], Q, R)
    gain = P @ C / (C @ P @ C + noise**2)
    return KalmanFilter(*(jnp.asarray(x) for x in (A, np.append(model.B, 0.0), C, gain)))


class Predictive(Controller):
    r"""At each sample it minimises over the inputs v of the dynamics along a horizon

    $$ \sum_i (y_i - r_i)^2 + \rho \sum_i (v_i + \hat w - v^*_i)^2 $$

    and sends the first input through the inverse of the hysteresis. v* is the inverse of the model along the reference,
    w a disturbance of the input, estimated by a Kalman filter, which stands for all errors of the model. Saturation and
    slew rate of the command are constraints of the quadratic program: exact for the first input, for later ones by the
    slope of the hysteresis along the reference. Solver: DAQP (Arnstrom et al. 2022).
    """

    model: HystereticModel
    limits: ActuatorLimits
    horizon: int = eqx.field(static=True)  # samples
    weight: float = eqx.field(static=True)  # rho [outputs by inputs of the dynamics, squared]
    wander: float = eqx.field(static=True)  # of the disturbance in a sample [input of the dynamics]
    noise: float = eqx.field(static=True)  # of measurements
    width: float = eqx.field(static=True)  # over which the reference is smoothed [s]
    name = "mpc"
    needs_model = True

    @classmethod
    def from_loop(cls, loop: LoopData) -> "Predictive":
        """With the delay of the model in whole samples; the command takes a beat or more for its whole range.

        Within a beat a command that changes is a motion of its own, which the model does not have.
        """
        assert loop.model is not None
        pace, noise, limits = loop.pace, loop.noise, loop.limits
        whole = replace(loop.model, delay=jnp.round(loop.model.delay / loop.dt) * loop.dt)
        if loop.beat:
            slow = jnp.minimum(limits.slew, (limits.high - limits.low) / loop.beat)
            limits = ActuatorLimits(limits.low, limits.high, slow)
        return cls(whole, limits, pace.horizon, pace.weight, pace.wander * noise, noise, pace.smoothing)

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Matrices, and the inverse of the model along the reference.

        Raises InputError where the delay is no whole number of samples, and for commands without limits.
        """
        if not np.isfinite([self.limits.low, self.limits.high]).all():
            raise InputError("finite limits of the command, low and high, are needed.", field="limits")
        delay = float(self.model.delay) / dt
        if abs(delay - round(delay)) > 1e-6:
            raise InputError(f"is {delay:g} samples; a whole number is needed.", field="delay")
        linear = discrete(self.model.dynamics, dt)
        free, forced = _prediction(linear, self.horizon)
        hessian = forced.T @ forced + self.weight * np.eye(self.horizon)
        rest = half_window(self.width, dt)  # after the end, until the smoothed reference is constant
        ends = np.pad(np.asarray(reference, dtype=float), (0, rest + self.horizon + round(delay) + 1), mode="edge")
        needed = self.model.dynamics_input(jnp.asarray(ends), dt, self.width)
        held = 0.5 * (needed + jnp.append(needed[1:], needed[-1]))  # mean over a hold interval
        command = respond(self.model.inverse, held, dt)
        du, dv = (jnp.abs(jnp.diff(x, prepend=0.0)) for x in (command, held))
        ends_of_range = respond(self.model.hysteresis, jnp.stack([self.limits.low, self.limits.high]), dt)
        mean = (ends_of_range[1] - ends_of_range[0]) / (self.limits.high - self.limits.low)
        moving = du > 1e-9 * (self.limits.high - self.limits.low)
        slope = jnp.where(moving, dv / jnp.where(moving, du, 1.0), mean)
        free, forced, hessian, inverse = map(jnp.asarray, (free, forced, hessian, np.linalg.inv(hessian)))
        observer = kalman(linear, self.wander, self.noise)
        others = observer, self.model, self.limits, len(reference) + rest, round(delay), self.weight, dt
        return _Horizon(jnp.asarray(ends), held, slope, free, forced, hessian, inverse, *others)


class _State(NamedTuple):
    k: Array
    z: Array  # of the Kalman filter
    hysteresis: Any  # state under the last command
    inverse: Any  # state of the inverse of the hysteresis
    delayed: Array  # inputs of the dynamics within the delay, the next one first
    command: Array  # the last one


class _Horizon(Regulator):
    reference: Float[Array, "m"]
    needed: Float[Array, "m"]  # v*
    slope: Float[Array, "m"]  # dv/du along the reference
    free: Float[Array, "h n+1"]  # outputs by the states
    forced: Float[Array, "h h"]  # outputs by the inputs
    hessian: Float[Array, "h h"]
    hessian_inverse: Float[Array, "h h"]
    observer: KalmanFilter
    model: HystereticModel
    limits: ActuatorLimits
    count: int = eqx.field(static=True)
    delay: int = eqx.field(static=True)  # samples from a command to its effect
    weight: float = eqx.field(static=True)
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> _State:
        """The model at rest under the command, with the disturbance that explains the measurement."""
        command = jnp.asarray(command, dtype=float)
        hysteresis, line = self.model.hysteresis.step(self.model.hysteresis.initial(), Line(command, command))
        inverse, _ = self.model.inverse.step(self.model.inverse.initial(), line)
        n = self.observer.B.shape[0] - 1
        A, B, C = self.observer.A[:n, :n], self.observer.B[:n], self.observer.C[:n]
        # x and v with x = A x + B v and y = C x; v is 0 where the dynamics integrate
        at_rest = jnp.block([[A - jnp.eye(n), B[:, None]], [C[None], jnp.zeros((1, 1))]])
        static = jnp.linalg.solve(at_rest, jnp.append(jnp.zeros(n), measured))
        z = static.at[n].add(-line.end)
        return _State(jnp.zeros((), dtype=int), z, hysteresis, inverse, jnp.full(self.delay, line.end), command)

    def step(self, state: _State, measured: Float[Array, ""]) -> tuple[_State, Float[Array, ""]]:
        """One sample."""
        z = self.observer.corrected(state.z, measured)
        start = z
        for v in state.delayed:
            start = self.observer.predicted(start, v)
        at, h = jnp.minimum(state.k, self.count - 1) + self.delay, self.forced.shape[0]
        target = jax.lax.dynamic_slice(self.reference, (at + 1,), (h,)) - self.free @ start
        needed = jax.lax.dynamic_slice(self.needed, (at,), (h,)) - start[-1]
        most = self.limits.slew * self.dt
        low, high, last = self.limits.low, self.limits.high, state.command
        ends = jnp.stack([jnp.clip(last - most, low, high), jnp.clip(last + most, low, high), low, high])
        bounds = jax.vmap(lambda u: self.model.hysteresis.step(state.hysteresis, Line(u, u))[1].end)(ends)
        changes = most * jax.lax.dynamic_slice(self.slope, (at + 1,), (h - 1,))
        v = _first(self.hessian, self.hessian_inverse, self.forced.T @ target + self.weight * needed, bounds, changes)
        unlimited = self.model.inverse.step(state.inverse, Line(v, v))[1].end
        command = self.limits.limit(unlimited, last, self.dt)
        hysteresis, line = self.model.hysteresis.step(state.hysteresis, Line(command, command))
        inverse, _ = self.model.inverse.step(state.inverse, line)
        delayed = jnp.append(state.delayed, line.end)
        z = self.observer.predicted(z, delayed[0])
        return _State(state.k + 1, z, hysteresis, inverse, delayed[1:], command), command


def _prediction(model: DiscreteModel, horizon: int) -> tuple[Float[np.ndarray, "h n+1"], Float[np.ndarray, "h h"]]:
    """Future outputs, by the present states (and a constant disturbance) and by the future inputs."""
    powers = [np.linalg.matrix_power(model.A, i) for i in range(horizon + 1)]
    impulses = np.array([model.C @ power @ model.B for power in powers[:-1]])
    forced = np.array([[impulses[i - j] if j <= i else 0.0 for j in range(horizon)] for i in range(horizon)])
    free = np.column_stack([np.stack([model.C @ power for power in powers[1:]]), forced.sum(axis=1)])
    return free, forced


def _first(
    hessian: Array, inverse: Array, gradient: Array, bounds: Float[Array, "4"], changes: Float[Array, "h-1"]
) -> Float[Array, ""]:
    """The first of the optimal inputs; NaN where the solver finds none.

    `bounds` are the lowest and the highest first input, and the lowest and the highest of all; `changes` the largest
    differences from one input to the next. The quadratic program is solved only where the unconstrained optimum
    violates one of them.
    """
    best = inverse @ gradient
    inside = (best[0] >= bounds[0]) & (best[0] <= bounds[1]) & jnp.all((best >= bounds[2]) & (best <= bounds[3]))
    feasible = inside & jnp.all(jnp.abs(jnp.diff(best)) <= changes)

    def constrained() -> Array:
        shape = jax.ShapeDtypeStruct((), gradient.dtype)
        return jax.pure_callback(_solve, shape, hessian, gradient, bounds, changes, vmap_method="sequential")

    return jax.lax.cond(feasible, lambda: best[0], constrained)


def _solve(hessian: Array, gradient: Array, bounds: Array, changes: Array) -> np.ndarray:
    P, q, ends, steps = (np.asarray(x, dtype=float) for x in (hessian, gradient, bounds, changes))
    h = len(q)
    scale = max(float(np.abs(ends).max()), 1e-300)  # tolerances of the solver are absolute
    high, low = np.full(h, ends[3]), np.full(h, ends[2])
    low[0], high[0] = ends[:2]
    upper, lower = (np.concatenate(x) / scale for x in ((high, steps), (low, -steps)))
    sense = np.zeros(2 * h - 1, dtype=np.int32)
    size = float(np.trace(P)) / h
    solution, _, flag, _ = daqp.solve(P / size, -q / (size * scale), np.diff(np.eye(h), axis=0), upper, lower, sense)
    return np.asarray(solution[0] * scale if flag == 1 else np.nan)
