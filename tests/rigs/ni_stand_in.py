"""What stands in for `nidaqmx` and a card: calls must fit the signatures of the installed library."""

import functools
import inspect
import math
import time
from collections.abc import Callable
from types import SimpleNamespace

import nidaqmx
import nidaqmx.constants
import nidaqmx.errors
import nidaqmx.types
from nidaqmx.system.watchdog import WatchdogTask
from nidaqmx.task.collections import AIChannelCollection, AOChannelCollection


def like(real: Callable) -> Callable:
    """Refuses a call that the real one would refuse, and counts it among those that were made."""

    def made(stand_in: Callable) -> Callable:
        @functools.wraps(stand_in)
        def call(self, *args, **kwargs):
            bound = inspect.signature(real).bind(self, *args, **kwargs)
            self.card.called.append(real.__qualname__)
            self.card.may_fail(real.__qualname__)
            bound.apply_defaults()
            return stand_in(self, bound.arguments)

        return call

    return made


class Card:
    """Volts by channel; the laser on Dev1/ai0 sees what the first valve moves, with a time constant of 20 ms.

    `fails` names calls that the driver refuses, `unplugged` refuses all; `volts_seen` takes the place of the laser's
    volts, `inputs` has those of other channels. `powered` tells whether volts were ever put on an output.
    """

    def __init__(self, valve: str = "Dev1/ao0", rest: float = 5.0, seen: float = 2.5):
        self.volts: dict[str, float] = {}
        self.inputs: dict[str, float] = {}
        self.powered = False
        self.called: list[str] = []
        self.tasks: list[Task | Watchdog] = []
        self.fails: set[str] = set()
        self.unplugged, self.volts_seen = False, None
        self.watchdog: Watchdog | None = None
        self._valve, self._rest, self._seen, self._since = valve, rest, seen, time.monotonic()

    def may_fail(self, call: str):
        if self.unplugged or call in self.fails:
            raise nidaqmx.errors.DaqError("Device identifier is invalid, or the\ndevice has been removed.", -200220)

    def laser(self) -> float:
        now = time.monotonic()
        passed, self._since = now - self._since, now
        target = 2.5 + 0.5 * (self.volts.get(self._valve, self._rest) - self._rest)
        self._seen += (target - self._seen) * -math.expm1(-passed / 0.02)
        return self._seen if self.volts_seen is None else self.volts_seen

    def module(self) -> SimpleNamespace:
        """As `import nidaqmx` gives it."""
        return SimpleNamespace(
            Task=functools.partial(Task, self),
            errors=nidaqmx.errors,
            constants=nidaqmx.constants,
            types=nidaqmx.types,
            system=SimpleNamespace(watchdog=SimpleNamespace(WatchdogTask=functools.partial(Watchdog, self))),
        )


class Task:
    def __init__(self, card: Card, *args, **kwargs):
        inspect.signature(nidaqmx.Task).bind(*args, **kwargs)
        self.card, self.closed, self.started = card, False, False
        card.may_fail("Task.__init__")
        card.tasks.append(self)
        self.outputs: list[tuple[str, float, float]] = []
        self.inputs: list[str] = []
        self.ao_channels, self.ai_channels = Outputs(self), Inputs(self)

    @like(nidaqmx.Task.start)
    def start(self, _):
        self.started = True

    @like(nidaqmx.Task.read)
    def read(self, _) -> float | list[float]:
        """As the library: a list where there are several channels, else a number."""
        seen = [self.card.laser() if channel == "Dev1/ai0" else self.card.inputs[channel] for channel in self.inputs]
        return seen if len(seen) > 1 else seen[0]

    @like(nidaqmx.Task.write)
    def write(self, given):
        if self.card.watchdog is not None and self.card.watchdog.expired:
            raise nidaqmx.errors.DaqError("Write cannot be performed, because the watchdog timer has expired.", -200678)
        ((channel, low, high),) = self.outputs
        if not low <= given["data"] <= high:
            raise nidaqmx.errors.DaqError("Requested value is not supported for this property.", -200077)
        self.card.volts[channel], self.card.powered = given["data"], True

    @like(nidaqmx.Task.close)
    def close(self, _):
        assert not self.closed
        self.closed = True


class Outputs:
    def __init__(self, task: Task):
        self.task, self.card = task, task.card

    @like(AOChannelCollection.add_ao_voltage_chan)
    def add_ao_voltage_chan(self, given):
        self.task.outputs.append((given["physical_channel"], given["min_val"], given["max_val"]))


class Inputs:
    def __init__(self, task: Task):
        self.task, self.card = task, task.card

    @like(AIChannelCollection.add_ai_voltage_chan)
    def add_ai_voltage_chan(self, given):
        assert given["min_val"] < given["max_val"]
        self.task.inputs.append(given["physical_channel"])


class Watchdog:
    def __init__(self, card: Card, *args, **kwargs):
        given = inspect.signature(WatchdogTask).bind(*args, **kwargs).arguments
        self.card, self.timeout, self.closed = card, given["timeout"], False
        self._locked, self.states, self.last = card.watchdog is not None and card.watchdog.expired, [], math.inf
        card.tasks.append(self)
        card.watchdog = self

    @property
    def expired(self) -> bool:
        """Outputs go to their states when the time is over."""
        if not self._locked and time.monotonic() - self.last > self.timeout:
            self._locked = True
            self.card.volts |= {state.physical_channel: state.expiration_state for state in self.states}
        return self._locked

    @like(WatchdogTask.cfg_watchdog_ao_expir_states)
    def cfg_watchdog_ao_expir_states(self, given):
        self.states = given["expiration_states"]
        assert all(state.output_type is nidaqmx.constants.WatchdogAOExpirState.VOLTAGE for state in self.states)

    @like(WatchdogTask.start)
    def start(self, _):
        self.last = time.monotonic()

    @like(WatchdogTask.reset_timer)
    def reset_timer(self, _):
        if self.expired:
            raise nidaqmx.errors.DaqError("Watchdog timer cannot be reset, because it has expired.", -200644)
        self.last = time.monotonic()

    @like(WatchdogTask.clear_expiration)
    def clear_expiration(self, _):
        self._locked, self.last = False, time.monotonic()

    @like(WatchdogTask.close)
    def close(self, _):
        assert not self.closed
        self.closed = True
