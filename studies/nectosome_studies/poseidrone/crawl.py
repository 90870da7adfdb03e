"""Crawling: parameters from four features of the gait, their identifiability, and other densities and buoyancies.

The legs' geometry is not printed: that of `poseidrone_crawl.yaml` is one with which Table 3's features come out.
"""

import math
from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.core import REFERENCE_DENSITY
from nectosome.description import RobotDescription, get_value
from nectosome.description.variables import read_variable
from nectosome.identification import Identifiability, Misfit, identifiability, most_helpful, profile
from nectosome.identification.gait.fit import GaitFit, GaitResult, GaitTrial, gait_optimiser
from nectosome.identification.gait.walks import FEATURES, Walks, discrepancy
from nectosome.robots import describe
from nectosome.search import Start, minimise

from ..study import Progress, StudyPart
from .swim import of_statistics

# amplitude [m], frequency [Hz], speed [m/s], height [m] of the experiments (section 4.3)
TARGET = 0.0074045, 1.9831, 0.0403, 0.1272
FOUND = 0.0074043, 1.9829, 0.040302, 0.12719  # by the paper's genetic algorithm (section 4.4)
PRINTED = 2.012e-8  # discrepancy of what it found
MASS, WATER = 0.755, 1025.0  # kg, kg/m3
DENSE = WATER / REFERENCE_DENSITY
BOX = {  # Table 3; damping from 0.01, since a leg without any never comes to rest
    "k": "25 N/m .. 400 N/m",
    "d_r": "0.01 .. 1.5",
    "mu_s": "0.6 .. 0.9",
    "mu_d": "0.6 .. 0.9",
    "m_a": "0.755 kg .. 7.55 kg",
    "J": "3e-4 kg m2 .. 0.018 kg m2",
    "drag_area": f"{0.11 / WATER} m2 .. {145 / WATER} m2",
    "rotational_drag": f"{1e-4 / DENSE} kg m2 .. {1 / DENSE} kg m2",
    "lambda_t": "0 kg/m .. 0.08 kg/m",
    "lambda_n": "0 kg/m .. 0.3 kg/m",
}
ROWS = ("k", "dr", "mu_s", "mu_d", "m_ac", "J", "Lambda_t", "Lambda_r", "lambda_t", "lambda_n")
SEEDS, WALKS, CLOSE = 5, 3000, 1e-6  # searches, evaluations of each at most, and a discrepancy that counts as found
DENSITIES = (1100.0, 1140.0, 1178.0, 1238.0, 1300.0)  # kg/m3
DISTANCES, ANGLES = (0.05, 0.07, 0.09, 0.11, 0.13), (0.0, 6.3, 12.6, 18.9, 25.2)  # b [m], beta [deg]
OWN, HELD_OUT = (1238.0, 0.09, 12.6), 1178.0
_MODULE = ("volume", "limbs.module.offset.0", "limbs.module.offset.2")
_ERRORS = 1e-3, 1e-3, math.radians(1.0)  # standard errors of tracked surge and heave [m], and tilt
_TRACK, _TILT = (0, 1), (2,)  # of these: in tracks of the body, and its tilt
_PROFILED = "k"  # the parameter whose profile is drawn: fits of the other nine at each of its values take minutes
_RARELY = 0.05  # of the time: feet that are on the ground for less do not carry


def module(density: float, distance: float, angle: float) -> dict[str, float]:
    """Quantities of the buoyancy module at a mean density [kg/m3], a distance [m] and an angle [deg]."""
    beta = math.radians(angle)
    return dict(zip(_MODULE, (MASS / density, distance * math.sin(beta), distance * math.cos(beta)), strict=True))


def fit() -> GaitFit:
    """The crawler, Table 3's unknowns, and features at 1238 kg/m3."""
    description = describe("poseidrone_crawl")
    variables = tuple(read_variable(name, span, description) for name, span in BOX.items())
    return GaitFit(description, variables, (GaitTrial(TARGET, module(*OWN)),))


def part(quick: bool, progress: Progress) -> StudyPart:
    """Fits from several seeds, identifiability, the density held out, and gaits over density and buoyancy."""
    of = fit()
    seeds = 1 if quick else SEEDS
    searches: list[Start] = []
    for seed in range(seeds):

        def tell(done: int, best: float, seed: int = seed) -> None:
            progress(f"crawling, search {seed + 1} of {seeds}: {best:.1e}", 0.8 * (seed + done / WALKS) / seeds)

        aim = CLOSE if quick else PRINTED
        searches.append(minimise(of.task(), gait_optimiser(evaluations=WALKS), seed=seed, target=aim, progress=tell))
    best = of.ranges.values(np.stack([found.close(np.inf)[0].u for found in searches]))
    progress("identifiability", 0.8)
    measured = _measured(of, best[0])
    identifiable = {name: identifiability(misfit, best[0]) for name, misfit in measured.items()}
    known = identifiable["features"]
    data = {
        f"crawl_fit_{seed}": GaitResult(of, found, of.walked(row[None]), known, 10 * CLOSE).to_dataset()
        for seed, (found, row) in enumerate(zip(searches, best, strict=True))
    }
    data["crawl_told"] = _identifiable_data(identifiable)
    data["crawl_helpful"] = _helpful(of, best[0], identifiable["features"])
    data["crawl_held_out"] = _held_out_series(of, best)
    if not quick:
        data["crawl_profile"] = _profiles(measured, best[0], progress)
    progress("gaits", 0.95)
    data["crawl_gaits"] = gaits(of.description)
    return StudyPart(_numbers(of, searches, best, identifiable, data["crawl_gaits"]), data)


