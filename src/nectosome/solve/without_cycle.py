"""What a robot does instead of a cycle of a period: seen over more of its periods, as a sentence and numbers."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot, load_names
from nectosome.units import count, show_quantity

from .cycle_attempt import between, tolerances
from .integrate import Settings
from .results import diagnose_all
from .runge_kutta import rms
from .simulate import simulate
from .symmetry import Symmetry

_CYCLES, _SAMPLES = 16, 32  # periods that are looked at, and times of each
_AGREE = 4  # periods in which a cycle whose ends are apart must come back
_MOST = 8  # periods of a longer cycle
_REPEATS = 0.02  # of the gaps between successive periods: a smaller one after more periods is that of a cycle
_GROWS, _STEADILY = 1.02, 0.7  # a period, and share of the periods in which it does
_EVENLY = 0.05  # relative difference of a gap of several periods from so many gaps of one
_TOUCHES = 1e-3  # of its largest force: a contact
_VARIES = 0.02  # of it: a force that is not the same from period to period


class WithoutCycle(NamedTuple):
    """What a motion without a cycle does. `kind`: stops, closes, grows, drifts, repeats, or wanders."""

    kind: str
    periods: float  # number of periods after which it repeats itself; NaN without
    growth: float  # ratio of the gaps of successive periods, on the mean
    varies: str  # the load whose force changes most from period to period, on its part; "" of none
    touched: tuple[int, ...]  # in how many of the last periods that load is there, and of how many; () of none

    def words(self, period: float) -> str:
        """As a sentence; `period` [s]."""
        seconds = show_quantity(period, "time")
        shown = {
            "stops": f"A run of {_CYCLES} more periods stops before its end (divergence).",
            "closes": f"From period to period the motion still comes closer to a cycle, by {self.growth:.3g} each: "
            "it takes longer than was waited.",
            "grows": f"The motion grows from period to period, by {self.growth:.3g} each.",
            "drifts": "Each period adds as much to the motion as the one before: nothing stops what pushes it.",
            "repeats": f"The motion repeats itself after {self.periods:g} periods of {seconds}, not after one: take "
            f"--period {show_quantity(self.periods * period, 'time').replace(' ', '')}.",
            "wanders": f"The motion wanders: in {_CYCLES} periods of {seconds} it comes back after no whole number of "
            f"them up to {_MOST}.",
        }[self.kind]
        if self.touched:
            most = self.touched[1]
            return f"{shown} Contacts alternate: {self.varies} touches in {self.touched[0]} of {count(most, 'period')}."
        return f"{shown} The force of {self.varies} changes most." if self.varies else shown


def instead_of_cycle(robot: Robot, symmetry: Symmetry, x: State, period: float) -> WithoutCycle:
    """What the motion from a state at a time that is a whole number of periods does in the next ones [s]."""
    run = simulate(robot, _CYCLES * period, samples=_CYCLES * _SAMPLES + 1, initial=x, whole=True)
    if int(run.status) != Status.SOLVED:
        return WithoutCycle("stops", np.nan, np.nan, "", ())
    ends = jax.tree.map(lambda x: x[::_SAMPLES], run.value.state)
    gaps = np.asarray(remembered(_gaps, robot, symmetry, ends))  # after 1 to _MOST periods, of each start
    sizes = np.sqrt(np.mean(gaps**2, axis=2))
    one = sizes[0]
    growth = float((one[-1] / one[1]) ** (1 / (one.size - 2))) if one[1] > 0 and one[-1] > 0 else np.nan
    varies, touched = _contacts(robot, run.value.time, run.value.state)
    late = slice(-_MOST, None)
    longer = [np.mean(sizes[n][late]) / np.mean(one[late]) for n in range(1, _MOST)]
    back = next((n + 2 for n, share in enumerate(longer) if share < _REPEATS), 0)
    if back:
        return WithoutCycle("repeats", float(back), growth, varies, touched)
    if np.allclose(sizes[-1], _MOST * one, rtol=_EVENLY):
        return WithoutCycle("drifts", np.nan, growth, varies, touched)
    ways = np.diff(np.log(np.maximum(one, 1e-300)))
    closes, grows = (float(np.mean(sign * ways > 0)) > _STEADILY for sign in (-1, 1))
    kind = "closes" if closes and growth < 1 / _GROWS else "grows" if grows and growth > _GROWS else "wanders"
    return WithoutCycle(kind, np.nan, growth, varies, touched)


def periods_agree(robot: Robot, symmetry: Symmetry, found: Solution, period: float, settings: Settings) -> bool:
    """Whether a motion from the start of an orbit comes back in each of a few periods [s], within `residual_limit`.

    What decays or grows slowly goes on in one direction, noise of contacts does not.
    """
    states, limit = found.value.states, float(found.stats["residual_limit"])
    start = jax.tree.map(lambda x: x[0], states)
    run = simulate(
        robot,
        _AGREE * period,
        samples=_AGREE + 1,
        initial=start,
        method="implicit",
        rtol=float(settings.rtol),
        atol=float(settings.atol),
        whole=True,
    )
    if int(run.status) != Status.SOLVED:
        return False
    sizes = remembered(_sizes, robot, symmetry, states, run.value.state, settings)
    return bool(np.all(np.asarray(sizes) <= limit))


def _sizes(robot: Robot, symmetry: Symmetry, cycle: State, ends: State, settings: Settings) -> Float[jax.Array, "n"]:
    """Gaps from the start of a cycle to each of the ends, over the tolerance of a step.

    Nothing holds the phase of a crank that turns by itself: there each gap is that of one period. It has the noise of
    the period before, too, and counts half.
    """
    allowed = tolerances(robot, cycle, settings)
    starts = jax.tree.map(lambda x: jnp.broadcast_to(x[0], (ends.v.shape[0], *x.shape[1:])), cycle)
    if symmetry.crank is not None:
        starts = jax.tree.map(lambda a, b: jnp.concatenate([a[:1], b[:-1]]), starts, ends)
        allowed = 2 * allowed
    return jax.vmap(lambda a, b: rms(between(robot, symmetry, a, b) / allowed))(starts, ends)


def _gaps(robot: Robot, symmetry: Symmetry, ends: State) -> Float[jax.Array, "k n m"]:
    """Displacements from each start of a period to that some periods later, modulo the symmetry."""
    n = _CYCLES + 1 - _MOST
    here = jax.tree.map(lambda x: x[:n], ends)
    apart = jax.vmap(lambda a, b: between(robot, symmetry, a, b))
    later = [jax.tree.map(lambda x, k=k: x[k : k + n], ends) for k in range(1, _MOST + 1)]
    return jnp.stack([apart(here, there) for there in later])


def _contacts(robot: Robot, time: Any, states: State) -> tuple[str, tuple[int, ...]]:
    """The load whose largest force changes most from period to period, and how often it is there, if not always."""
    d = remembered(diagnose_all, robot, time, states)
    force = np.linalg.norm(np.asarray(d.load_force)[:-1], axis=-1)
    each = force.reshape(_CYCLES, _SAMPLES, *force.shape[1:]).max(axis=1)
    most = each.max(axis=0)
    change = np.ptp(each[-_MOST:], axis=0)
    i, k = np.unravel_index(int(np.argmax(change)), change.shape)
    if not change[i, k] > _VARIES * most[i, k]:
        return "", ()
    name = f"{load_names(robot)[i]} on {robot.tree.names[k]}".replace("_", " ")
    there = int(np.sum(each[:, i, k] > _TOUCHES * most[i, k]))
    return name, (there, _CYCLES) if there < _CYCLES else ()
