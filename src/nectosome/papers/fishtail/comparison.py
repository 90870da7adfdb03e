"""The controllers that are compared on the fishtail, and their gains."""

import tomllib
from collections.abc import Callable
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
    Learned,
    Predictive,
    hysteretic,
    learned,
    perturbed,
    pid_of,
    triangle,
    tune,
    varying,
)
from nectosome.drives import Chain, DeadTime, PrandtlIshlinskii, Saturation, Sensor, SlewLimit, TransferFunction
from nectosome.units.ranges import Ranges

from .plant import BAR, LARGEST, LIMIT, MM, dynamics, hysteresis
from .recordings import NOISE

DT = 5e-3  # s, between samples; a command acts one sample after its measurement
GAIN = BAR / MM
NAMES = "pid", "scheduled", "ff-pid", "ilc", "mpc"
VARIABLE = varying((4 * MM, 6 * MM, 8 * MM, 10 * MM, 12 * MM), (0.1, 0.2, 0.3, 0.4, 0.5), DT)  # Fig. 10
REACH = ActuatorLimits(*(jnp.asarray(x) for x in (-LARGEST, LARGEST, LIMIT)))  # what the valve can follow

_SPREAD = 0.05  # every number of a plant is drawn from within 5 % of the model's
_WIDTH = 0.08  # s, over which references are smoothed for feedforward
_LEARNING, _SHARE = 0.15, 0.5  # s, over which errors are smoothed to be learned; of them, that is believed
_HORIZON, _WEIGHT, _WANDER = 30, 0.1, 2e-5  # samples; of inputs against outputs; m a sample
_STRONGER, _LATER = 1.6, 2.0  # gain and delay of half of the loops that a schedule is tuned in, by the model's
_MILD = 0.5  # of the gains, for learning: noise is not to be learned
_TUNED = 100  # seed of plants that gains are tuned on
_RANGES = {"p": (1e-4, 0.2), "i": (0.05, 5.0), "d": (1e-5, 0.05), "filter": (5e-3, 0.2)}  # bar, mm, s
_START = {"p": 0.005, "i": 0.5, "d": 0.0005, "filter": 0.02}


class Learner(NamedTuple):
    """A controller for the first run along a reference, and what makes one for the next."""

    first: Feedforward

    def after(self, track: Any) -> Learned:
        """A controller that has learned from what was measured in a run."""
        return learned(self.first.pid, self.first.model, track, DT, _LEARNING, _SHARE)


class Gains(NamedTuple):
    """K_p, K_i, K_d in bar, mm and s, a row each; the derivative's filter [s]; the frequency of each row [Hz]."""

    rows: Float[Array, "m 3"]
    filtering: Float[Array, ""]
    frequencies: Float[Array, "m"] | None = None

    def pid(self, reach: ActuatorLimits, share: float = 1.0) -> PID:
        """With the first row, or a share of it."""
        return pid_of(share * self.rows[0] * GAIN, self.filtering, reach)


def kept() -> dict[str, Gains]:
    """What the paper prints, and what `tuned` has found."""
    text = files("nectosome.papers").joinpath("fishtail", "gains.toml").read_text(encoding="utf-8")
    return {
        name: Gains(
            jnp.asarray(one["gains"], dtype=float),
            jnp.asarray(one["filter"], dtype=float),
            jnp.asarray(one["frequencies"]) if "frequencies" in one else None,
        )
        for name, one in tomllib.loads(text).items()
    }


def tuned() -> dict[str, Gains]:
    """Gains for which plants that are drawn at random err least; those of the PID are the paper's."""
    lanes, known = plants(4, _TUNED), known_model()
    printed, frequencies = kept()["printed"], jnp.asarray((0.1, 0.2, 0.3, 0.4, 0.5))
    fed = _tuned(lambda x: Feedforward(_gains(x).pid(REACH), known, _WIDTH), 1, lanes)
    scheduled = _tuned(lambda x: _scheduled(_gains(x)._replace(frequencies=frequencies), REACH), 5, _harder(lanes))
    return {
        "printed": printed,
        "ff-pid": _gains(fed),
        "scheduled": _gains(scheduled)._replace(frequencies=frequencies),
    }