def gaits(robot: RobotDescription) -> xr.Dataset:
    """Speed [m/s], NaN where it falls, and which feet carry, over density [kg/m3], distance b [m], angle beta [rad]."""
    grid = [*product(DENSITIES, DISTANCES, ANGLES)]
    found = Walks(robot, _MODULE)(np.array([[*module(*each).values()] for each in grid]))
    shape = len(DENSITIES), len(DISTANCES), len(ANGLES)
    stands = np.isinf(found.fell)
    carries = found.duty > _RARELY
    over = ("density", "distance", "angle")
    return xr.Dataset(
        {
            "speed": (over, np.where(stands, found.gait[:, 2], np.nan).reshape(shape), {"units": "m/s"}),
            "feet": (over, np.where(stands, 2 * carries.sum(axis=1), 0).reshape(shape)),
            "duty": ((*over, "pair"), found.duty.reshape(*shape, 2)),
        },
        {
            "density": ("density", np.array(DENSITIES), {"units": "kg/m3"}),
            "distance": ("distance", np.array(DISTANCES), {"units": "m"}),
            "angle": ("angle", np.radians(ANGLES), {"units": "rad"}),
            "pair": ["front", "rear"],
        },
    )


def _measured(of: GaitFit, theta: Float[np.ndarray, "n"]) -> dict[str, Misfit]:
    """Features; heave and surge over time; these with tilt, and at a second density too."""
    return {
        "features": of.misfit,
        "series": _series(of, theta, OWN[:1], _TRACK),
        "both": _series(of, theta, (OWN[0], HELD_OUT), _TRACK + _TILT),
    }


def _at(of: GaitFit, densities: Sequence[float]) -> GaitFit:
    """The same unknowns, in trials at other densities [kg/m3]."""
    trials = tuple(GaitTrial(of.trials[0].target, module(rho, *OWN[1:])) for rho in densities)
    return GaitFit(of.description, of.variables, trials)


