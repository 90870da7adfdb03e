"""Sim-to-real correction of the paddle's mean thrust (sections 4.1 to 4.3), on synthetic experiments (`truths`).

Of the 110 points of the grid a share r is measured, spread evenly (eq. 18). Each measured value has normal noise of
2 %, or none; a method is judged by all 110, measured likewise, as the paper's is by its experiments, but for points of
less than 1 % of the largest thrust. Intervals are held against what is true where nothing was measured.
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int

from nectosome.description import get_value
from nectosome.identification import (
    Aim,
    Experiments,
    GridTable,
    ParameterEstimate,
    SimToReal,
    errors_of,
    next_experiments,
    table_of,
    uniform_plan,
)
from nectosome.robots import describe

from .truths import HELD_OUT

SCORED = ("cn", "svd", "cn-svd", "cn-gp")
METHODS = (*SCORED, "cn-svd-raw", "affine", "thin-plate", "gp")
RATIOS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25)
_TOLD = (0.05, 0.25)  # of these in the scorecard
NOISE = 0.02
MAPPED = 0.3  # the share that Fig. 5 shows
_FIRST, _LAST = 4, 16  # experiments before, and after, they are planned one by one


class SyntheticCampaign(NamedTuple):
    """Experiments at all points of a truth's grid."""

    table: GridTable  # of the model
    true: Float[np.ndarray, "n"]  # mean thrust
    mean: Float[np.ndarray, "n"]  # as measured
    peak: Float[np.ndarray, "n"]
    noise: float  # relative

    def at(self, rows: Int[np.ndarray, "m"]) -> Experiments:
        """Those that were made."""
        points, mean = self.table.points[rows], self.mean[rows]
        cn = drag_coefficient(self.peak[rows], points[:, 0], points[:, 1])
        return Experiments(
            points, mean, self.noise * np.abs(mean), ParameterEstimate(cn, self.noise * np.abs(cn), apart=True)
        )

    def rows(self, share: float) -> Int[np.ndarray, "m"]:
        """A share of the points, spread evenly."""
        points = self.table.points
        return uniform_plan(self.table.in_box(points), round(share * len(points)))


def drag_coefficient(
    peak: Float[np.ndarray, "n"], amplitude: Float[np.ndarray, "n"], frequency: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "n"]:
    r"""Cn from the peak thrust of a stroke, when the stretched blades go through the middle at their fastest.

    $$ C_n = \frac{6 F_{pk}}{\rho w (2 \pi f A)^2 (r_2^3 - r_1^3)} $$

    with the blades' inner and outer radius: eq. 17 in integral form (what is printed there mixes up positions and
    lengths). F must be free of the blows at the stops: behind a low pass, or the water's force alone.
    """
    robot = describe("paddle")
    inner, width = get_value(robot, "limbs.arm.length"), get_value(robot, "limbs.segment1.height")
    outer = inner + sum(get_value(robot, f"limbs.{name}.length") for name in robot.limbs if name.startswith("segment"))
    scale = get_value(robot, "water.density") * width * (outer**3 - inner**3)
    return 6 * peak / (scale * (2 * np.pi * frequency * amplitude) ** 2)


def campaign(simulated: xr.Dataset, truth: xr.Dataset, seed: int, noise: float = NOISE) -> SyntheticCampaign:
    """Experiments on one truth (mean, peak over A and f); the model's mean thrust over Cn too."""
    rng = np.random.default_rng(seed)
    true, peak = (truth[name].transpose("A", "f").to_numpy().ravel() for name in ("mean", "peak"))
    mean, peak = (x * (1 + noise * rng.normal(size=x.size)) for x in (true, peak))
    values = simulated["mean"].transpose("A", "f", "Cn").assign_attrs(units="N")
    return SyntheticCampaign(table_of(values, "Cn", 1.0), true, mean, peak, noise)


def compared(
    simulated: xr.Dataset,
    truths: xr.Dataset,
    methods: Sequence[str],
    seeds: int,
    noises: Sequence[float],
    pool: Executor,
) -> xr.Dataset:
    """Errors [percent] of each method for each share of experiments, over truths, noises and seeds.

    `found` is the true thrust where a method finds the largest, of the largest there is [percent]. Without noise there
    is one seed.
    """
    names = [str(name) for name in truths["truth"].values]
    cases = [(t, n, s) for t, n, s in product(names, noises, range(seeds)) if n or not s]
    waiting = [pool.submit(_judged, campaign(simulated, truths.sel(truth=t), s, n), methods) for t, n, s in cases]
    own = xr.concat([future.result() for future in waiting], "case")
    keys = {k: ("case", list(v)) for k, v in zip(("truth", "noise", "seed"), zip(*cases, strict=True), strict=True)}
    recipes = [str(truths["recipe"].sel(truth=t).item()) for t, _, _ in cases]
    return own.assign_coords({**keys, "recipe": ("case", recipes)})


