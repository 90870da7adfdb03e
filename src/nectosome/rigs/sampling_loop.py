"""What happens from the first sample of an experiment to the last, and the way back to a command of 0."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.controllers import Regulator

from .compiled_step import CompiledStep
from .guards import Guards
from .limits import slewed
from .log import RunLog
from .rig import Rig

Progress = Callable[[float], bool | None]


class AbortError(Exception):
    """A guard ends the experiment."""


class CancelledError(Exception):
    """Whoever watches the progress ends the experiment."""


class ControlLaw:
    """A regulator with all that its samples need compiled: nothing of this may happen in one."""

    def __init__(self, regulator: Regulator):
        self._regulator = regulator
        self._steps = CompiledStep(_step, regulator, _initial(regulator, np.asarray(0.0)))
        for _ in range(2):  # what a step returns may be of other types than what it begins with
            self._steps(np.asarray(0.0)).item()

    def begin(self, measured: float) -> None:
        """From a command of 0."""
        self._steps.start(_initial(self._regulator, np.asarray(measured)))

    def wanted(self, measured: float) -> float:
        """The command that follows from a measurement."""
        return self._steps(np.asarray(measured)).item()


@eqx.filter_jit
def _initial(regulator: Regulator, measured: ArrayLike) -> Any:
    return regulator.initial(jnp.zeros(()), measured)


def _step(regulator: Regulator, state: Any, measured: ArrayLike) -> tuple[Any, Array]:
    return regulator.step(state, jnp.asarray(measured))


class SamplingLoop:
    """The samples of one run, and the way back to 0; `check`, called between them, raises if they are to end."""

    def __init__(
        self,
        rig: Rig,
        law: ControlLaw,
        reference: Float[np.ndarray, "n"],
        guards: Guards,
        log: RunLog,
        check: Callable[[], None],
        progress: Progress | None = None,
    ):
        self._rig, self._law, self._reference = rig, law, reference
        self._guards, self._log, self._check, self._progress = guards, log, check, progress
        self._dt, self._slew = guards.dt, guards.limits.slew
        self._command = 0.0  # that the rig has taken
        self._written = 0.0  # when
        self._begun = False

    def samples(self) -> None:
        """Open the rig, and sample after sample at multiples of dt."""
        self._rig.open()
        start = self._rig.now()
        self._written = start - self._dt  # 0 stands for longer
        count = len(self._reference)
        pulse = max(count // 100, 1)
        for k, reference in enumerate(self._reference.tolist()):
            self._check()
            self._rig.wait(start + k * self._dt)
            time = self._rig.now() - start
            self._sample(time, reference, time - k * self._dt)
            if self._progress is not None and k % pulse == 0 and self._progress((k + 1) / count) is False:
                raise CancelledError

    def _sample(self, time: float, reference: float, late: float) -> None:
        measured = self._rig.read()
        why = self._guards.sample(late, reference, measured, self._command)
        if not why:
            if not self._begun:
                self._law.begin(measured)
                self._begun = True
            wanted = self._law.wanted(measured)
            why = self._guards.wanted(wanted)
            if not why:
                self._write(wanted)
        try:
            self._log.append(time, reference, measured, self._command, late)
        finally:
            if why:
                raise AbortError(f"at {time:.3f} s {why}")

    def _write(self, wanted: float) -> None:
        now = self._rig.now()
        command = self._guards.allowed(wanted, self._command, now - self._written)
        self._rig.write(command)
        self._command, self._written = command, now

    def ramp(self) -> None:
        """To a command of 0, as fast as is allowed.

        It begins with the last command that the rig is known to have taken: one that failed may stand or not.
        """
        way = [self._command] if self._command else []
        while way and way[-1]:
            way.append(slewed(0.0, way[-1], self._slew * self._dt))
        for command in way:
            self._check()
            self._rig.wait(self._rig.now() + self._dt)
            self._rig.write(command)
