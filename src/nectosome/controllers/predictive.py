"""Model predictive control of an actuator with hysteresis: limits of range and rate are constraints."""

from typing import Any, NamedTuple

import daqp
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Line
from nectosome.drives import respond
from nectosome.units import InputError

from .contract import Controller, Regulator
from .feedforward import HystereticModel, half_window
from .kalman import KalmanFilter, Sampled, kalman, sampled
from .pid import ActuatorLimits


class Predictive(Controller):
    r"""At each sample the inputs v of the dynamics over a horizon that make

    $$ \sum_i (y_i - r_i)^2 + \rho \sum_i (v_i + \hat w - v^*_i)^2 $$

    small, of which the first is sent, through the inverse of the hysteresis. v* is what the reference needs (the
    model's inverse), w a disturbance of the input that a Kalman filter follows, and with it all that the model lacks.
    The range and the rate of commands are constraints of the quadratic program: exact for the first, for later ones
    by the slope that the hysteresis has along the reference. It is solved by DAQP (Arnstrom et al. 2022).
    """

    model: HystereticModel
    reach: ActuatorLimits
    horizon: int = eqx.field(static=True)  # samples
    weight: float = eqx.field(static=True)  # rho [outputs by inputs of the dynamics, squared]
    wander: float = eqx.field(static=True)  # of the disturbance in a sample [input of the dynamics]
    noise: float = eqx.field(static=True)  # of measurements
    width: float = eqx.field(static=True)  # over which the reference is smoothed [s]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Matrices, and what the reference needs.

        Raises InputError where the delay is no whole number of samples, or the range of commands has no end.
        """
        if not np.isfinite([self.reach.low, self.reach.high]).all():
            raise InputError("a range with two ends is needed.", field="reach")
        late = float(self.model.delay) / dt
        if abs(late - round(late)) > 1e-6:
            raise InputError(f"a delay of {late:g} samples; a whole number is needed.", field="delay")
        linear = sampled(self.model.dynamics, dt)
        free, forced = _prediction(linear, self.horizon)
        hessian = forced.T @ forced + self.weight * np.eye(self.horizon)
        rest = half_window(self.width, dt)  # after the end, until what is smoothed stands still
        ends = np.pad(np.asarray(reference, dtype=float), (0, rest + self.horizon + round(late) + 1), mode="edge")
        driven = self.model.driven(jnp.asarray(ends), dt, self.width)
        held = 0.5 * (driven + jnp.append(driven[1:], driven[-1]))  # over a sample
        command = respond(self.model.undo, held, dt)
        turned, ways = (jnp.abs(jnp.diff(x, prepend=0.0)) for x in (command, held))
        ends_of_range = respond(self.model.hysteresis, jnp.stack([self.reach.low, self.reach.high]), dt)
        mean = (ends_of_range[1] - ends_of_range[0]) / (self.reach.high - self.reach.low)
        moving = turned > 1e-9 * (self.reach.high - self.reach.low)
        steep = jnp.where(moving, ways / jnp.where(moving, turned, 1.0), mean)
        return _Horizon(
            jnp.asarray(ends),
            held,
            steep,
            jnp.asarray(free),
            jnp.asarray(forced),
            jnp.asarray(hessian),
            jnp.asarray(np.linalg.inv(hessian)),
            kalman(linear, self.wander, self.noise),
            self.model,
            self.reach,
            len(reference) + rest,
            round(late),
            self.weight,
            dt,
        )


class _State(NamedTuple):
    k: Array
    z: Array  # of the filter
    plays: Any  # of the hysteresis under the last command
    undone: Any  # of its inverse
    drives: Array  # inputs of the dynamics that are on their way, the next one first
    sent: Array  # the last command


class _Horizon(Regulator):
    reference: Float[Array, "m"]
    driven: Float[Array, "m"]  # v*
    steep: Float[Array, "m"]  # dv/du along the reference
    free: Float[Array, "h n+1"]  # outputs by the states
    forced: Float[Array, "h h"]  # outputs by the inputs
    hessian: Float[Array, "h h"]
    solved: Float[Array, "h h"]  # its inverse
    watch: KalmanFilter
    model: HystereticModel
    reach: ActuatorLimits
    count: int = eqx.field(static=True)
    late: int = eqx.field(static=True)  # samples from a command to what it does
    weight: float = eqx.field(static=True)
    dt: float = eqx.field(static=True)

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> _State:
        """The model at rest under the command, and disturbed so that it measures what it does."""
        sent = jnp.asarray(command, dtype=float)
        plays, line = self.model.hysteresis.step(self.model.hysteresis.initial(), Line(sent, sent))
        undone, _ = self.model.undo.step(self.model.undo.initial(), line)
        n = self.watch.B.shape[0] - 1
        still = jnp.linalg.solve(jnp.eye(n) - self.watch.A[:n, :n], self.watch.B[:n])
        drive = measured / jnp.sum(self.watch.C[:n] * still)
        z = jnp.append(still * drive, drive - line.end)
        return _State(jnp.zeros((), dtype=int), z, plays, undone, jnp.full(self.late, line.end), sent)

    def step(self, state: _State, measured: Float[Array, ""]) -> tuple[_State, Float[Array, ""]]:
        """A sample."""
        z = self.watch.corrected(state.z, measured)
        begun = z
        for drive in state.drives:
            begun = self.watch.predicted(begun, drive)
        at, h = jnp.minimum(state.k, self.count - 1) + self.late, self.forced.shape[0]
        ahead = jax.lax.dynamic_slice(self.reference, (at + 1,), (h,)) - self.free @ begun
        needed = jax.lax.dynamic_slice(self.driven, (at,), (h,)) - begun[-1]
        most = self.reach.slew * self.dt
        low, high = self.reach.low, self.reach.high
        places = jnp.stack([jnp.clip(state.sent - most, low, high), jnp.clip(state.sent + most, low, high), low, high])
        edges = jax.vmap(lambda u: self.model.hysteresis.step(state.plays, Line(u, u))[1].end)(places)
        ways = most * jax.lax.dynamic_slice(self.steep, (at + 1,), (h - 1,))
        drive = _first(self.hessian, self.solved, self.forced.T @ ahead + self.weight * needed, edges, ways)
        wanted = self.model.undo.step(state.undone, Line(drive, drive))[1].end
        sent = self.reach.within(wanted, state.sent, self.dt)
        plays, line = self.model.hysteresis.step(state.plays, Line(sent, sent))
        undone, _ = self.model.undo.step(state.undone, line)
        drives = jnp.append(state.drives, line.end)
        return _State(state.k + 1, self.watch.predicted(z, drives[0]), plays, undone, drives[1:], sent), sent


def _prediction(model: Sampled, horizon: int) -> tuple[Float[np.ndarray, "h n+1"], Float[np.ndarray, "h h"]]:
    """Outputs of the samples to come, by the states (and a constant disturbance) now and by the inputs to come."""
    powers = [np.linalg.matrix_power(model.A, i) for i in range(horizon + 1)]
    impulses = np.array([model.C @ power @ model.B for power in powers[:-1]])
    forced = np.array([[impulses[i - j] if j <= i else 0.0 for j in range(horizon)] for i in range(horizon)])
    free = np.column_stack([np.stack([model.C @ power for power in powers[1:]]), forced.sum(axis=1)])
    return free, forced


def _first(
    hessian: Array, free: Array, pull: Array, edges: Float[Array, "4"], ways: Float[Array, "h-1"]
) -> Float[Array, ""]:
    """The first input of the best ones; NaN where the solver finds none.

    `free` takes the pull to the best inputs without limits. `edges` are the lowest and the highest first input, and
    those of all; `ways` the largest differences from one to the next.
    """
    best = free @ pull
    inside = (best[0] >= edges[0]) & (best[0] <= edges[1]) & jnp.all((best >= edges[2]) & (best <= edges[3]))
    keeps = inside & jnp.all(jnp.abs(jnp.diff(best)) <= ways)

    def limited() -> Array:
        shape = jax.ShapeDtypeStruct((), pull.dtype)
        return jax.pure_callback(_solve, shape, hessian, pull, edges, ways, vmap_method="sequential")

    return jax.lax.cond(keeps, lambda: best[0], limited)


def _solve(hessian: Array, pull: Array, edges: Array, ways: Array) -> np.ndarray:
    P, q, ends, steps = (np.asarray(x, dtype=float) for x in (hessian, pull, edges, ways))
    h = len(q)
    scale = max(float(np.abs(ends).max()), 1e-300)  # tolerances of the solver are absolute
    high, low = np.full(h, ends[3]), np.full(h, ends[2])
    low[0], high[0] = ends[:2]
    upper, lower = (np.concatenate(x) / scale for x in ((high, steps), (low, -steps)))
    sense = np.zeros(2 * h - 1, dtype=np.int32)
    size = float(np.trace(P)) / h
    found, _, flag, _ = daqp.solve(P / size, -q / (size * scale), np.diff(np.eye(h), axis=0), upper, lower, sense)
    return np.asarray(found[0] * scale if flag == 1 else np.nan)
