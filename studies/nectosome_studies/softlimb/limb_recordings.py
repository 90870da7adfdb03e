"""A foam limb on film: how far it bends, what its tendon was told, and when.

Soft Robotics Lab, ETH Zurich, repository diffPD_sim2real (MIT, `recordings.LICENSE`, which ships beside this file). The
tables are `horizontal_cyclic1.csv` to `3` (`water_1` to `3`), `airtest.csv`, `baseline.csv` and `cyclic1.csv` as they
are there: time [ms], contraction of the tendon [mm], and x, y [mm] of four markers in the plane of the camera. Two
opposite limbs of a starfish lie along y. Their tendons bend them towards +x, and in water the starfish swims towards
-x. M1 is at the tip of one limb and M2 nearer to the hub: 30 mm, says the authors' code, though the camera sees 20 to
29 mm. M4 and M3 are on the other limb. What makes `cyclic` less horizontal than `horizontal_cyclic1` is not told: in
the picture limbs and path lie the same way.

The robot moves along x, so that places say little of the limb. The direction of the line through two markers of one
limb tells how far it bends, whatever the hub does, and however long a mm of the camera is.

The contraction is a command, and without noise: given values joined by straight lines. It repeats itself, in all but
`water_1` and `cyclic` by a pattern that goes to and fro faster than the camera takes pictures. All of it is there when
samples are put in the order of their phase (equivalent-time sampling). In `baseline` and `water_3` it slows down once
from 1.085 to 1.080 Hz.
"""

from importlib.resources import files
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

LIMBS = {
    "water_1": (1.7, 2.0),
    "air": (0.9, 1.3),
    "water_2": (0.9, 1.3),
    "baseline": (1.05, 1.12),
    "cyclic": (0.7, 1.1),
    "water_3": (1.05, 1.12),
}
"""Where the command's frequency is looked for [Hz]."""
SLOWS = {"baseline": 31.1, "water_3": 6.6}  # when the frequency changes [s]: its phase runs evenly before and after
MARKERS = 0.03  # from M2 to M1, as the authors' code has it [m]
_MOVES = 5e-4  # [m] from one frame to the next: the tendon has begun
_STEP = 1e-4  # [Hz]: 0.004 of a cycle in 37 s
_PARTS = 40  # of a frame, over which the command is averaged
_PHASES = 40


class LimbRecording(NamedTuple):
    """A recording, all frames; angles are positive where the tendon bends the limb to."""

    time: Float[np.ndarray, "n"]  # [s]
    angle: Float[np.ndarray, "n"]  # of the line from M2 to M1, from rest [rad]
    other: Float[np.ndarray, "n"]  # of that from M3 to M4, on the other limb [rad]
    rest: float  # of the first line, in the picture [rad]
    length: Float[np.ndarray, "n"]  # of the first line, as the camera sees it [m]
    column: Float[np.ndarray, "n"]  # contraction as it is in the file, NaN where there is none [m]
    begins: int  # the last frame before the tendon moves
    runs: Float[np.ndarray, "n"]  # mask of the frames in which it moves
    frequency: float  # at which the command repeats itself, where it is compared [Hz]
    slows: float  # when that changes [s]
    later: float  # the frequency after it [Hz]

    def cycles(self, time: Float[np.ndarray, "*m"]) -> Float[np.ndarray, "*m"]:
        """Cycles of the command from `slows` on, below 0 before."""
        return np.where(time < self.slows, self.frequency, self.later) * (time - self.slows)

    def pattern(self, time: Float[np.ndarray, "*m"]) -> Float[np.ndarray, "*m"]:
        """The command at any time while the tendon moves, from its samples in the order of their phase [m]."""
        phases = self.cycles(self.time[self.runs]) % 1
        return np.interp(self.cycles(time) % 1, phases, self.column[self.runs], period=1.0)

    def contraction(self) -> Float[np.ndarray, "n"]:
        """The command as means over frames, from no contraction on; while the tendon rests, that at rest [m]."""
        frame = float(np.diff(self.time).mean())
        parts = frame * ((np.arange(_PARTS) + 0.5) / _PARTS - 0.5)
        moved = self.pattern(self.time[:, None] + parts).mean(axis=1)
        return np.where(self.runs, moved, self.column[self.begins])


def limb_recording(name: str) -> LimbRecording:
    """One of the `LIMBS`."""
    text = files("nectosome_studies").joinpath("softlimb", f"limb_{name}.csv").read_text(encoding="utf-8")
    rows = np.genfromtxt(text.splitlines()[1:], delimiter=",")
    time, column = 1e-3 * rows[:, 0], 1e-3 * rows[:, 1]
    begins = int(np.argmax(np.abs(np.diff(column)) > _MOVES))
    runs = (np.arange(len(time)) > begins) & np.isfinite(column)
    m1, m2, m3, m4 = (1e-3 * rows[:, 2 + 2 * i : 4 + 2 * i] for i in range(4))
    one, other = (np.arctan2(*line.T) for line in (m1 - m2, (m4 - m3) * [1, -1]))
    rest = float(one[:begins].mean())
    slows = SLOWS.get(name, float(time[-1]))
    early = runs & (time <= slows)
    frequency = _frequency(time[early], column[early], LIMBS[name])
    late = runs & (time > slows)
    later = _frequency(time[late], column[late], LIMBS[name]) if late.any() else frequency
    length = np.hypot(*(m1 - m2).T)
    from_rest = one - rest, other - other[:begins].mean()
    return LimbRecording(time, *from_rest, rest, length, column, begins, runs, frequency, slows, later)


def repeated(cycles: Float[np.ndarray, "n"], value: Float[np.ndarray, "n"]) -> float:
    """Share of a value's variance that repeats itself in each cycle: of its means in each of 40 phases.

    A command that repeats itself makes whatever follows it repeat itself too, once it has forgotten its start. No more
    than this share can follow the command.
    """
    phase = (_PHASES * (cycles % 1)).astype(int)
    means = np.array([value[phase == k].mean() for k in range(_PHASES)])
    return float(means[phase].var() / value.var())


def without_drift(time: Float[np.ndarray, "n"], value: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """What is left of a value beside its mean over the 2 s around each frame."""
    half = round(1.0 / float(np.diff(time).mean()))
    window = np.ones(2 * half + 1) / (2 * half + 1)
    return value - np.convolve(np.pad(value, half, mode="edge"), window, "valid")


def _frequency(time: Float[np.ndarray, "n"], value: Float[np.ndarray, "n"], span: tuple[float, float]) -> float:
    """Frequency with which samples in the order of their phase are nearest to their neighbours [Hz]."""

    def rough(frequency: float) -> float:
        return float(np.abs(np.diff(value[np.argsort(time * frequency % 1)])).sum())

    coarse = min(np.arange(*span, _STEP), key=rough)
    return float(min(np.arange(coarse - _STEP, coarse + _STEP, 0.02 * _STEP), key=rough))
