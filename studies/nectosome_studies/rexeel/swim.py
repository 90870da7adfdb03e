"""Simulated swims of RExEel from rest: the robot that ships, its joints turned by angles at given times."""

import time
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from nectosome.core import Status
from nectosome.description import RobotDescription
from nectosome.description.fields import Angle
from nectosome.description.signals import SmoothRecordingSignal
from nectosome.model import build
from nectosome.solve import SimulationRun, simulate

from .errors import TIMES, Links, Track
from .recordings import FRAME

SAMPLES = np.linspace(0.0, TIMES[-1], 201)  # [s], of the angles: the end of their ramp is among them
_RTOL = 1e-5
_SETTLED = 2.0  # [s], one beat: from here on speed and yaw are compared


class PredictedSwim(NamedTuple):
    """A simulated swim, and how long it took [s], with what had to be compiled."""

    track: Track
    run: SimulationRun
    seconds: float


class Motion(NamedTuple):
    """What is compared of swims."""

    distance: Float[np.ndarray, "*swims"]  # from the start to the last frame, straight [m]
    speed: Float[np.ndarray, "*swims"]  # slope of the track along the tank from 2 s on [m/s]
    yaw_swing: Float[np.ndarray, "*swims"]  # from side to side from 2 s on [rad]


def swim(description: RobotDescription, angles: Float[np.ndarray, "n 5"]) -> PredictedSwim:
    """Swim of 4 s by angles [rad] at `SAMPLES`. Raises RuntimeError where it does not succeed."""
    robot = build(driven(description, angles))
    began = time.perf_counter()
    run = simulate(robot, TIMES[-1], samples=TIMES.tolist(), rtol=_RTOL, atol=1e-2 * _RTOL)
    seconds = time.perf_counter() - began
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"rexeel did not swim: {Status(int(run.status)).reason}")
    results = run.results()
    head, coordinates = np.asarray(results.data["position"][1])[:, 0], np.asarray(results.data["q"][1])
    across, along = head[:, 1], -head[:, 0]
    track = Track(across - across[0], along - along[0], -coordinates[:, 2], CubicSpline(SAMPLES, angles)(TIMES))
    return PredictedSwim(track, run, seconds)


def driven(description: RobotDescription, angles: Float[np.ndarray, "n 5"]) -> RobotDescription:
    """The robot with its joints turned by angles [rad] at `SAMPLES`."""
    for (name, limb), one in zip(description.limbs.items(), angles.T, strict=True):
        motion = SmoothRecordingSignal[Angle](kind="recording", times=tuple(SAMPLES), values=tuple(one))
        description = description.with_part(name, joint=limb.joint.model_copy(update={"motion": motion}))
    return description


def links(description: RobotDescription) -> Links:
    """Lengths and masses from head to tail."""
    parts = description.parts.values()
    return Links(np.array([part.length for part in parts]), np.array([part.mass for part in parts]))  # pyright: ignore


def motion(
    time: Float[np.ndarray, "frame"],
    x: Float[np.ndarray, "*swims frame"],
    y: Float[np.ndarray, "*swims frame"],
    yaw: Float[np.ndarray, "*swims frame"],
) -> Motion:
    """Distance, speed and peak-to-peak yaw of tracks at times [s], in metres and rad."""
    later = time >= _SETTLED - 1e-9
    centred = time[later] - time[later].mean()
    return Motion(
        np.hypot(x[..., -1] - x[..., 0], y[..., -1] - y[..., 0]),
        y[..., later] @ centred / np.sum(centred**2),
        np.ptp(yaw[..., later], axis=-1),
    )


def at_frames(track: Track) -> tuple[Float[np.ndarray, "frame"], ...]:
    """Times of the film's frames, x, y and yaw of a simulated swim there."""
    step = round(FRAME * (len(TIMES) - 1) / TIMES[-1])
    frames = slice(0, len(TIMES) - 1, step)
    return TIMES[frames], track.x[frames], track.y[frames], track.yaw[frames]
