"""The controllers that are compared on the fishtail, and their gains."""

import tomllib
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.controllers import (
    PID,
    ActuatorLimits,
    BlockLoop,
    Controller,
    Feedforward,
    GainSchedule,
    HystereticModel,
    Learner,
    Predictive,
    hysteretic,
    perturbed,
    pid_of,
    tune,
    wave,
)
from nectosome.controllers.hysteretic_model import SMOOTHING
from nectosome.drives import Chain, DeadTime, Saturation, Sensor, SlewLimit, Stiction
from nectosome.units.ranges import Ranges

from .plant import BAR, LARGEST, LIMIT, MM, NOISE, dynamics, hysteresis

DT = 5e-3  # s, between samples; a command acts one sample after its measurement
GAIN = BAR / MM
WORDS = {
    "pid": "PID of the paper",
    "scheduled": "PID, gains by frequency",
    "ff-pid": "PID beside the inverse",
    "ilc": "PID beside a learned feedforward",
    "mpc": "predictive",
}
NAMES = tuple(WORDS)
VARIABLE = wave(
    "varying", None, DT, amplitude=(4 * MM, 6 * MM, 8 * MM, 10 * MM, 12 * MM), frequency=(0.1, 0.2, 0.3, 0.4, 0.5)
)  # Fig. 10
LIMITS = ActuatorLimits(*(jnp.asarray(x) for x in (-LARGEST, LARGEST, LIMIT)))  # of the valve

_SPREAD = 0.05  # every number of a plant is drawn from within 5 % of the model's
_LEARNING, _SHARE = 0.15, 0.5  # s, over which errors are smoothed; gamma of learning
_HORIZON, _WEIGHT, _WANDER = 30, 0.1, 2e-5  # samples; of inputs against outputs; m a sample
_GAIN, _DELAY = 1.6, 2.0  # relative gain and delay of half of the loops in which a schedule is tuned
_MILD = 0.5  # of the gains, for learning, which would learn noise
_TUNED = 100  # seed of the perturbed plants for which gains are tuned
_RANGES = {"p": (1e-4, 0.2), "i": (0.05, 5.0), "d": (1e-5, 0.05), "filter": (5e-3, 0.2)}  # bar, mm, s
_START = {"p": 0.005, "i": 0.5, "d": 0.0005, "filter": 0.02}


class Gains(NamedTuple):
    """K_p, K_i, K_d in bar, mm and s, a row each; the derivative's filter [s]; the frequency of each row [Hz]."""

    rows: Float[Array, "m 3"]
    filtering: Float[Array, ""]
    frequencies: Float[Array, "m"] | None = None

    def pid(self, limits: ActuatorLimits, share: float = 1.0) -> PID:
        """With the first row, or a share of it."""
        return pid_of(share * self.rows[0] * GAIN, self.filtering, limits)


def kept() -> dict[str, Gains]:
    """Gains that the paper prints, and those that `tuned` found."""
    text = files("nectosome_studies").joinpath("fishtail", "gains.toml").read_text(encoding="utf-8")
    numbers = {
        name: {key: jnp.asarray(x, dtype=float) for key, x in one.items()} for name, one in tomllib.loads(text).items()
    }
    return {name: Gains(one["gains"], one["filter"], one.get("frequencies")) for name, one in numbers.items()}


def tuned() -> dict[str, Gains]:
    """Gains with the least errors over perturbed plants; those of the PID are the paper's."""
    loops, known = plants(4, _TUNED), known_model()
    printed, frequencies = kept()["printed"], jnp.asarray((0.1, 0.2, 0.3, 0.4, 0.5))
    fed = _tuned(lambda x: Feedforward(_gains(x).pid(LIMITS), known, SMOOTHING), 1, loops)
    scheduled = _tuned(lambda x: _scheduled(_gains(x)._replace(frequencies=frequencies), LIMITS), 5, _harder(loops))
    return {
        "printed": printed,
        "ff-pid": _gains(fed),
        "scheduled": _gains(scheduled)._replace(frequencies=frequencies),
    }


