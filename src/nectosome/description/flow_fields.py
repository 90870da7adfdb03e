"""What moves the water beside a constant current: currents that change over time or place, and waves."""

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from nectosome.description import fields
from nectosome.description.fields import Axis
from nectosome.description.flow_tables import AXES, read_flow_table
from nectosome.description.signals import SpeedSignal
from nectosome.io.schema.described import Described, increasing, wrong
from nectosome.io.schema.quantity import Quantity, QuantitySource

if TYPE_CHECKING:
    import numpy as np

_STEEP = 0.142  # height over length of the steepest waves in deep water (Michell 1893), times tanh(k h) (Miche 1944)
_NEWTON = 12  # steps, from Eckart's estimate
_CLOSE = 1e-9  # relative error of a frequency
LONGEST, SHORTEST = 0.5, 3.0
"""Frequencies of irregular waves over that of their peak."""


def wave_number(frequency: Any, gravity: Any, depth: Any, along: Any, xp: Any = math) -> Any:
    r"""Return the wave number k [rad/m] of linear waves, by Newton's method.

    $\omega = k U + \sqrt{g k \tanh k h}$ for the angular frequency [rad/s] as it is seen from the ground, the depth h
    of the water [m], None where it has no end, and the current U along the waves [m/s]. From Eckart's estimate
    $\omega^2 / g \sqrt{\coth(\omega^2 h / g)}$ the steps go towards the smaller root, that of waves whose energy comes
    along. The functions are those of `xp`. Where the current stops the waves the result is no root.
    """
    deep = frequency**2 / gravity
    k = deep if depth is None else deep / xp.sqrt(xp.tanh(deep * depth))
    for _ in range(_NEWTON):
        level = 1.0 if depth is None else xp.tanh(k * depth)
        own = xp.sqrt(gravity * k * level)
        slope = gravity * (level if depth is None else level + k * depth * (1 - level**2)) / (2 * own) + along
        k = k - (own + along * k - frequency) / slope
    return k


class FlowFieldDescription(Described):
    """A velocity of the water that depends on time or place; all of them, and the current, add up.

    `waves` need a surface.
    """

    kind: Any  # its name in a file, a literal of each class
    waves: ClassVar[bool] = False

    @property
    def once(self) -> str:
        """Return why it has no period; empty if it has one, or is steady."""
        return ""

    @property
    def moving(self) -> Mapping[str, float]:
        """Return the frequency [Hz] by which it repeats itself, by its field; nothing of what is steady."""
        return {}

    def check(self, gravity: float, depth: float | None, current: tuple[float, float, float]) -> None:
        """Raise the error of a field for what cannot be in water of this depth [m] with this current [m/s]."""

    def wavelength(self, gravity: float, depth: float | None, current: tuple[float, float, float]) -> float | None:
        """Return the length of its waves there [m], of the highest ones; None of what is no wave."""
        return None


class ChangingCurrentFlow(FlowFieldDescription):
    """A current that changes over time, the same everywhere."""

    kind: Literal["changing_current"]
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction of the current in the world: x, y, z or three numbers."""
    speed: SpeedSignal
    """Speed along the direction, any signal."""


class ShearedCurrentFlow(FlowFieldDescription):
    """A current that changes over height, by straight lines between given heights; beyond them it stays as it is."""

    kind: Literal["sheared_current"]
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction of the current in the world: x, y, z or three numbers."""
    heights: Annotated[tuple[fields.Coordinate, ...], Field(min_length=2), increasing("the heights must increase.")]
    """Heights z in the world, increasing."""
    speed: Annotated[tuple[fields.Speed, ...], Field(min_length=2)]
    """Speed along the direction at each height."""

    @model_validator(mode="after")
    def _has_a_speed_at_each_height(self) -> Self:
        if len(self.speed) != len(self.heights):
            n, m = len(self.speed), len(self.heights)
            raise wrong("speed", f"there are {n} speeds at {m} heights. Give one for each height.")
        return self


_PLACES = increasing("the places of a table must increase.")


class TableFlow(FlowFieldDescription):
    """A flow by a table over any of time, x, y and z, joined by smooth curves; beyond it, it is as at its edge."""

    kind: Literal["flow_table"]
    file: str | None = None
    """netCDF file that has the table, relative to this one: `u`, `v` and `w` over any of `time`, `x`, `y` and `z`."""
    times: Annotated[tuple[fields.Time, ...], _PLACES] = ()
    """Times of the table, from 0 on; none where it is steady."""
    x: Annotated[tuple[fields.Coordinate, ...], _PLACES] = ()
    """Its places along x in the world; none where it is the same along x."""
    y: Annotated[tuple[fields.Coordinate, ...], _PLACES] = ()
    """Its places along y."""
    z: Annotated[tuple[fields.Coordinate, ...], _PLACES] = ()
    """Its heights."""
    velocity: str = ""
    """Its velocities, packed, which its file had."""
    factor: fields.Number = 1.0
    """What the velocities are multiplied by."""

    @property
    def once(self) -> str:
        """Return why it has no period."""
        return "a table over time does not repeat itself. Take simulate, or a table without time." if self.times else ""

    @property
    def velocities(self) -> "np.ndarray":
        """Return the velocities in the world [m/s], over times, x, y, z (one each where there is no table) and axes."""
        import numpy as np

        from nectosome.geometry import unpacked

        shape = [max(1, len(getattr(self, name))) for name in AXES.values()]
        return np.frombuffer(unpacked(self.velocity), "<f8").reshape(*shape, 3)

    @model_validator(mode="after")
    def _has_velocities(self, info: ValidationInfo) -> Self:
        if self.file is not None:
            if self.velocity or any(getattr(self, name) for name in AXES.values()):
                raise wrong("file", "has times, places and velocities: leave those of this file out.")
            source = info.context if isinstance(info.context, QuantitySource) else QuantitySource()
            read = read_flow_table(source.folder / self.file, self.file)
            for name, value in {**read, "file": None}.items():
                object.__setattr__(self, name, value)  # from here on it holds its numbers, wherever the file is
        if not self.velocity:
            raise wrong("file", "is missing. Name the netCDF file that has the table.")
        for name in AXES.values():
            if len(getattr(self, name)) == 1:
                raise wrong(name, "is a single one. Give two at least, or none where all is the same along it.")
        try:
            whole = self.velocities
        except ValueError:
            raise wrong("velocity", "was cut or changed. Read the file again.") from None
        if not all(math.isfinite(x) for x in whole.ravel().tolist()):
            raise wrong("velocity", "has what is no number. Read the file again.")
        return self


