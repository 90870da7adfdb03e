"""Several devices as one rig: their channels by the name of the device, DEVICE.CHANNEL."""

from collections.abc import Callable, Iterable, Mapping, Sequence

from .rig import Rig, RigError


class Devices(Rig):
    """Devices by name, opened, measured, written and closed in their order; a fault of one leaves none out of a vent.

    Time is that of the first one's clock: a device in virtual time goes with none in real time.
    """

    def __init__(self, devices: Mapping[str, Rig], name: str = ""):
        self.devices = dict(devices)
        self.name = name or ", ".join(dict.fromkeys(device.name for device in devices.values()))
        self.commands = _joined({key: device.commands for key, device in devices.items()})
        self.measurements = _joined({key: device.measurements for key, device in devices.items()})

        self.commanded = False

    def open(self) -> None:
        """Connect them; those after one that fails are not opened."""
        tried = list[Rig]()
        try:
            for device in self.devices.values():
                tried.append(device)
                device.open()
        finally:
            self.commanded = any(device.commanded for device in tried)

    def connect(self) -> None:
        """Connect them to measure only."""
        for device in self.devices.values():
            device.connect()

    def measure(self) -> tuple[float, ...]:
        """The measurements of all, one device after the other."""
        return tuple(value for device in self.devices.values() for value in device.measure())

    def write(self, commands: Sequence[float]) -> None:
        """The commands of all; those after one that fails get none."""
        self.commanded, begin = True, 0
        for device in self.devices.values():
            end = begin + len(device.commands)
            if device.commands:
                device.write(commands[begin:end])
            begin = end

    def vent(self) -> None:
        """Take the power out of all, whatever becomes of the others."""
        _each(device.vent for device in self.devices.values())

    def close(self) -> None:
        """Release all, whatever becomes of the others."""
        _each(device.close for device in self.devices.values())

    def now(self) -> float:
        """Time of the first device."""
        return self._first.now()

    def wait(self, until: float) -> None:
        """Wait by the clock of the first device; the others follow it."""
        for device in self.devices.values():
            device.wait(until)

    @property
    def _first(self) -> Rig:
        return next(iter(self.devices.values()))


def _joined(channels: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    return {f"{key}.{name}": unit for key, own in channels.items() for name, unit in own.items()}


def _each(steps: Iterable[Callable[[], None]]) -> None:
    """Take all steps; then raise the faults of those that failed, as one, or the first error that is none."""
    errors = list[Exception]()
    for step in steps:
        try:
            step()
        except Exception as error:
            errors.append(error)
    for error in errors:
        if not isinstance(error, RigError):
            raise error
    if errors:
        raise RigError(" ".join(map(str, errors))) from errors[0]
