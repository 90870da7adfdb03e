"""Synthetic recordings as the paper's bench would make them: none were published."""

import jax.numpy as jnp
import numpy as np

from nectosome.drives import Chain, SlewLimit, respond
from nectosome.identification.hysteresis.fit import PressureTrial

from .plant import LIMIT, plant, waves

TRAIN = 0.25, 0.5, 0.75, 1.0, 1.25, 1.5  # Hz
HELD_OUT = 0.8, 0.9  # Hz
DT = 1e-3  # s
NOISE = 5e-5  # m, of the laser: assumed


def recorded(frequency: float, seed: int = 0, limit: bool = True, noise: float = NOISE) -> PressureTrial:
    """Command and displacement; with `limit` the valve follows commands at 3.8 bar/s at most."""
    command = waves(frequency, DT)
    actuator = Chain((SlewLimit(jnp.asarray(LIMIT)), plant())) if limit else plant()
    rng = np.random.default_rng([seed, round(100 * frequency)])
    displacement = np.asarray(respond(actuator, command, DT)) + noise * rng.normal(size=len(command))
    return PressureTrial(f"{frequency:g} Hz", DT, command, displacement)
