"""PoseiDRONE filmed, tracked and identified: from two videos and a load cell's file to features and parameters.

The walk is that of the robot that ships, the swim that of the synthetic recordings: their parameters are known.
"""

import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from nectosome.description import get_value
from nectosome.identification.gait.walks import gait_of
from nectosome.identification.surge.estimators import Surge, fit_surge
from nectosome.identification.surge.files import surge_recordings
from nectosome.io import save_dataset
from nectosome.measure import load_campaign

from ..poseidrone.crawl import fit
from ..poseidrone.recordings import OMEGA, body, settled, thrust
from .tank import Path3

WINDOW = 5.0  # s, of a walk, over which the features are taken
_HIGH = 0.3  # m, of the swim over the floor
_CELL = 250.0  # Hz, of the load cell
_BEFORE = 0.3  # s, by which the load cell begins before the cameras and ends after them


def walk() -> tuple[Path3, Float[np.ndarray, "4"]]:
    """Path of the crawler over the last window of its walk, and its features before filming."""
    of = fit()
    row = np.array([[float(get_value(of.description, name)) for name in of.ranges.names]])
    (walked,) = of.walked(row)
    series = walked.series[0]  # surge, heave, tilt
    time = np.linspace(0.0, WINDOW, len(series))
    splines = CubicSpline(time, series)
    start = float(series[0, 0]) + 0.5 * float(series[-1, 0] - series[0, 0])

    def path(t: Float[np.ndarray, "t"]) -> tuple[Float[np.ndarray, "t 3"], Float[np.ndarray, "t 3"]]:
        x, z, tilt = splines(np.clip(t, 0.0, WINDOW)).T
        still = np.zeros_like(x)
        return np.stack([x - start, still, z], axis=-1), np.stack([still, tilt, still], axis=-1)

    return path, np.asarray(walked.gait[0])


def features(found: xr.Dataset) -> Float[np.ndarray, "4"]:
    """Features of a tracked walk; nan where the track has gaps."""
    x, _, z = found["position"].values.T
    time = found["time"].values
    return np.array([float(value) for value in gait_of(x, z, (time[-1] - time[0]) / (len(time) - 1))])


def swim(name: str, seconds: float) -> Path3:
    """Path of the swimmer along the tank, in its middle, level."""
    time, speed = settled(OMEGA[name])
    place = CubicSpline(time, speed).antiderivative()
    middle = 0.5 * float(place(seconds))

    def path(t: Float[np.ndarray, "t"]) -> tuple[Float[np.ndarray, "t 3"], Float[np.ndarray, "t 3"]]:
        x = place(np.asarray(t)) - middle
        still = np.zeros_like(x)
        return np.stack([x, still, still + _HIGH], axis=-1), np.stack([still, still, still], axis=-1)

    return path


def identified(found: xr.Dataset, name: str, seconds: float) -> dict[str, Surge]:
    """Added mass and drag from a track and the thrust of a load cell, whose file is .csv, and .tdms."""
    out = {}
    for suffix in ("csv", "tdms"):
        with tempfile.TemporaryDirectory() as folder:
            save_dataset(found, Path(folder) / "track.csv")
            _write_thrust(Path(folder) / f"thrust.{suffix}", OMEGA[name], seconds)
            campaign = Path(folder) / "campaign.yaml"
            campaign.write_text(_CAMPAIGN.format(suffix=suffix), encoding="utf-8")
            recordings = surge_recordings(load_campaign(campaign).recordings())
            out[suffix] = fit_surge(recordings, body()[0])
    return out


_CAMPAIGN = """\
recordings:
  - file: track.csv
    columns: {{position: {{column: "position x"}}}}
  - file: thrust.{suffix}
    columns: {{thrust: {{column: thrust}}}}
"""


def _write_thrust(path: Path, omega: float, seconds: float) -> None:
    """A load cell's file, as its program writes it; the same numbers whatever the format."""
    time = np.arange(-_BEFORE, seconds + _BEFORE, 1 / _CELL)
    values = thrust(omega * time)
    if path.suffix == ".csv":
        rows = (f"{t!r},{x!r}" for t, x in zip(time.tolist(), values.tolist(), strict=True))
        path.write_text("\n".join(["time (s),thrust (N)", *rows]) + "\n", encoding="utf-8")
        return
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as file:
        file.write_segment(
            [
                ChannelObject("cell", "time", time, {"unit_string": "s"}),
                ChannelObject("cell", "thrust", values, {"unit_string": "N"}),
            ]
        )


def numbers(walked: xr.Dataset, truth: Float[np.ndarray, "4"], found: dict[str, Surge]) -> dict[str, float]:
    """Rows of features and of parameters."""
    off = 100 * (features(walked) / truth - 1)
    rows = {f"track/poseidrone/{row}-error": float(x) for row, x in zip(_ROWS, off, strict=True)}
    _, *true = body()
    estimate = found["csv"].physical
    low, high = np.asarray(estimate.interval()).T
    for k, row in enumerate(("added-mass", "drag")):
        rows[f"track/swim/{row}-error"] = 100 * float(estimate.values[k] / true[k] - 1)
        rows[f"track/swim/{row}-interval"] = 50 * float(high[k] - low[k]) / float(true[k])
    same = np.array_equal(found["csv"].physical.values, found["tdms"].physical.values)
    return rows | {"track/swim/tdms-as-csv": 100.0 * same}


_ROWS = ("a", "f", "speed", "height")
