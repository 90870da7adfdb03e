"""Control: Figs. 8 to 10, with the paper's PID and with better controllers."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.controllers import (
    BlockLoop,
    BlockLoopRecord,
    Controller,
    Regulator,
    eased,
    margins,
    open_loop,
    run_batch,
    wave,
)
from nectosome.drives import Sensor
from nectosome.identification.fits.errors import range_errors

from ..study import Progress, StudyPart, printed
from .comparison import DT, NAMES, VARIABLE, WORDS, actuator, controllers, dead_bands, kept, known_model, plants, tuned
from .plant import BAR, MM

PLANTS, _FEW = 10, 3  # plants
BANDS = 0.04, 0.06, 0.1, 0.16, 0.25, 0.4, 0.6, 1.0, 1.5  # Hz
REFERENCES = {
    "sine": wave("sine", 50.0, DT, amplitude=6 * MM, frequency=0.04),
    "triangle": wave("triangle", 40.0, DT, amplitude=8 * MM, frequency=0.05),
    "variable": VARIABLE,
}
DEAD_BANDS = 0.0, 0.01 * BAR, 0.02 * BAR, 0.03 * BAR  # of a valve, to either side [Pa]
SCORED = 0.02 * BAR  # the one with which the printed error along the sine comes out
_RUNS = 5  # of learning, after the first


def part(quick: bool, progress: Progress) -> StudyPart:
    """Errors along the references of the paper, and by frequency; `quick` takes kept gains, few plants and no bands."""
    loops, late = plants(_FEW if quick else PLANTS), dead_bands(DEAD_BANDS)
    progress("tuning", 0.0)
    laws = controllers(kept() if quick else tuned(), known_model())
    numbers: dict[str, float | None] = {}
    series, turning = [], []
    for k, (name, reference) in enumerate(REFERENCES.items()):
        progress(name, 0.4 + 0.15 * k)
        row = f"fishtail/tracking/{name}"
        found = {one: simulated(loops, laws[one], reference) for one in NAMES}
        for one in NAMES:
            numbers |= _rows(f"{row}/{one}", errors(found[one], reference))
        series.append(_series(name, reference, found))
        each = _each(simulated(late, laws["pid"], reference), reference)
        numbers |= _rows(f"{row}/pid-model", each[DEAD_BANDS.index(0.0)])
        numbers |= _rows(f"{row}/pid-dead-band/{SCORED / BAR:g}bar", each[DEAD_BANDS.index(SCORED)])
        turning.append(each)
    data = {
        "fishtail_tracks": xr.concat(series, "reference", join="outer"),
        "fishtail_dead_bands": _dead_bands(turning),
        "fishtail_margins": _margins(laws),
    }
    if not quick:
        progress("bands", 0.85)
        data["fishtail_bands"] = bands(loops, laws)
    return StudyPart(numbers, data)


def model_loop() -> BlockLoop:
    """The model itself in a loop, without noise."""
    return BlockLoop(actuator(), Sensor(*(jnp.asarray(x) for x in (0.0, -1.0, 1.0))), DT)


def simulated(loops: BlockLoop, law: Controller, reference: Float[np.ndarray, "n"]) -> BlockLoopRecord:
    """Records of the loops; of a learning controller after its last run."""
    record = run_batch(loops, law.planned(reference, DT), reference)
    for _ in range(_RUNS * law.learns):
        loops = eqx.tree_at(lambda one: one.sensor.seed, loops, loops.sensor.seed + 1000)
        record = run_batch(loops, _learned(law, record, reference), reference, own=True)
    return record


def errors(record: BlockLoopRecord, reference: Float[np.ndarray, "n"]) -> tuple[float, float]:
    """e_rmsp and e_mp of the true displacement, means over the plants [percent of the reference's range]."""
    rms, largest = np.mean(_each(record, reference), axis=0)
    return float(rms), float(largest)


def bands(loops: BlockLoop, laws: dict[str, Controller]) -> xr.Dataset:
    """e_rmsp by frequency, along sines of 6 mm that grow within two periods, or half of the time."""
    found = []
    for frequency in BANDS:
        reference = eased(
            wave("sine", 1 / BANDS[0], DT, amplitude=6 * MM, frequency=frequency),
            min(2 / frequency, 0.5 / BANDS[0]),
            DT,
        )
        found.append([errors(simulated(loops, laws[name], reference), reference)[0] for name in NAMES])
    coords = {"frequency": ("frequency", list(BANDS), {"units": "Hz"}), "controller": list(NAMES)}
    errors_of = (("frequency", "controller"), found, {"units": "percent"})
    return xr.Dataset({"error": errors_of}, coords, {"least": _least(np.array(found))})


def _least(found: Float[np.ndarray, "frequency controller"]) -> str:
    """Which controller has the least error at which frequency, in words."""
    best = [WORDS[NAMES[k]] for k in found.argmin(axis=1)]
    if len({*best}) == 1:
        return f"{best[0]} throughout"
    at = {name: [f"{f:g} Hz" for f, one in zip(BANDS, best, strict=True) if one == name] for name in best}
    return "; ".join(f"{name} at {', '.join(frequencies)}" for name, frequencies in at.items())


def _each(record: BlockLoopRecord, reference: Float[np.ndarray, "n"]) -> Float[np.ndarray, "loops 2"]:
    """e_rmsp and e_mp of each loop [percent of the reference's range]."""
    return np.array([range_errors(one, reference) for one in np.asarray(record.output)])


def _rows(row: str, both: Sequence[float] | Float[np.ndarray, "2"]) -> dict[str, float]:
    return {f"{row}/e_rmsp": float(both[0]), f"{row}/e_mp": float(both[1])}


def _dead_bands(found: list[Float[np.ndarray, "bands 2"]]) -> xr.Dataset:
    """Errors of the paper's PID by reference and dead band, and what the paper prints; their rows in turn."""
    over = ("reference", "band", "error")
    names = ("e_rmsp", "e_mp")
    book = printed("fishtail")
    theirs = [[book[f"fishtail/tracking/{name}/pid-model/{key}"]["printed"] for key in names] for name in REFERENCES]
    return xr.Dataset(
        {"found": (over, found, {"units": "percent"}), "printed": (("reference", "error"), theirs)},
        {"reference": [*REFERENCES], "band": ("band", list(DEAD_BANDS), {"units": "Pa"}), "error": [*names]},
    )


@eqx.filter_jit
def _learned(law: Controller, record: BlockLoopRecord, reference: Float[np.ndarray, "n"]) -> Regulator:
    """Regulator of each loop after a run."""
    return eqx.filter_vmap(lambda one: law.after(one, DT).planned(reference, DT))(record)


def _series(name: str, reference: Float[np.ndarray, "n"], found: dict[str, BlockLoopRecord]) -> xr.Dataset:
    """Reference and displacement of the first plant."""
    outputs = [np.asarray(record.output)[0] for record in found.values()]
    return xr.Dataset(
        {
            "target": ("time", reference, {"units": "m"}),
            "displacement": (("controller", "time"), outputs, {"units": "m"}),
        },
        {
            "time": ("time", DT * np.arange(len(reference)), {"units": "s"}),
            "controller": list(found),
            "reference": name,
        },
    )


def _margins(laws: dict[str, Controller]) -> xr.Dataset:
    """Margins of gain, phase and delay, for small commands and for half of the range."""
    loop, sizes = model_loop(), (0.05 * BAR, 0.3 * BAR)
    some = {name: law for name, law in laws.items() if not law.learns}
    found = np.array([[margins(*open_loop(loop, law, size))[:3] for size in sizes] for law in some.values()])
    coords = {"controller": list(some), "amplitude": ("amplitude", list(sizes), {"units": "Pa"})}
    units = {"gain": "1", "phase": "rad", "delay": "s"}
    over = ("controller", "amplitude")
    columns = {one: (over, found[..., k], {"units": unit}) for k, (one, unit) in enumerate(units.items())}
    return xr.Dataset(columns, coords)
