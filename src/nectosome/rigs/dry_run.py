"""An experiment on a model, before the rig moves: what its guards would stop there does not begin."""

import numpy as np
from jaxtyping import Float

from nectosome.controllers import BlockLoop, Controller, BlockLoopRecord
from nectosome.units import InputError

from .guards import Guards
from .limits import Limits
from .rig import Rig


def rehearse(
    loop: BlockLoop, controller: Controller, reference: Float[np.ndarray, "n"], limits: Limits, rig: Rig
) -> BlockLoopRecord:
    """What the model does under the controller. Raises InputError where the guards would end it, with their reason.

    A loop that swings, gains that are far too high, a reference out of reach are found so; not what the model lacks.
    """
    track = loop.run(controller, reference)
    guards, before = Guards(limits, rig, loop.dt, len(reference)), 0.0
    for k, (wanted, output, command) in enumerate(
        zip(reference.tolist(), np.asarray(track.measured).tolist(), np.asarray(track.command).tolist(), strict=True)
    ):
        why = guards.sample(0.0, wanted, output, before) or guards.wanted(command)
        if why:
            raise InputError(f"on the model it would end at {k * loop.dt:.3f} s, nothing was moved: {why}")
        before = guards.allowed(command, before, loop.dt)
    return track
