"""The fishtail's bench, or that of an actuator like it: rehearsals on the model, and experiments on a rig."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.controllers import (
    ActuatorLimits,
    BlockLoop,
    Controller,
    HystereticModel,
    BlockLoopRecord,
    check_reachable,
    hysteretic,
    margins,
    open_loop,
)
from nectosome.drives import Sensor
from nectosome.identification.fits.errors import range_errors
from nectosome.identification.hysteresis.files import saved_model
from nectosome.measure import read
from nectosome.rigs import Experiment, Limits, Rig, RigRun, SimulatedRig, rehearse
from nectosome.units import InputError

from .comparison import DT, Gains, Learner, actuator, controllers, kept
from .plant import BAR, LARGEST, LIMIT, MM, dynamics, hysteresis
from .recordings import NOISE

if TYPE_CHECKING:
    import xarray as xr

LIMITS = Limits(-LARGEST, LARGEST, LIMIT, -25 * MM, 25 * MM, 5 * MM)  # range of the laser: 55 to 105 mm

_LITTLE, _MUCH = 0.1, 0.5  # of the range of commands, at which the loop must not swing by itself


class BenchRun(NamedTuple):
    """A run, and its errors [percent of the reference's range]: of what was measured, and on a model of what was.

    None where there is nothing to compare.
    """

    run: RigRun
    measured: tuple[float, float] | None
    true: tuple[float, float] | None


@dataclass(frozen=True)
class Bench:
    """A model, which controllers know and rehearsals are made on, and limits of the rig."""

    known: HystereticModel
    loop: BlockLoop
    ways: dict[str, Controller | Learner]
    reach: ActuatorLimits
    limits: Limits
    rig: Rig | None  # a simulated one where there is none

    @classmethod
    def of(
        cls,
        model: "xr.Dataset | None" = None,
        gains: Sequence[float] | None = None,
        limits: Limits = LIMITS,
        rig: Rig | None = None,
    ) -> "Bench":
        """The paper's actuator and gains, or an identified one, and other gains (bar, mm, s).

        Raises InputError for data that hold no model, or one whose hysteresis has no inverse.
        """
        found = None if model is None else saved_model(model)
        parts = (hysteresis(), dynamics()) if found is None else (found.hysteresis(), found.dynamics())
        known, chosen = hysteretic(*parts, DT), kept()
        if gains is not None:
            rows = jnp.asarray([gains], dtype=float)
            chosen |= {name: Gains(rows, chosen[name].filtering) for name in ("printed", "ff-pid")}
        sensor = Sensor(*(jnp.asarray(x) for x in (NOISE, LIMITS.least, LIMITS.most)))
        within = ActuatorLimits(*(jnp.asarray(x) for x in (limits.low, limits.high, limits.slew)))
        loop = BlockLoop(actuator(*parts), sensor, DT)
        return cls(known, loop, controllers(chosen, known, within), within, limits, rig)

    def check(self, controller: str, reference: Float[np.ndarray, "n"]) -> None:
        """Raise InputError for a reference that is out of reach, a loop that swings, and what guards would end."""
        check_reachable(self.known, self.reach, reference, DT)
        way = self.ways[controller]
        first = way if isinstance(way, Controller) else way.first
        for size in (_LITTLE, _MUCH):
            found = margins(*open_loop(self.loop, first, size * self.limits.high))
            if found.phase <= 0:
                raise InputError(
                    f"the loop swings by itself for commands of {size * self.limits.high / BAR:.2g} bar: with "
                    f"{found.gain:.2g} times these gains it would begin to. Take lower ones.",
                    field="gains",
                )
        rehearse(self.loop, first, reference, self.limits, self.rig or self._simulated())

    def runs(
        self,
        controller: str,
        reference: Float[np.ndarray, "n"],
        name: str,
        logs: Sequence[Path],
        real_time: bool = False,
        progress: Callable[[int, float], None] | None = None,
    ) -> Iterator[BenchRun]:
        """As many experiments as there are logs, one after the other; what learns does so from each for the next."""
        way = self.ways[controller]
        law = way if isinstance(way, Controller) else way.first
        rig = self.rig or self._simulated(real_time)
        for k, log in enumerate(logs):
            told = None if progress is None else lambda share, k=k: progress(k, share)
            run = Experiment(rig, law, reference, self.limits, DT, name).run(log, told)
            yield _outcome(run, rig, reference)
            if isinstance(way, Learner):
                data = [run.data[one].values for one in ("reference", "measured", "command")]
                law = way.after(BlockLoopRecord(*(jnp.asarray(x) for x in (data[0], data[1], data[1], data[2]))))

    def _simulated(self, real_time: bool = False) -> SimulatedRig:
        pace = "real" if real_time else "virtual"
        return SimulatedRig(self.loop.plant, self.loop.sensor, dt=DT / self.loop.substeps, pace=pace)


def recorded_reference(path: Path, dt: float) -> Float[np.ndarray, "n"]:
    """The displacement of a recording, straight between its samples. Raises InputError for what has none, or gaps."""
    recording = read(path)
    if "displacement" not in recording or recording["displacement"].attrs.get("units") != "m":
        there = ", ".join(str(name) for name in recording.data_vars)
        raise InputError(f"has no displacement in m or a multiple of it; there are {there}.", file=str(path))
    time, wanted = recording["time"].values, recording["displacement"].values
    if not np.isfinite(wanted).all():
        k = int(np.flatnonzero(~np.isfinite(wanted))[0])
        raise InputError(f"is no number at {time[k]:g} s.", file=str(path), field="displacement")
    return np.interp(np.arange(time[0], time[-1] + 1e-9, dt), time, wanted)


def _outcome(run: RigRun, rig: Rig, reference: Float[np.ndarray, "n"]) -> BenchRun:
    measured = run.data["measured"].values
    wanted, known = reference[: len(measured)], np.isfinite(measured)
    if not known.any() or np.ptp(wanted[known]) == 0:
        return BenchRun(run, None, None)
    truths = np.array(rig.truths[: len(measured)]) if isinstance(rig, SimulatedRig) else None
    true = None if truths is None else range_errors(truths, wanted)
    return BenchRun(run, range_errors(measured[known], wanted[known]), true)
