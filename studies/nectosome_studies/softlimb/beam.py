"""The beam as a rod of a robot file: identified from one release, then the others predicted."""

import json
from importlib.resources import as_file, files
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar, root_scalar

from nectosome.description import RobotDescription, load_robot
from nectosome.identification import RobotFit, identify
from nectosome.solve import reading, simulate, static

from .recordings import LOADS, RELEASES, Release, release
from .ringing import Ringing, ringing

FITTED = "gravity_a"
_TIP = "weight.position.z"
_VARY = {"E": "150..500kPa", "eta": "50..5000Pa s log"}
_SHIFT = "-0.03..0.07s"  # of the release: a hand lets go, and neither at once nor in one frame
_RANG = 0.1  # from the release on [s]: before it the hand is still there
_STATIC = (1e5, 1e6)  # Young's modulus [Pa]


class IdentifiedBeam(NamedTuple):
    """What the releases tell."""

    releases: dict[str, Release]
    found: RobotFit  # of `FITTED`; the others are its test
    static_young: float  # by which the tip sags as far as it does at rest under its own weight [Pa]
    rest: dict[str, float]  # height of the tip at rest, predicted [m]
    measured: dict[str, Ringing]
    predicted: dict[str, Ringing]
    repeat: float  # rms difference of the two releases under own weight, one shifted in time [percent of the range]


def beam() -> RobotDescription:
    """The robot file that ships beside this module."""
    with as_file(files("nectosome_studies").joinpath("softlimb", "beam.yaml")) as file:
        return load_robot(file)


def identified() -> IdentifiedBeam:
    """Young's modulus and viscosity from `FITTED`; each release has the time of its own beginning, nothing else."""
    releases = {name: release(name) for name in RELEASES}
    campaign = [_recording(name, one) for name, one in releases.items()]
    held_out = [name for name in RELEASES if name != FITTED]
    found = identify(beam(), campaign, vary=_VARY, compare={"height": _TIP}, starts=1, test=held_out)
    young, eta = (float(x) for x in found.theta[:2])
    rest, predicted = {}, {}
    for name, seconds in RELEASES.items():
        settings = [f"E={young!r} Pa", f"eta={eta!r} Pa s", *_weight(name)]
        rest[name] = _sag(settings)
        times = np.arange(round(100 * seconds)) / 100
        swung = simulate(beam(), float(times[-1]), settings=settings, samples=times.tolist())
        predicted[name] = _rang(times, np.asarray(reading(swung, _TIP)))
    measured = {
        name: _rang(one.time[:n], one.height[:n])
        for name, one in releases.items()
        for n in (round(100 * RELEASES[name]),)
    }
    sag = np.mean([releases[name].rest for name in ("gravity_a", "gravity_b")])
    static_young = root_scalar(lambda E: _sag([f"E={E!r} Pa"]) - sag, bracket=_STATIC, rtol=1e-6).root
    return IdentifiedBeam(releases, found, float(static_young), rest, measured, predicted, _repeat(releases))


def _recording(name: str, one: Release) -> xr.Dataset:
    n = round(100 * RELEASES[name])
    told = {"provenance": json.dumps({"file": name, "repairs": [], "warnings": []}), "shift": json.dumps(_SHIFT)}
    weight = {"weight": ((), LOADS[name], {"units": "kg"})} if name in LOADS else {}
    height = ("time", one.height[:n], {"units": "m"})
    return xr.Dataset({"height": height}, {"time": ("time", one.time[:n], {"units": "s"}), **weight}, told)


def _weight(name: str) -> list[str]:
    return [f"weight={LOADS[name]} kg"] if name in LOADS else []


def _sag(settings: list[str]) -> float:
    return float(reading(static(beam(), settings=settings), _TIP)[-1])


def _rang(time: np.ndarray, height: np.ndarray) -> Ringing:
    there = time >= _RANG
    return ringing(time[there], height[there])


def _repeat(releases: dict[str, Release]) -> float:
    """Of a from b, by the shift at which they are nearest, over the time in which both are compared."""
    one, other = (releases[name] for name in ("gravity_a", "gravity_b"))
    there = (one.time >= _RANG) & (one.time < RELEASES["gravity_a"])

    def off(shift: float) -> float:
        return float(
            np.sqrt(np.mean((np.interp(one.time[there] + shift, other.time, other.height) - one.height[there]) ** 2))
        )

    best = minimize_scalar(off, bounds=(-0.05, 0.05), method="bounded", options={"xatol": 1e-6}).fun
    return 100 * float(best) / float(np.ptp(one.height[there]))