def _series(of: GaitFit, theta: Float[np.ndarray, "n"], densities: Sequence[float], columns: tuple[int, ...]) -> Misfit:
    """Surge, heave or tilt over time less those at theta, in their standard errors, at some densities [kg/m3]."""
    several = _at(of, densities)

    def seen(rows: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m r"]:
        series = [one.series[:, :, columns] / np.array(_ERRORS)[[*columns]] for one in several.walked(rows)]
        return np.concatenate([x.reshape(len(rows), -1) for x in series], axis=1)

    data = seen(theta[None])
    return Misfit(lambda rows: seen(rows) - data, of.ranges, step=of.misfit.step)


def _profiles(measured: dict[str, Misfit], theta: Float[np.ndarray, "n"], progress: Progress) -> xr.Dataset:
    """Rise of chi2 over the stiffness of the legs, all other parameters fitted anew, by what is measured."""
    found = []
    for k, (name, misfit) in enumerate(measured.items()):
        progress(f"profile of {_PROFILED} by {name}", 0.82 + 0.04 * k)
        found.append(profile(misfit, theta, _PROFILED))
    longest = max(one.values.size for one in found)

    def rows(parts: Sequence[Float[np.ndarray, "k"]]) -> Float[np.ndarray, "d p"]:
        return np.stack([np.pad(x, (0, longest - x.size), constant_values=np.nan) for x in parts])

    return xr.Dataset(
        {
            "value": (("data", "point"), rows([one.values for one in found]), {"units": "N/m"}),
            "rise": (("data", "point"), rows([one.rise for one in found])),
            "words": ("data", [one.interval.text for one in found]),
        },
        {"data": list(measured)},
        {"parameter": _PROFILED},
    )


def _helpful(of: GaitFit, theta: Float[np.ndarray, "n"], known: Identifiability) -> xr.Dataset:
    """How many more parameters further measurements would identify, in parts."""
    found = most_helpful(
        known,
        {
            f"features at {HELD_OUT:.0f} kg/m3": _at(of, (HELD_OUT,)).misfit,
            "heave and surge over time": _series(of, theta, OWN[:1], _TRACK),
            "tilt over time": _series(of, theta, OWN[:1], _TILT),
            f"heave and surge at {HELD_OUT:.0f} kg/m3": _series(of, theta, (HELD_OUT,), _TRACK),
        },
    )
    return xr.Dataset(
        {"gain": ("measurement", [one.gain for one in found]), "words": ("measurement", [one.text for one in found])},
        {"measurement": [one.name for one in found]},
        {"parameters": known.parameters},
    )


def _held_out_series(of: GaitFit, best: Float[np.ndarray, "s n"]) -> xr.Dataset:
    """Surge and heave [m] of all fits over the last window at the density held out, as in Fig. 12."""
    series = _at(of, (HELD_OUT,)).walked(best)[0].series
    time = np.linspace(0.0, of.window, series.shape[1])
    names = ("x", "z")
    return xr.Dataset(
        {name: (("fit", "time"), series[:, :, k], {"units": "m"}) for k, name in enumerate(names)},
        {"time": ("time", time, {"units": "s"})},
    )


def _identifiable_data(identifiable: dict[str, Identifiability]) -> xr.Dataset:
    names = next(iter(identifiable.values())).ranges.names
    return xr.Dataset(
        {
            "error": (("data", "parameter"), np.stack([one.errors for one in identifiable.values()])),
            "rank": ("data", [one.rank for one in identifiable.values()]),
            "words": ("data", ["; ".join(one.words()) for one in identifiable.values()]),
        },
        {"data": list(identifiable), "parameter": list(names)},
    )


def _numbers(
    of: GaitFit,
    searches: list[Start],
    best: Float[np.ndarray, "s n"],
    identifiable: dict[str, Identifiability],
    gaits_: xr.Dataset,
) -> dict[str, float | None]:
    values = np.array([found.value for found in searches])
    enough = [int(np.argmax(found.values <= CLOSE)) + 1 for found in searches if found.value <= CLOSE]
    scale = np.array([{"drag_area": WATER, "rotational_drag": DENSE}.get(name, 1.0) for name in of.ranges.names])
    printed = discrepancy(np.array(FOUND), np.array(TARGET), np.array(np.inf), of.seconds)
    return {
        "poseidrone/eq13/printed": float(printed),
        "poseidrone/crawl/fit/discrepancy": float(np.median(values)),
        "poseidrone/crawl/fit/share": 100 * len(enough) / len(searches),
        "poseidrone/crawl/fit/evaluations": float(np.median(enough)) if enough else None,
        "poseidrone/crawl/fit/spread": spread(of.ranges.places(best)),
        **{f"poseidrone/table3/{row}": float(x) for row, x in zip(ROWS, best[0] * scale, strict=True)},
        **{
            f"poseidrone/crawl/holdout/{row}": x
            for row, x in zip(("a", "f", "speed", "height"), _held_out(of, best), strict=True)
        },
        **{f"poseidrone/crawl/identifiable/{what}": float(one.rank) for what, one in identifiable.items()},
        "poseidrone/gait/faster": faster(gaits_),
        **{f"poseidrone/table4/{which}/{what}": None for which in ("train", "test") for what in ("mean", "std", "max")},
        **_alike(of, best[0]),
        "poseidrone/eq10/first-leg": 1,
    }


def faster(gaits_: xr.Dataset) -> float:
    """Share of the gaits that do not fall which are faster than what the paper calls its fastest [percent]."""
    own = gaits_["speed"].sel(density=OWN[0], distance=OWN[1]).isel(angle=ANGLES.index(OWN[2]))
    stands = gaits_["speed"].notnull()
    return 100 * float((gaits_["speed"] > own).sum() / stands.sum())


def _alike(of: GaitFit, theta: Float[np.ndarray, "n"]) -> dict[str, float | None]:
    """What Table 4 is of a walk with Table 3's parameters, as if recorded, and with those of a fit, along x."""
    own = [float(get_value(of.description, name)) for name in of.ranges.names]
    numbers: dict[str, float | None] = {}
    walks = zip(("train", "test"), _at(of, (OWN[0], HELD_OUT)).walked(np.stack([own, theta])), strict=True)
    for which, walked in walks:
        recorded, computed = walked.series[:, :, 0]
        off = of_statistics(computed, recorded)
        numbers |= {f"poseidrone/crawl/statistics/{which}/{name}": x for name, x in off.items()}
    return numbers


def spread(places: Float[np.ndarray, "searches n"]) -> float | None:
    """Of the parameter that differs most between searches, from least to most, in percent of its range."""
    return 100 * float(np.ptp(places, axis=0).max()) if len(places) > 1 else None


def _held_out(of: GaitFit, best: Float[np.ndarray, "s n"]) -> list[float | None]:
    """By how much predictions of equally good fits differ at the density held out: median over pairs [percent]."""
    if len(best) < 2:
        return [None] * len(FEATURES)
    (walked,) = _at(of, (HELD_OUT,)).walked(best)
    pairs = [100 * np.abs(a / b - 1) for a, b in combinations(walked.gait, 2)]
    return np.median(pairs, axis=0).tolist()