def _judged(one: SyntheticCampaign, methods: Sequence[str]) -> xr.Dataset:
    """Errors over methods and shares."""
    found = [[_errors(one, method, one.rows(r)) for r in RATIOS] for method in methods]
    names = ("mean", "largest", "signed", "total", "floor", "coverage", "found")
    data = np.array(found)
    return xr.Dataset(
        {name: (("correction", "ratio"), data[:, :, k], {"units": "percent"}) for k, name in enumerate(names)},
        coords={"correction": [*methods], "ratio": [*RATIOS]},
    )


def _errors(one: SyntheticCampaign, method: str, rows: Int[np.ndarray, "m"]) -> tuple[float, ...]:
    found = SimToReal(method).fit(one.table, one.at(rows)).predict(one.table.points)
    e = errors_of(found.mean, one.mean, found.error, one.noise * np.abs(one.mean))
    rest = np.setdiff1d(np.arange(len(one.true)), rows)  # the truth where nothing was measured
    coverage = errors_of(found.mean[rest], one.true[rest], found.error[rest], 0 * one.true[rest]).coverage
    best = 100 * one.true[np.argmax(found.mean)] / one.true.max()
    return e.mean, e.largest, e.signed, e.total, e.floor, coverage, float(best)


def numbers(found: xr.Dataset) -> dict[str, float]:
    """Rows of the scorecard from what `compared` gives, of experiments with noise."""
    noisy = found.isel(case=np.flatnonzero(found["noise"] == NOISE))
    blind = noisy["truth"] == HELD_OUT
    known, unknown, drop = (
        noisy.isel(case=np.flatnonzero(which)) for which in (~blind, blind, noisy["truth"] == "drop")
    )
    rows = {
        "paddle/transfer/start": float(known["mean"].sel(correction="cn", ratio=0.0).median()),
        "paddle/optimum/sim": float(drop["found"].sel(correction="cn", ratio=0.0).median()),
    }
    for how in ("cn-svd", "cn-gp"):
        for r in _TOLD:
            rows[f"paddle/transfer/{how}/r{r:.2f}"] = float(known["mean"].sel(correction=how, ratio=r).median())
        rows[f"paddle/transfer/held-out/{how}"] = float(unknown["mean"].sel(correction=how)[:, 1:].median())
        rows[f"paddle/optimum/{how}"] = float(drop["found"].sel(correction=how, ratio=RATIOS[-1]).median())
    return rows


def mapped(simulated: xr.Dataset, truth: xr.Dataset) -> xr.Dataset:
    """Mean thrust [N] over A and f: simulated, measured, and corrected by each method; and whether it was measured."""
    one = campaign(simulated, truth, 0)
    rows = one.rows(MAPPED)
    found = [SimToReal(method).fit(one.table, one.at(rows)).predict(one.table.points).mean for method in SCORED]
    shape, coords = (truth.sizes["A"], truth.sizes["f"]), {name: truth[name] for name in ("A", "f")}
    values = [one.table.simulated(one.table.points)[0], one.mean, *found]
    made = np.isin(np.arange(len(one.true)), rows).reshape(shape)
    data = xr.Dataset(
        {
            "thrust": (("what", "A", "f"), np.reshape(values, (-1, *shape)), {"units": "N"}),
            "made": (("A", "f"), made),
        },
        coords={**coords, "what": ["simulated", "measured", *SCORED]},
    )
    return data.assign_attrs(ratio=MAPPED)


PLANS: dict[str, Aim | None] = {"uniform": None, "error": "error", "highest": "highest"}


def planned(simulated: xr.Dataset, truths: xr.Dataset, seeds: int, pool: Executor) -> xr.Dataset:
    """Errors of "cn-gp" and what its optimum is worth [percent] as experiments are made one after another.

    Uniform plans, plans for a small error and plans for the largest thrust, over truths and seeds.
    """
    names = [str(name) for name in truths["truth"].values]
    cases = [*product(names, range(seeds), PLANS)]
    waiting = [pool.submit(_followed, campaign(simulated, truths.sel(truth=t), s), plan) for t, s, plan in cases]
    found = np.array([future.result() for future in waiting]).reshape(len(names), seeds, len(PLANS), -1, 3)
    dims = ("truth", "seed", "plan", "count")
    return xr.Dataset(
        {name: (dims, found[..., k], {"units": "percent"}) for k, name in enumerate(("mean", "total", "found"))},
        coords={"truth": names, "plan": [*PLANS], "count": np.arange(_FIRST, _LAST + 1)},
    )


def _followed(one: SyntheticCampaign, plan: str) -> list[tuple[float, float, float]]:
    """Mean and total error, and the optimum's worth, after each experiment of a plan."""
    how, points, out = SimToReal("cn-gp"), one.table.points, []
    rows = uniform_plan(one.table.in_box(points), _LAST)
    made = rows[:_FIRST]
    for count in range(_FIRST, _LAST + 1):
        mean, _, _, total, _, _, best = _errors(one, how.method, made)
        out.append((mean, total, best))
        if count == _LAST:
            break
        if (aim := PLANS[plan]) is None:
            made = rows[: count + 1]
        else:
            (new,) = next_experiments(how, one.table, one.at(made), 1, aim)
            made = np.append(made, np.argmin(np.abs(points - new.conditions).sum(axis=1)))
    return out
