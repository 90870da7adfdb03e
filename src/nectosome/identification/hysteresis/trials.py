"""Recordings of a soft actuator, as they are fitted, and the dead time that they show."""

from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from ..fits.separable import Separable

_LEAST = 50  # samples
DEAD_TIME = "dead_time"
LATE_SAMPLES = 400  # that a dead time may be at most
_LONGEST, _SHARE = 0.5, 0.1  # at most: s, of the shortest recording
_SURE = 5.0  # standard errors
_MOST = 0.999  # correlation of neighbouring residuals that counts


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


def longest_dead_time(trials: Sequence[PressureTrial]) -> float:
    """Largest dead time that is looked for [s]."""
    return min(_LONGEST, *(min(LATE_SAMPLES, _SHARE * len(trial.pressure)) * trial.dt for trial in trials))


def missed_dead_time(
    problem: Separable, theta: Float[np.ndarray, "n"], place: int, error: float, fixed: Collection[str]
) -> list[str]:
    r"""Warning that a problem with a dead time, at a place of theta, fits better; [] where it hardly does.

    `theta` is the best one for a dead time of 0, `error` the standard error of its residuals [m]. To first order a dead
    time lowers their sum of squares by $(r^T q)^2 / q^T q$, with the residuals r and that part of their derivatives by
    it, q, that no other parameter has. Only where that is significant it is fitted. Residuals of correlation c with
    their neighbours count as those of an error $\sqrt{(1 + c)/(1 - c)}$ times as large.
    """
    at = problem.projected()
    u = at.places(theta)
    r, by = at.at(u[None])[0], at.derivatives(u)
    q, others = by[:, place], np.delete(by, place, axis=1)
    q = q - others @ np.linalg.lstsq(others, q)[0]
    alike = np.clip(r[1:] @ r[:-1] / (r @ r), 0.0, _MOST) if r.any() else 0.0
    error = error * np.sqrt((1 + alike) / (1 - alike))
    if -float(r @ q) <= _SURE * error * np.linalg.norm(q):
        return []
    late = problem.fit(theta, fixed)
    if late.chi2 >= float(r @ r) - (_SURE * error) ** 2:
        return []
    noise, before = (1e3 * float(np.sqrt(chi2 / len(r))) for chi2 in (late.chi2, r @ r))
    better = f"a dead time of {1e3 * late.theta[place]:.3g} ms would fit better"
    residuals = f"residuals of {noise:.4g} mm, not {before:.4g} mm"
    slow = f"{problem.ranges.names[0]} would be {late.theta[0]:.4g} rad/s, not {theta[0]:.4g} rad/s"
    return [f"{better} ({residuals}), and {slow}: fit it too (--dead-time)"]
