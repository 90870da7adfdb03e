"""The study of foils that flap: the load `foil` beside a wind tunnel and a vortex lattice; nothing is fitted."""

from importlib.metadata import version
from importlib.util import find_spec
from typing import Any

import numpy as np
import xarray as xr

from ..study import Progress, StudyPart
from .cases import CASES
from .flapping import PHASES, BeatForces, FoilBeat, harmonic
from .kept import kept
from .lattice import PACKAGE, LatticeForces, lattice, settings
from .replay import ATTACHED, replay
from .rows import case_rows
from .wing import measured

NAME = "vortex"
_MODELS = ("foil", "attached", "lattice")


def part(quick: bool, progress: Progress) -> StudyPart:
    """All rows. Where PteraSoftware is installed the lattice's forces are made anew; `quick` takes those that ship."""
    anew = find_spec(PACKAGE) is not None and not quick
    made, theirs = (f"PteraSoftware {version(PACKAGE)}, {settings()}", {}) if anew else kept()
    rows: list[dict[str, Any]] = []
    data: dict[str, xr.Dataset] = {}
    for k, (name, (title, make)) in enumerate(CASES.items()):
        progress(title, k / len(CASES))
        beat = make()
        beside = lattice(beat) if anew else theirs[name]
        ours = {"foil": replay(beat), "attached": replay(beat, **ATTACHED)}
        data[name] = _dataset(name, beat, ours, beside).assign_attrs(title=title, made=made)
        rows += case_rows(name, title, beat, ours, beside)
    how = (
        "were computed now"
        if anew
        else "are those that ship; with pip install './nectosome/studies[vortex]' they are made anew"
    )
    return StudyPart({}, data, rows=rows, about=f"The lattice's forces {how} ({made}).")


def _dataset(name: str, beat: FoilBeat, ours: dict[str, BeatForces], theirs: LatticeForces) -> xr.Dataset:
    """Forces (model, phase), and first harmonics of lift per span by bands and strips."""
    seen = measured() if name == "wing" else None
    beats = [(f.total, f.thrust, f.power) for f in ours.values()] + [theirs[:3]]
    table: dict[str, Any] = {
        key: (("model", "phase"), [one[i] for one in beats], {"units": unit})
        for i, (key, unit) in enumerate((("lift", "N"), ("thrust", "N"), ("power", "W")))
    }
    edges = np.array(beat.edges)
    per = {which: harmonic(f.lift) / np.diff(edges) for which, f in ours.items()}
    per["lattice"] = theirs.by_bands(beat.edges) / np.diff(edges)
    table["band_lift"] = (("model", "band"), [np.abs(c) for c in per.values()], {"units": "N/m"})
    table["strip_lift"] = (("strip",), np.abs(theirs.strip_lift) / np.diff(theirs.ends), {"units": "N/m"})
    table["strip_thrust"] = (("strip",), theirs.strip_thrust / np.diff(theirs.ends), {"units": "N/m"})
    if seen is not None:
        table["measured_lift"] = (("phase",), seen.total, {"units": "N"})
        table["measured_band_lift"] = (("band",), np.abs(harmonic(seen.lift)) / np.diff(edges), {"units": "N/m"})
    return xr.Dataset(
        table,
        coords={
            "model": [*_MODELS],
            "phase": np.arange(PHASES) / PHASES,
            "band_from": ("band", edges[:-1], {"units": "m"}),
            "band_to": ("band", edges[1:], {"units": "m"}),
            "strip_at": ("strip", 0.5 * (theirs.ends[:-1] + theirs.ends[1:]), {"units": "m"}),
        },
    )
