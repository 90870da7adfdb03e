"""What a robot did under a controller, sample by sample and moment by moment."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.core import Status
from nectosome.io import dump_robot, provenance
from nectosome.io.dimensions import DIMENSIONS
from nectosome.mechanism import Diagnosis
from nectosome.robots import Commanded, build
from nectosome.robots.commanded import Held, Standing
from nectosome.solve import Run, Trajectory, results_of

if TYPE_CHECKING:
    import xarray as xr

_MOST = 4000  # moments of a run that are kept, or one a sample


@dataclass(frozen=True)
class Followed:
    """What a robot did under a controller. Samples have the index k, moments within them m.

    `standings` and `pieces` are where the robot stood and what it did, at first and after each sample that was held.
    """

    robot: Commanded
    time: Float[np.ndarray, "k"]  # [s]
    reference: Float[np.ndarray, "k"]
    output: Float[np.ndarray, "k"]  # what was, without delay and noise; its mean over a beat where that is measured
    measured: Float[np.ndarray, "k"]  # what the controller was told
    command: Float[np.ndarray, "k"]  # held from this sample to the next
    standings: Sequence[Standing]
    pieces: Sequence[Held]
    status: Status

    @cached_property
    def moment(self) -> Float[np.ndarray, "m"]:
        """Times between the samples [s]."""
        return np.concatenate([piece.time for piece in self.pieces])

    @cached_property
    def reading(self) -> Float[np.ndarray, "m"]:
        """What is measured, at each moment."""
        return np.concatenate([piece.reading for piece in self.pieces])

    @property
    def title(self) -> str:
        """Robot, what is measured and what is commanded."""
        return f"{self.robot.description.name}: {self.robot.reading.name} by {self.robot.command}"

    def last(self, seconds: float) -> "Followed":
        """The last so many seconds of it."""
        k = max(len(self.time) - int(min(seconds / self.robot.dt, len(self.time))), 0)
        rows = {name: getattr(self, name)[k:] for name in ("time", "reference", "output", "measured", "command")}
        return replace(self, **rows, standings=self.standings[k:], pieces=self.pieces[k:])

    def track(self) -> "xr.Dataset":
        """`reference`, `output`, `measured`, `command` over `sample` [s], `reading` and `position` over `time` [s].

        `position` [m] is that of each part's first station. Computes nothing.
        """
        import xarray as xr

        position = np.concatenate([piece.position for piece in self.pieces])
        return self._samples().merge(
            xr.Dataset(
                {
                    "reading": ("time", self.reading, {"units": self._of}),
                    "position": (("time", "station", "axis"), position, {"units": "m"}),
                },
                coords={
                    "time": ("time", self.moment, {"units": "s"}),
                    "station_part": ("station", [*self.robot.parts]),
                },
            )
        )

    def to_dataset(
        self, settings: dict[str, Any] | None = None, diagnoses: Sequence[Diagnosis] | None = None
    ) -> "xr.Dataset":
        """A run like any, in SI units, from the first sample on, with what `track` has over `sample`, and `reading`.

        `settings` go into its provenance; `diagnoses` of all pieces but the first, where they are known, are not
        computed again. Of very many moments as many are kept as are seen.
        """
        pieces = self.pieces[1:]
        if diagnoses is None:
            held = zip(self.standings[:-1], self.standings[1:], pieces, strict=True)
            diagnoses = [self.robot.diagnosis(*what) for what in held]
        moments = len(pieces[0].time)
        every = min(-(-moments * len(pieces) // _MOST), moments)
        some = slice(every - 1 + (moments - every) % every, None, every)  # the end of a sample is one of them
        time, reading = (np.concatenate([getattr(p, name)[some] for p in pieces]) for name in ("time", "reading"))
        states = jax.tree.map(lambda *x: jnp.concatenate([a[some] for a in x]), *(p.state for p in pieces))
        told = jax.tree.map(lambda *x: np.concatenate([a[some] for a in x]), *diagnoses)
        description = self.robot.description
        trajectory = Trajectory(build(description), jnp.asarray(time), states)
        run = Run(trajectory, jnp.asarray(int(self.status)), {}, jnp.zeros(()))
        whole = results_of(run, told, None, settings or {}).to_dataset().merge(self._samples())
        return whole.assign(reading=("time", reading, {"units": self._of})).assign_attrs(
            self._samples().attrs, robot=dump_robot(description), provenance=json.dumps(provenance(settings or {}))
        )

    @property
    def _of(self) -> str:
        return DIMENSIONS[self.robot.reading.dimension].unit or "1"

    def _samples(self) -> "xr.Dataset":
        import xarray as xr

        of, command = self._of, self.robot.quantity.unit or "1"
        units = {"reference": of, "output": of, "measured": of, "command": command}
        return xr.Dataset(
            {name: ("sample", getattr(self, name), {"units": unit}) for name, unit in units.items()},
            coords={"sample": ("sample", self.time, {"units": "s"})},
            attrs={
                "title": self.title,
                "measured": self.robot.reading.name,
                "commanded": self.robot.command,
                "status": self.status.name,
                "status_reason": self.status.reason,
            },
        )
