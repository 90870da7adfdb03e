"""The foam limb as a rod of a robot file, pulled by its tendon: what recordings tell of it, and what they do not."""

import json
from importlib.resources import as_file, files
from typing import NamedTuple

import jax
import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.core import Status
from nectosome.description import RobotDescription, Samples, load_robot, with_recordings
from nectosome.identification import RobotFit, identify
from nectosome.model import build
from nectosome.solve import reading, simulate, static

from .limb_recordings import LIMBS, MARKERS, LimbRecording, limb_recording, repeated, without_drift

FITTED = "water_1"
SLACK_BY = "water_2"  # whose error chooses the slack
HELD_OUT = ("baseline", "cyclic", "water_3")  # simulated after all numbers were found
PREDICTORS = ("held", "loose", "asked", "rest", "linear")
SLACKS = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0)  # by which the tendon hangs loose where nothing is contracted [mm]
_BEFORE = 20  # frames at rest that are compared
_FRAMES = 140  # that are compared in all: 2.3 s in water, 2.8 s in air
_READING, _PULLED = "body.0.71.heading", "body.loads.tendon.tension"
_MM = 1000 * MARKERS  # [mm] by angle [rad]
_PULL = 1000.0  # tension of the tendon [N] by contraction [m], so that its arm is the gain
_AIR = 1.2  # [kg/m3]
_VARY = {"E": "50..5000kPa log", "eta": "100..100000Pa s log", "gain": "0.05..50mm log", "drag": "0.2..10"}


class IdentifiedLimb(NamedTuple):
    """What the recordings tell."""

    recordings: dict[str, LimbRecording]
    held: tuple[RobotFit, ...]  # of the recording in water alone, E as the robot file has it, for each of the `SLACKS`
    loose: int  # place in `SLACKS` of the slack that `SLACK_BY` chooses
    asked: RobotFit  # of a recording in water and the one in air, with that slack: E, eta, gain, drag


def limb() -> RobotDescription:
    """The robot file that ships beside this module."""
    with as_file(files("nectosome_studies").joinpath("softlimb", "limb.yaml")) as file:
        return load_robot(file)


def compared(one: LimbRecording) -> slice:
    """The frames of a recording that are compared: the last at rest, and the first with the tendon."""
    return slice(one.begins - _BEFORE, one.begins - _BEFORE + _FRAMES)


def identified() -> IdentifiedLimb:
    """Viscosity, gain of the tendon and drag, with Young's modulus known and unknown."""
    recordings = {name: limb_recording(name) for name in LIMBS}

    def fit(vary: dict[str, str], test: list[str], slack: float) -> RobotFit:
        campaign = [compared_frames(name, one, slack) for name, one in recordings.items()]
        drive = {"pull": _PULLED}
        return identify(limb(), campaign, vary=vary, compare={"angle": _READING}, drive=drive, starts=1, test=test)

    known = {name: span for name, span in _VARY.items() if name != "E"}
    held = [fit(known, [name for name in LIMBS if name != FITTED], slack) for slack in SLACKS]
    chosen = recordings[SLACK_BY].angle[compared(recordings[SLACK_BY])]
    loose = int(np.argmin([_rms(_computed(one)[SLACK_BY] - chosen) for one in held]))
    asked = fit(_VARY, [name for name in LIMBS if name not in (FITTED, "air")], SLACKS[loose])
    return IdentifiedLimb(recordings, tuple(held), loose, asked)


def compared_frames(name: str, one: LimbRecording, slack: float) -> xr.Dataset:
    """The frames of a recording that are compared, as a campaign has them: its angle, and the pull, with slack [mm]."""
    frames = compared(one)
    attrs = {"provenance": json.dumps({"file": name, "repairs": [], "warnings": []})}
    density = {"water.density": ((), _AIR, {"units": "kg/m3"})} if name == "air" else {}
    taut = np.maximum(one.contraction()[frames] - 1e-3 * slack, 0.0)
    if taut[0] > 0:  # it rests bent
        attrs["start"] = json.dumps({"before": "equilibrium"})
    columns = {
        "pull": ("time", _PULL * taut, {"units": "N"}),
        "angle": ("time", one.angle[frames], {"units": "rad"}),
    }
    time = one.time[frames] - one.time[frames][0]
    return xr.Dataset({**columns, **density}, {"time": ("time", time, {"units": "s"})}, attrs)