def controllers(
    gains: dict[str, Gains], known: HystereticModel, reach: ActuatorLimits = REACH
) -> dict[str, Controller | Learner]:
    """All that are compared; learning begins with the feedforward of a model, and milder gains."""
    return {
        "pid": gains["printed"].pid(reach),
        "scheduled": _scheduled(gains["scheduled"], reach),
        "ff-pid": Feedforward(gains["ff-pid"].pid(reach), known, _WIDTH),
        "ilc": Learner(Feedforward(gains["ff-pid"].pid(reach, _MILD), known, _WIDTH)),
        "mpc": Predictive(known, reach, _HORIZON, _WEIGHT, _WANDER, NOISE, _WIDTH),
    }


def known_model() -> HystereticModel:
    """What controllers take the tail for."""
    return hysteretic(hysteresis(), dynamics(), DT)


def actuator(tail: PrandtlIshlinskii | None = None, after: TransferFunction | None = None) -> Chain:
    """Valve and tail, from a command [Pa] to the end's displacement [m]; that of Table 1 unless told otherwise."""
    limits = Saturation(jnp.asarray(-LARGEST), jnp.asarray(LARGEST)), SlewLimit(jnp.asarray(LIMIT))
    return Chain((DeadTime(jnp.asarray(DT), 12), *limits, tail or hysteresis(), after or dynamics()))


def plants(count: int, seed: int = 0) -> BlockLoop:
    """Loops whose valve and tail are drawn at random, each with noise of its own."""
    late, within, *rest = actuator().blocks
    still = jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *x.shape)), (late, within))
    one = jnp.ones(count)
    noise = Sensor(NOISE * one, -one, one, seed + jnp.arange(count))
    drawn = (perturbed(block, _SPREAD, count, 100 * seed + k) for k, block in enumerate(rest))
    return BlockLoop(Chain((*still, *drawn)), noise, DT)


def _gains(x: Float[Array, "p"]) -> Gains:
    return Gains(x[:-1].reshape(-1, 3), x[-1])


def _scheduled(gains: Gains, reach: ActuatorLimits) -> GainSchedule:
    if gains.frequencies is None:
        raise ValueError("a schedule needs frequencies.")
    return GainSchedule(gains.frequencies, gains.rows * GAIN, gains.filtering, reach)


def _tuned(make: Callable[[Float[Array, "p"]], Controller], sets: int, lanes: BlockLoop) -> Float[Array, "p"]:
    """The numbers for which some plants err least, along two references."""
    *gains, last = _RANGES
    names = [f"{name}{k}" for k in range(sets) for name in gains] + [last]
    pick = [name.rstrip("0123456789") for name in names]
    low, high = np.array([_RANGES[name] for name in pick]).T
    start = np.array([_START[name] for name in pick])
    references = [VARIABLE, triangle(8 * MM, 0.05, 10.0, DT)]
    found = tune(make, Ranges(names, low, high, log=names), start, lanes, references)
    return jnp.asarray(found.values)


def _harder(lanes: BlockLoop) -> BlockLoop:
    """Half of the plants answer more, and later, than they should: what suits these too has margins."""
    late, strong = _late_and_strong(lanes)
    half = jnp.arange(late.shape[0]) % 2
    return eqx.tree_at(_late_and_strong, lanes, (late * _LATER**half, strong * (_STRONGER**half)[:, None]))


def _late_and_strong(lanes: Any) -> tuple[Array, Array]:
    """Dead time, and gain of the dynamics, of the plants."""
    return lanes.plant.blocks[0].delay, lanes.plant.blocks[-1].numerator