class WavesFlow(FlowFieldDescription):
    """Waves of the surface by linear theory."""

    heading: fields.Angle = 0.0
    """Direction in which the waves run, counted from x to y."""
    ramp: fields.Duration = 0.0
    """Time in which the waves grow to their full size."""
    waves = True

    @property
    @abstractmethod
    def main_period(self) -> float:
        """Return the period of the highest waves [s]."""

    @property
    @abstractmethod
    def shortest_period(self) -> float:
        """Return that of the shortest."""

    @property
    @abstractmethod
    def most(self) -> tuple[str, float]:
        """Return the field of the height, and the height [m]."""

    def wavelength(self, gravity: float, depth: float | None, current: tuple[float, float, float]) -> float | None:
        """Return that of the main period [m]."""
        return 2 * math.pi / self._wave_number(self.main_period, gravity, depth, current)

    def check(self, gravity: float, depth: float | None, current: tuple[float, float, float]) -> None:
        """Raise the error of a field where waves break, or the current stops them."""
        if gravity == 0:
            raise wrong("kind", "waves need gravity, and there is none.")
        self._wave_number(self.shortest_period, gravity, depth, current)
        k = self._wave_number(self.main_period, gravity, depth, current)
        (field, height), length = self.most, 2 * math.pi / k
        limit = _STEEP * length * (1.0 if depth is None else math.tanh(k * depth))
        if height > limit:
            said = f"waves of {self.main_period:.3g} s are {length:.3g} m long here and break above {limit:.3g} m"
            raise wrong(field, f"{said}, so that {height:.3g} m is too high. Take lower or longer ones.")

    def _wave_number(
        self, period: float, gravity: float, depth: float | None, current: tuple[float, float, float]
    ) -> float:
        """Return that of waves of a period [rad/m]. Raises the error of a field where the current stops them."""
        frequency = 2 * math.pi / period
        along = current[0] * math.cos(self.heading) + current[1] * math.sin(self.heading)
        try:
            k = wave_number(frequency, gravity, depth, along)
            off = k * along + math.sqrt(gravity * k * (1.0 if depth is None else math.tanh(k * depth))) - frequency
        except (ValueError, ZeroDivisionError, OverflowError):  # the steps have left the waves
            k, off = math.nan, math.inf
        if not abs(off) < _CLOSE * frequency:
            why = f"a current of {-along:.3g} m/s against the waves stops those of {period:.3g} s."
            raise wrong("heading", f"{why} Take longer waves, a weaker current, or let both run one way.")
        return k


class RegularWavesFlow(WavesFlow):
    """Waves of one height and one period."""

    kind: Literal["regular_waves"]
    height: fields.NonNegativeLength
    """Height from trough to crest, twice the amplitude."""
    period: fields.PositiveTime
    """Time between two crests at a place that stays."""
    phase: fields.Angle = 0.0
    """Angle by which the waves are ahead at time 0; without it a crest is at the origin then."""

    @property
    def moving(self) -> Mapping[str, float]:
        """Return that of the waves."""
        return {"period": 1 / self.period} if self.height else {}

    @property
    def main_period(self) -> float:
        """Return the period."""
        return self.period

    @property
    def shortest_period(self) -> float:
        """Return the period."""
        return self.period

    @property
    def most(self) -> tuple[str, float]:
        """Return the height."""
        return "height", self.height


class IrregularWavesFlow(WavesFlow):
    """Waves of a spectrum: sines of many periods that run one way, with phases by chance."""

    kind: Literal["irregular_waves"]
    significant_height: fields.NonNegativeLength
    """Four times the standard deviation of the surface."""
    peak_period: fields.PositiveTime
    """Period of the peak of the spectrum, at a place that stays."""
    peakedness: Annotated[float, Quantity("number", minimum=1, maximum=10)] = 3.3
    """How much higher the peak is than that of Bretschneider's spectrum, 1 to 10: 3.3 is the mean of JONSWAP, 1 is
    Bretschneider's itself."""
    count: Annotated[int, Field(ge=10, le=500)] = 60
    """Number of sines, between half and three times the frequency of the peak."""
    seed: Annotated[int, Field(ge=0, le=1_000_000)] = 1
    """Seed of the phases, and of the frequencies within their equal intervals."""

    @property
    def once(self) -> str:
        """Return why they have no period."""
        return "irregular waves do not repeat themselves. Take simulate, or regular waves."

    @property
    def main_period(self) -> float:
        """Return that of the peak."""
        return self.peak_period

    @property
    def shortest_period(self) -> float:
        """Return that of the last sine."""
        return self.peak_period / SHORTEST

    @property
    def most(self) -> tuple[str, float]:
        """Return the significant height."""
        return "significant_height", self.significant_height
