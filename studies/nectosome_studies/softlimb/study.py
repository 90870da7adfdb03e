"""The study of a silicone beam and a foam limb: identified from one recording each, the others predicted."""

from typing import Any

import xarray as xr

from ..study import Progress, StudyPart, score
from .beam import FITTED, IdentifiedBeam, identified
from .limb import SLACKS, limb_angles, limb_errors, limb_motions, limb_numbers
from .limb import identified as identified_limb
from .recordings import RELEASES

NAME = "softlimb"
WORDS = {
    "gravity_a": "own weight, fitted",
    "gravity_b": "own weight, again",
    "load_a": "52 g at the tip",
    "load_101": "101 g at the tip",
}
_ANGLES = 20.0  # tolerance of the limb's angles [percent]
_FOLLOWS = 0.5  # below this correlation an angle that agrees does so by its size only
_COMPARED = {
    "frequency": ("frequency", "Hz", 5.0),
    "damping": ("damping ratio", "1", 20.0),
    "sag": ("sag of the tip at rest", "mm", 10.0),
}


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows; there is nothing to shorten."""
    del quick
    progress("beam", 0.0)
    beam = identified()
    progress("limb", 0.3)
    limb = identified_limb()
    motions = limb_motions(limb)
    data = {
        "beam": beam.found.to_dataset(),
        "releases": _dataset(beam),
        "limb-held": limb.held[0].to_dataset(),
        "limb-loose": limb.held[limb.loose].to_dataset(),
        "limb-asked": limb.asked.to_dataset(),
        "limb-motions": motions,
        "limb-errors": limb_errors(limb, motions),
    }
    found = limb_numbers(data["limb-held"], data["limb-asked"], data["limb-errors"], SLACKS[limb.loose])
    numbers = {f"{NAME}/limb/{name}": x for name, x in found.items()}
    rows = [*_measured_rows(data["releases"]), *_angle_rows(motions, data["limb-errors"]["loose_correlation"])]
    return StudyPart(_numbers(beam, data["beam"]) | numbers, data, rows=rows)


def _numbers(beam: IdentifiedBeam, fit: xr.Dataset) -> dict[str, float | None]:
    half = 0.5 * (fit["high"] - fit["low"]).values
    errors = dict(zip(fit["recording"].values, fit["e_rmsp"].values[:, 0], strict=True))
    numbers = {
        "young": 1e-3 * beam.found.theta[0],
        "young-half-interval": 1e-3 * half[0],
        "young-at-rest": 1e-3 * beam.static_young,
        "viscosity": beam.found.theta[1],
        "viscosity-half-interval": half[1],
        "fitted": errors["gravity_a"],
        "held-out": errors["gravity_b"],
        "repeat": beam.repeat,
        "held-out-load": errors["load_a"],
        "held-out-load-101": errors["load_101"],
    }
    return {f"{NAME}/beam/{name}": float(x) for name, x in numbers.items()}


def _dataset(beam: IdentifiedBeam) -> xr.Dataset:
    """Numbers by `release`, measured and predicted; intervals in the last axis."""
    theirs, ours = ([every[name] for name in RELEASES] for every in (beam.measured, beam.predicted))
    ends = ("release", "end")
    return xr.Dataset(
        {
            "measured_frequency": ("release", [one.frequency for one in theirs], {"units": "Hz"}),
            "measured_frequency_interval": (ends, [one.frequency_interval for one in theirs], {"units": "Hz"}),
            "measured_damping": ("release", [one.damping_ratio for one in theirs]),
            "measured_damping_interval": (ends, [one.damping_interval for one in theirs]),
            "measured_sag": ("release", [-1e3 * beam.releases[name].rest for name in RELEASES], {"units": "mm"}),
            "frequency": ("release", [one.frequency for one in ours], {"units": "Hz"}),
            "damping": ("release", [one.damping_ratio for one in ours]),
            "sag": ("release", [-1e3 * beam.rest[name] for name in RELEASES], {"units": "mm"}),
        },
        coords={"release": [*RELEASES], "end": ["low", "high"]},
    )


def _measured_rows(releases: xr.Dataset) -> list[dict[str, Any]]:
    """What was measured beside ours, by release and quantity."""
    rows = []
    for name in RELEASES:
        one = releases.sel(release=name)
        for quantity, (what, unit, tolerance) in _COMPARED.items():
            entry = {
                "quantity": f"silicone beam, {WORDS[name]}: {what}",
                "unit": unit,
                "kind": "calibration" if name == FITTED else "prediction",
                "source": "measured",
                "printed": float(one[f"measured_{quantity}"]),
                "tolerance": tolerance,
                "note": "Of the vibration from 0.1 s after the release on." if quantity != "sag" else "",
            }
            rows.append(score(f"{NAME}/{name.replace('_', '-')}/{quantity}", entry, float(one[quantity])))
    return rows


def _angle_rows(motions: xr.Dataset, correlation: xr.DataArray) -> list[dict[str, Any]]:
    """The foam limb's angles beside ours, in recordings that nothing was fitted to."""
    rows = []
    for name, angles in limb_angles(motions).items():
        follows = float(correlation.sel(recording=name))
        apart = "" if follows > _FOLLOWS else f" Of its size only: their correlation over time is {follows:.2f}."
        for quantity, (measured, ours) in angles.items():
            entry = {
                "quantity": f"foam limb in water, recording `{name}`: {quantity} of its angle",
                "unit": "deg",
                "kind": "prediction",
                "source": "measured",
                "printed": measured,
                "tolerance": _ANGLES,
                "note": f"From rest, of the first 2 s of pulls, with the slack of another recording.{apart}",
            }
            rows.append(score(f"{NAME}/limb-{name.replace('_', '-')}/{quantity}", entry, ours))
    return rows
