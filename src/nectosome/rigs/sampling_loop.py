"""The sampling loop of an experiment, from its first sample to its last, and the ramp to commands of 0."""

from collections.abc import Callable
from dataclasses import dataclass, field

from .guards import Guards, slewed
from .laws import Law
from .log import RunLog
from .rig import Rig

Progress = Callable[[float], bool | None]
_PULSE = 0.1  # [s] between calls of it at most: who ends a long run with it does not wait


class AbortError(Exception):
    """A guard ends the experiment."""


class CancelledError(Exception):
    """The caller's progress function ends the experiment."""


@dataclass
class SamplingLoop:
    """The samples of one run, and the ramp back to 0; `check`, called between them, raises to end them."""

    rig: Rig
    law: Law
    guards: Guards
    log: RunLog
    check: Callable[[], None]
    progress: Progress | None = None
    _commands: tuple[float, ...] = field(default=(), init=False)  # the last ones that the rig has taken
    _written: float = field(default=0.0, init=False)  # their time
    _begun: bool = field(default=False, init=False)

    def __post_init__(self):
        self._commands = (0.0,) * len(self.rig.commands)

    def samples(self) -> None:
        """Open the rig and take all samples, at multiples of dt."""
        self.rig.open()
        start = self.rig.now()
        self._written = start - self.guards.dt  # the commands were 0 before
        count = self.law.count
        references = {name: signal.tolist() for name, signal in self.law.references.items()}
        pulse = max(min(count // 100, int(_PULSE / self.guards.dt)), 1)
        for k in range(count):
            self.check()
            self.rig.wait(start + k * self.guards.dt)
            time = self.rig.now() - start
            wanted = {name: signal[k] for name, signal in references.items()}
            self._sample(k, time, wanted, time - k * self.guards.dt)
            if self.progress is not None and k % pulse == 0 and self.progress((k + 1) / count) is False:
                raise CancelledError

    def _sample(self, k: int, time: float, references: dict[str, float], late: float) -> None:
        measured = self.rig.measure()
        why = self.guards.sample(late, references, measured, self._commands)
        if not why:
            if not self._begun:
                self.law.begin(measured)
                self._begun = True
            commands = self.law.commands(k, measured)
            why = self.guards.not_finite(commands)
            if not why:
                self._write(commands)
        try:
            self.log.append(time, *measured, *self._commands, *references.values(), late)
        finally:
            if why:
                raise AbortError(f"at {time:.3f} s {why}")

    def _write(self, unlimited: tuple[float, ...]) -> None:
        now = self.rig.now()
        commands = self.guards.allowed(unlimited, self._commands, now - self._written)
        self.rig.write(commands)
        self._commands, self._written = commands, now

    def ramp(self) -> None:
        """Ramp to commands of 0 at the slew limit of each.

        It begins with the last commands that the rig has taken; those whose writing failed may be in effect or not.
        """
        most = [self.guards.limits.commands[name].slew * self.guards.dt for name in self.rig.commands]
        steps = [self._commands] if any(self._commands) else []
        while steps and any(steps[-1]):
            steps.append(tuple(slewed(0.0, last, rate) for last, rate in zip(steps[-1], most, strict=True)))
        for commands in steps:
            self.check()
            self.rig.wait(self.rig.now() + self.guards.dt)
            self.rig.write(commands)