def controllers(
    gains: dict[str, Gains], known: HystereticModel, limits: ActuatorLimits = LIMITS
) -> dict[str, Controller]:
    """The controllers that are compared; learning starts from the feedforward of a model, with lower gains."""
    return {
        "pid": gains["printed"].pid(limits),
        "scheduled": _scheduled(gains["scheduled"], limits),
        "ff-pid": Feedforward(gains["ff-pid"].pid(limits), known, SMOOTHING),
        "ilc": Learner(Feedforward(gains["ff-pid"].pid(limits, _MILD), known, SMOOTHING), _LEARNING, _SHARE),
        "mpc": Predictive(known, limits, _HORIZON, _WEIGHT, _WANDER, NOISE, SMOOTHING),
    }


def known_model() -> HystereticModel:
    """The model of the tail that controllers have."""
    return hysteretic(hysteresis(), dynamics(), DT)


def actuator() -> Chain:
    """Valve and tail of Table 1, from a command [Pa] to the displacement of its end [m]."""
    limits = Saturation(jnp.asarray(-LARGEST), jnp.asarray(LARGEST)), SlewLimit(jnp.asarray(LIMIT))
    return Chain((DeadTime(jnp.asarray(DT), 12), *limits, hysteresis(), dynamics()))


def plants(count: int, seed: int = 0) -> BlockLoop:
    """Loops with perturbed valves and tails, each with its own noise."""
    delay, within, *rest = actuator().blocks
    same = jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), (delay, within))
    one = jnp.ones(count)
    noise = Sensor(NOISE * one, -one, one, seed + jnp.arange(count))
    drawn = (perturbed(block, _SPREAD, count, 100 * seed + k) for k, block in enumerate(rest))
    return BlockLoop(Chain((*same, *drawn)), noise, DT)


def dead_bands(widths: Sequence[float]) -> BlockLoop:
    """Loops of the model itself, without noise, whose valves have dead bands of so much to either side [Pa]."""
    count = len(widths)
    blocks = jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), actuator().blocks)
    valve = Stiction(2 * jnp.asarray(widths), jnp.zeros(count))
    one = jnp.ones(count)
    exact = Sensor(0.0 * one, -one, one, jnp.zeros(count, dtype=int))
    return BlockLoop(Chain((*blocks[:-2], valve, *blocks[-2:])), exact, DT)


def _gains(x: Float[Array, "p"]) -> Gains:
    return Gains(x[:-1].reshape(-1, 3), x[-1])


def _scheduled(gains: Gains, limits: ActuatorLimits) -> GainSchedule:
    if gains.frequencies is None:
        raise ValueError("a schedule needs frequencies.")
    return GainSchedule(gains.frequencies, gains.rows * GAIN, gains.filtering, limits)


def _tuned(make: Callable[[Float[Array, "p"]], Controller], sets: int, loops: BlockLoop) -> Float[Array, "p"]:
    """Parameters with the least errors over perturbed plants, along two references."""
    *gains, last = _RANGES
    names = [f"{name}{k}" for k in range(sets) for name in gains] + [last]
    pick = [name.rstrip("0123456789") for name in names]
    low, high = np.array([_RANGES[name] for name in pick]).T
    start = np.array([_START[name] for name in pick])
    references = [VARIABLE, wave("triangle", 10.0, DT, amplitude=8 * MM, frequency=0.05)]
    found = tune(make, Ranges(names, low, high, log=names), start, loops, references)
    return jnp.asarray(found.values)


def _harder(loops: BlockLoop) -> BlockLoop:
    """Half of the plants get a higher gain and a longer delay, so that tuned loops have margins."""
    delay, numerator = _delay_and_gain(loops)
    half = jnp.arange(delay.shape[0]) % 2
    return eqx.tree_at(_delay_and_gain, loops, (delay * _DELAY**half, numerator * (_GAIN**half)[:, None]))


def _delay_and_gain(loops: Any) -> tuple[Array, Array]:
    """Dead times, and numerators of the dynamics, of the plants."""
    return loops.plant.blocks[0].delay, loops.plant.blocks[-1].numerator