def simulated_angle(robot: RobotDescription, frames: xr.Dataset) -> Float[np.ndarray, "n"]:
    """Angle from rest [rad] of a limb that is pulled as in these frames, `while_pulled`.

    Raises RuntimeError where the simulation fails.
    """
    time = frames["time"].values
    one = build(with_recordings(robot, {_PULLED: Samples(time.tolist(), frames["pull"].values.tolist(), "N")}))
    start = jax.tree.map(lambda x: x[-1], static(one).value.state)
    run = simulate(one, time[-1], samples=time.tolist(), initial=start)
    if int(run.status) != Status.SOLVED:
        raise RuntimeError(f"{robot.name}: {Status(int(run.status)).reason}")
    return while_pulled(np.asarray(reading(run, _READING)))


def while_pulled(angle: Float[np.ndarray, "n"]) -> Float[np.ndarray, "k"]:
    """An angle over the frames that are compared: from rest [rad], from the first pull on."""
    return (angle - angle[0])[_BEFORE + 1 :]


def limb_motions(found: IdentifiedLimb) -> xr.Dataset:
    """Angles by `recording` and `frame`, over the frames that are compared, from rest [rad].

    `measured`; `other`, measured on the other limb; those of the `PREDICTORS`: of fits, `held` without slack, `loose`
    with the one that `SLACK_BY` chooses, `asked` with that and all unknown; `rest`, 0, and `linear`, in proportion to
    the contraction, as fits `FITTED` best. `contraction` is the command [m].
    """
    fits = {"held": found.held[0], "loose": found.held[found.loose], "asked": found.asked}
    computed = {key: _computed(fit) for key, fit in fits.items()}
    rows = {
        name: {
            "time": one.time[compared(one)] - one.time[one.begins],
            "contraction": one.contraction()[compared(one)],
            "measured": one.angle[compared(one)],
            "other": one.other[compared(one)],
            **{key: angles[name] for key, angles in computed.items()},
            "rest": np.zeros(_FRAMES),
        }
        for name, one in found.recordings.items()
    }
    pulled = {name: row["contraction"] - row["contraction"][0] for name, row in rows.items()}
    slope = float(pulled[FITTED] @ rows[FITTED]["measured"] / (pulled[FITTED] @ pulled[FITTED]))
    for name, row in rows.items():
        row["linear"] = slope * pulled[name]
    units = {"time": "s", "contraction": "m"}
    columns = {
        key: (("recording", "frame"), np.stack([row[key] for row in rows.values()]), {"units": units.get(key, "rad")})
        for key in rows[FITTED]
    }
    return xr.Dataset(columns, {"recording": [*rows]})


def limb_errors(found: IdentifiedLimb, motions: xr.Dataset) -> xr.Dataset:
    """Errors beside the measured spread, by `recording`, as mm of M1 about M2: the angle times 30 mm.

    - over `predictor`: `error`, rms over the frames that are compared; `range` is that of the measured angle there;
      `held_correlation`, `loose_correlation` with it while the tendon moves. `rest` is the angle at rest in the
      picture [rad], `rest_pull` the contraction there [m].
    - over `slack` [mm]: `slack_error`, of the fit with each.
    - of all frames in which the tendon moves: `moves`, rms of the angle without its drift; `limbs`, rms of the
      difference of both limbs; `repeats`, the share of the variance that repeats itself with the command; `unrepeated`,
      rms of the rest. `frequency` of the command [Hz].
    """
    off = [motions[key].values - motions["measured"].values for key in PREDICTORS]
    errors = np.apply_along_axis(_rms, -1, off).T
    loose = [_computed(fit) for fit in found.held]
    measured = motions["measured"]
    slack_errors = [[_rms(one[str(name)] - measured.sel(recording=name).values) for name in LIMBS] for one in loose]
    spread = []
    for one in found.recordings.values():
        moves, other = (without_drift(one.time, x)[one.runs] for x in (one.angle, one.other))
        share = repeated(one.cycles(one.time[one.runs]), moves)
        spread.append((moves.std(), (moves - other).std(), np.sqrt(1 - share) * moves.std(), share, one.frequency))
    moves, limbs, unrepeated, share, frequency = np.array(spread).T
    begun = motions.isel(frame=slice(_BEFORE + 1, None))
    follows = {key: xr.corr(begun[key], begun["measured"], "frame").values for key in ("held", "loose")}
    mm = {"units": "mm"}
    return xr.Dataset(
        {
            "error": (("recording", "predictor"), _MM * errors, mm),
            "range": ("recording", _MM * (measured.max("frame") - measured.min("frame")).values, mm),
            **{f"{key}_correlation": ("recording", values) for key, values in follows.items()},
            "slack_error": (("slack", "recording"), _MM * np.array(slack_errors), mm),
            "moves": ("recording", _MM * moves, mm),
            "limbs": ("recording", _MM * limbs, mm),
            "unrepeated": ("recording", _MM * unrepeated, mm),
            "repeats": ("recording", share),
            "frequency": ("recording", frequency, {"units": "Hz"}),
            "rest": ("recording", [one.rest for one in found.recordings.values()], {"units": "rad"}),
            "rest_pull": ("recording", motions["contraction"][:, 0].values, {"units": "m"}),
        },
        {"recording": [*found.recordings], "predictor": [*PREDICTORS], "slack": [*SLACKS]},
    )


