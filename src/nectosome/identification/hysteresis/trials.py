"""Recordings of a soft actuator, as they are fitted."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

_LEAST = 50  # samples


class PressureTrial(NamedTuple):
    """Pressure and displacement at even times, from rest; between the samples both are straight."""

    name: str
    dt: float  # [s]
    pressure: Float[np.ndarray, "n"]  # [Pa]
    displacement: Float[np.ndarray, "n"]  # [m]
    notes: tuple[str, ...] = ()  # what was done to the recording
    file: str = ""
    held: bool = False  # pressures are means of two commands, each of which was held from its sample to the next

    def joined(self, slew: float = np.inf) -> Float[np.ndarray, "n"]:
        r"""Pressures [Pa] that straight lines join; those of commands that are held stand for steps.

        A sine of frequency w is multiplied by $\mathrm{sinc}(w \Delta t/2)$ where it is held in steps, and by
        $\cos(w \Delta t/2)\, \mathrm{sinc}^2(w \Delta t/2)$ in lines through means of two: to second order a sixth of
        the second difference is missing. A valve of limited rate s, `slew` [Pa/s], reaches a command that changes by d
        after a part of the sample, $|d|/(s \Delta t)$: on the mean $d\, |d|/(2 s \Delta t)$ are missing.
        """
        if not self.held:
            return self.pressure
        change = np.gradient(self.pressure)
        bend = np.pad(np.diff(self.pressure, 2), 1)
        return self.pressure - bend / 6 - change * np.abs(change) / (2 * np.maximum(slew * self.dt, np.abs(change)))


def check_trial(trial: PressureTrial) -> None:
    """Raise InputError where a recording is not what it should be."""
    count = len(trial.pressure)
    if count != len(trial.displacement):
        raise InputError(f"{count} pressures and {len(trial.displacement)} displacements.", field=trial.name)
    if count < _LEAST:
        raise InputError(f"{count} samples are too few; at least {_LEAST} are needed.", field=trial.name)
    if not trial.dt > 0:
        raise InputError(f"the samples are {trial.dt:g} s apart; it must be more than 0 s.", field=trial.name)
    for what, values in (("pressure", trial.pressure), ("displacement", trial.displacement)):
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"the {what} is NaN or infinite at sample {k + 1}.", field=trial.name)
        if np.ptp(values) == 0:
            raise InputError(f"the {what} is {values[0]:g} throughout: it identifies nothing.", field=trial.name)