def limb_angles(motions: xr.Dataset) -> dict[str, dict[str, tuple[float, float]]]:
    """Mean and range of the angle from the first pull on [deg], measured and by `loose`, of the `HELD_OUT`."""
    begun = np.rad2deg(motions[["measured", "loose"]].isel(frame=slice(_BEFORE + 1, None)))
    both = {"mean": begun.mean("frame"), "range": begun.max("frame") - begun.min("frame")}
    return {
        name: {
            what: (float(one["measured"].sel(recording=name)), float(one["loose"].sel(recording=name)))
            for what, one in both.items()
        }
        for name in HELD_OUT
    }


def limb_numbers(held: xr.Dataset, asked: xr.Dataset, errors: xr.Dataset, slack: float) -> dict[str, float | None]:
    """Numbers of the scorecard, from both fits' datasets: SI, None where not identifiable; errors in % of the range.

    `slack` is the one chosen [mm].
    """
    size = errors["range"]
    percent = 100 * errors["error"] / size

    def known(fit: xr.Dataset, symbol: str, factor: float = 1.0) -> float | None:
        one = fit.sel(parameter=symbol)
        return factor * float(one["value"]) if bool(one["identifiable"]) else None

    return {
        "young": known(asked, "E", 1e-3),
        "viscosity": known(held, "eta"),
        "gain": known(held, "gain", _PULL),
        "drag": known(held, "drag"),
        "fitted": float(percent.sel(recording=FITTED, predictor="held")),
        "held-out-air": float(percent.sel(recording="air", predictor="held")),
        "held-out": float(percent.sel(recording="water_2", predictor="held")),
        "slack": slack,
        "slack-calibrated": float(percent.sel(recording=SLACK_BY, predictor="loose")),
        "slack-held-out-air": float(percent.sel(recording="air", predictor="loose")),
        **{f"held-out-{name}": float(percent.sel(recording=name, predictor="held")) for name in HELD_OUT},
        **{f"slack-held-out-{name}": float(percent.sel(recording=name, predictor="loose")) for name in HELD_OUT},
        **{f"at-rest-{name}": float(percent.sel(recording=name, predictor="rest")) for name in HELD_OUT},
        "at-rest": float(percent.sel(recording="water_2", predictor="rest")),
        "linear": float(percent.sel(recording="water_2", predictor="linear")),
        "limbs-repeat": float((100 * errors["limbs"] / size).sel(recording="water_2")),
        "command-repeat": float((100 * errors["unrepeated"] / size).sel(recording="water_2")),
    }


def _computed(fit: RobotFit) -> dict[str, Float[np.ndarray, "n"]]:
    """Angle by recording, from rest [rad]."""
    both = [*zip(fit.trials, fit.computed, strict=True), *fit.test]
    return {trial.name: rows[0] - rows[0, 0] for trial, rows in both}


def _rms(values: Float[np.ndarray, "n"]) -> float:
    return float(np.sqrt(np.mean(values**2)))
