"""Intervals of predictions against closed forms: a body that sinks, whose speed is sqrt(2 F / (rho CdA))."""

import json
import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from tests.designs.test_sweep import SINKING

from nectosome.description import numeric_values, parse_robot, with_values
from nectosome.description.uncertainty import SIGMAS, Source
from nectosome.designs.prediction_intervals import HIGH, LEFT_OUT, LOW, Draws, Key, widened
from nectosome.designs.sweep import intervals_of, sweep
from nectosome.designs.uncertain_runs import places, spread, with_left_open
from nectosome.units import InputError

BODY = SINKING[: SINKING.index("aliases")]
KNOWN = BODY[: BODY.index("  loads")]
FIN = """
name: fin
limbs:
  fin:
    kind: rigid
    shape: box
    length: 50 mm
    width: 2 mm
    height: 150 mm
    density: 1000 kg/m3
    joint: {kind: revolute, axis: z, stiffness: 0.1 N m/rad}
    loads: {foil: {kind: foil, span_along: z, ahead: -x, chord: 50 mm}}
"""
SPREAD = 0.2
STATED = SINKING.replace("0.01 m2]", "0.01 m2 +- 20 %]")
SPEED = math.sqrt(2 * (2 - 1) * 9.81 / (1000 * 0.01))
SIGMA = math.log1p(SPREAD) / SIGMAS  # of the logarithm of the drag area
NORMAL = NormalDist()


@pytest.fixture(scope="module")
def sinking():
    return parse_robot(STATED)


@pytest.fixture(scope="module")
def found(sinking):
    return spread(sinking, "steady", draws=40)


def number(found, name):
    return next(k for k, key in enumerate(found.keys) if key.name == name)


def test_the_speed_of_a_body_that_sinks_has_the_interval_of_its_drag(found):
    k = number(found, "velocity, size")
    assert found.values[0, k] == pytest.approx(SPEED, rel=1e-9)
    each = SPEED * np.exp(-0.5 * SIGMA * found.places[:, 0])
    assert found.values[:, k] == pytest.approx(each, rel=1e-9)
    ends = [SPEED * math.exp(0.5 * SIGMA * NORMAL.inv_cdf(q)) for q in (LOW, HIGH)]
    # a stratum of the hypercube is 1/40 wide in probability: so far an end may be off
    slack = 0.5 * SIGMA * SPEED / 40 / NORMAL.pdf(NORMAL.inv_cdf(LOW))
    assert found.drawn[:, k] == pytest.approx(ends, abs=slack)


def test_what_models_leave_out_is_in_the_intervals_of_what_depends_on_the_water(found):
    more = NORMAL.inv_cdf(HIGH) * LEFT_OUT
    for middle in (0.5, -0.5):
        ends = np.sort(middle * np.exp([-0.3, 0.3]))[:, None]
        wide = widened(ends).ravel()
        assert np.abs(np.log(wide / middle)) == pytest.approx([math.hypot(0.3, more)] * 2, rel=1e-12)
        assert wide[0] < middle < wide[1]
    across = widened(np.array([[-0.3], [0.5]])).ravel()
    assert across == pytest.approx(0.1 + np.array([-1, 1]) * math.hypot(0.4, 0.5 * more), rel=1e-12)
    assert widened(np.array([[0.0], [0.5]]))[0] == 0  # a share is not below it
    known = np.array([[2.0], [2.0]])
    assert widened(known) == pytest.approx(known, rel=0)
    k = number(found, "velocity, size")
    assert found.wet[k]
    assert found.ends[:, k] == pytest.approx(widened(found.drawn)[:, k], rel=1e-12)


def test_its_only_source_makes_all_of_it(found):
    k = number(found, "velocity, size")
    assert found.shares[0, k] == pytest.approx(1.0, abs=0.01)
    assert found.explained[k] == pytest.approx(1.0, abs=0.01)
    assert "makes 100 % of the variance" in found.advice[0]


def test_a_sweep_has_the_same_draws(sinking, found):
    swept = sweep(sinking, {"body.mass": [2.0, 3.0]}, draws=40)
    k = number(found, "velocity, size")
    assert swept["speed"].sel({"body.mass": 2.0}).values == pytest.approx(found.values[:, k], rel=1e-6)
    value, low, high = intervals_of(swept, swept["speed"])
    assert value.values == pytest.approx([SPEED, math.sqrt(2) * SPEED], rel=1e-6)
    assert [low.values[0], high.values[0]] == pytest.approx(found.ends[:, k], rel=1e-6)


def test_an_axis_of_a_sweep_is_set_in_all_draws(sinking):
    swept = sweep(sinking, {"area": [0.01, 0.04]}, draws=8)
    assert np.ptp(swept["speed"].values, axis=1) == pytest.approx(0.0, abs=1e-12)


def test_places_are_one_in_each_stratum_and_correlated_as_asked():
    alone = places(50, np.eye(3), 1)
    assert not alone[0].any()
    strata = np.sort(np.vectorize(NORMAL.cdf)(alone[1:]) * 50, axis=0)
    assert (np.floor(strata) == np.arange(50)[:, None]).all()
    matrix = np.array([[1.0, -0.9, 0.0], [-0.9, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = places(4000, matrix, 1)[1:]
    assert np.corrcoef(found.T) == pytest.approx(matrix, abs=0.04)  # 2.5 standard errors of a correlation
    assert found[:, 2] == pytest.approx(places(4000, np.eye(3), 1)[1:, 2], abs=1e-12)


def test_what_a_foil_leaves_open_is_drawn_unless_its_planform_changes():
    fin = parse_robot(FIN)
    load = "limbs.fin.loads.foil"
    filled = numeric_values(with_left_open(fin))
    assert filled[f"{load}.aspect_ratio"] == pytest.approx(3.0, rel=1e-12)
    assert filled[f"{load}.broadside_drag"] == pytest.approx(1.11 + 0.018 * 3, rel=1e-12)  # Viterna and Corrigan
    wider = with_values(fin, {f"{load}.chord.0": 0.06})
    assert with_left_open(fin, [wider]) == fin
    faster = with_values(fin, {f"{load}.stall": 0.2})
    assert with_left_open(fin, [faster]) == with_left_open(fin)


def draws_of(values, given, correlations=None):
    """Draws of sources whose numbers are already there, the file's own run first."""
    told = {"why": "", "experiment": "measure it", "dimension": "number", "of_water": False}
    source = Source("s", {"p": 1.0}, 0.1, 0.1, 0.0, **told, least=-math.inf, most=math.inf)
    matrix = np.eye(given.shape[1]) if correlations is None else correlations
    status = ("SOLVED",) * len(values)
    return Draws(
        "t", (source,) * given.shape[1], matrix, given, status, (Key("t", "t", "y", "m"),), values[:, None], {}
    )


def test_shares_are_the_sobol_indices_of_a_linear_model():
    given = places(200, np.eye(3), 3)
    found = draws_of(given @ [3.0, 1.0, 0.0], given)
    assert found.shares[:, 0] == pytest.approx([0.9, 0.1, 0.0], abs=1e-9)
    assert found.explained == pytest.approx([1.0], abs=1e-9)
    half = 1.2815515655446004 * math.sqrt(10)
    assert found.ends[:, 0] == pytest.approx([-half, half], rel=0.1)  # not of the water
    assert found.unsure[0] < 0.1


def test_correlated_sources_share_what_they_make_together():
    matrix = np.array([[1.0, -0.8], [-0.8, 1.0]])
    given = places(400, matrix, 3)
    found = draws_of(given @ [1.0, 1.0], given, matrix)
    assert found.shares[:, 0] == pytest.approx([0.5, 0.5], abs=1e-9)
    assert found.ends[1, 0] == pytest.approx(1.2815515655446004 * math.sqrt(2 * (1 - 0.8)), rel=0.1)


def test_noise_is_given_to_no_source():
    given = places(60, np.eye(5), 3)
    noise = np.random.default_rng(5).normal(size=61)
    found = draws_of(noise, given)
    assert found.explained[0] < 0.2
    assert found.shares.max() < 0.1


def test_uncertain_runs_without_a_run_are_left_out_and_too_few_have_no_shares():
    given = places(8, np.eye(6), 3)
    found = draws_of(given[:, 0], given)
    assert np.isnan(found.shares).all()
    lost = replace(found, status=("SOLVED", *("NO_PERIOD",) * 8))
    assert np.isnan(lost.ends).all()


def test_an_interval_of_a_factor_is_called_useless():
    given = places(40, np.eye(1), 3)
    assert draws_of(np.exp(1.0 * given[:, 0]), given).useless
    assert not draws_of(np.exp(0.3 * given[:, 0]), given).useless


def test_it_goes_on_from_the_draws_that_are_kept(sinking, found, tmp_path):
    told = []

    def cancel(what, share):
        told.append(share)
        return share < 0.4

    folder = tmp_path / "parts"
    assert spread(sinking, "steady", draws=40, folder=folder, progress=cancel, workers=1) is None
    kept = {path.name: path.stat().st_mtime_ns for path in folder.glob("part-*.npz")}
    assert 1 < len(kept) < 41
    again = spread(sinking, "steady", draws=40, folder=folder)
    assert again.values == pytest.approx(found.values, rel=1e-12, nan_ok=True)  # of other compilations
    assert all((folder / name).stat().st_mtime_ns == time for name, time in kept.items())
    with pytest.raises(InputError, match="holds parts of another computation"):
        spread(sinking, "steady", draws=41, folder=folder)


def test_what_the_model_of_the_file_leaves_out_is_told():
    syrup = parse_robot(STATED.replace("gravity:", "viscosity: 10 Pa s, gravity:"))
    found = spread(syrup, "steady", draws=8)
    (caution,) = found.cautions
    assert "Reynolds number is 14, its model is made for at least 100" in caution
    assert found.to_dataset().attrs["cautions"] == caution


def test_a_dataset_says_all_of_it(found):
    data = found.to_dataset({"robot": "sinking"})
    assert data.sizes == {"draw": 41, "number": len(found.keys), "source": 1}
    assert json.loads(data.attrs["provenance"])["settings"]["robot"] == "sinking"
    assert list(data["unit"].sel(number="body: velocity, size").values.ravel()) == ["m/s"]


@pytest.mark.parametrize(
    ("text", "options", "why"),
    [
        (KNOWN, {}, "all of it is known exactly"),
        (STATED, {"draws": 3}, "draws"),
        (STATED, {"verb": "static"}, "no verb with a spread"),
    ],
)
def test_what_has_no_interval_is_refused(text, options, why):
    with pytest.raises(InputError, match=why):
        spread(parse_robot(text), **{"verb": "steady", **options})


def test_a_robot_whose_file_has_no_such_run_is_refused():
    falling = BODY.replace("[0 m2, 0 m2, 0.01 m2]", "[0.01 m2, 0 m2, 0 m2]")
    with pytest.raises(InputError, match="The robot of the file itself needs such a run"):
        spread(parse_robot(falling), "steady", draws=8)


DRY = """
name: dry arm
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  volume: 0 m3
  joint:
    {kind: revolute, axis: z, damping: 10 mN m s/rad +- 1 %, motion: {kind: sine, amplitude: 10 deg, frequency: 1 Hz}}
aliases: {A: body.joint.motion.amplitude}
"""


def test_what_has_nothing_of_the_water_is_not_widened_in_a_sweep_either():
    """Mean power c (A w)^2 / 2: as uncertain as the damping."""
    swept = sweep(parse_robot(DRY), {"A": ["10deg"]}, draws=20)
    value, low, high = (float(x.squeeze()) for x in intervals_of(swept, swept["power"]))
    power = 0.5 * 0.01 * (math.radians(10) * 2 * math.pi) ** 2
    assert value == pytest.approx(power, rel=1e-4)
    assert 0.99 * power < low < value < high < 1.01 * power


def test_an_axis_may_be_a_frequency_that_is_not_known_exactly():
    uncertain = parse_robot(DRY.replace("frequency: 1 Hz", "frequency: 1 Hz +- 5 %"))
    swept = sweep(uncertain, {"body.joint.motion.frequency": ["1Hz", "2Hz"]}, draws=8)
    assert swept["period"].values == pytest.approx(np.array([[1.0] * 9, [0.5] * 9]), rel=1e-12)
    with pytest.raises(InputError, match="one period for all draws"):
        sweep(uncertain, {"A": ["10deg"]}, draws=8)


@pytest.mark.slow
def test_draws_that_leave_the_plane_are_solved_in_space():
    """A part that is screwed on askew: the sweep has the power that each robot has alone."""
    askew = (
        DRY.split("aliases")[0].replace(" +- 1 %", "")
        + """
limbs:
  second:
    {kind: rigid, shape: point, on: body, mass: 0.2 kg, offset: [100 mm, 0 mm, 0 mm], volume: 0 m3,
     inertia: [1e-4 kg m2, 2e-4 kg m2, 2e-4 kg m2], centre_of_mass: [50 mm, 0 mm, 0 mm],
     rotation: [0 deg +- 60 deg, 0 deg, 0 deg],
     joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz, phase: 90 deg}}}
aliases: {A: body.joint.motion.amplitude}
"""
    )
    robot = parse_robot(askew)
    swept = sweep(robot, {"A": ["10deg"]}, draws=8)
    alone = spread(robot, "periodic", draws=8)
    k = next(k for k, key in enumerate(alone.keys) if key.name == "body.angle, largest")
    torque = swept["reaction_peak"].squeeze().isel(prescribed=0).values
    assert np.ptp(alone.values[:, k]) > 0.01 * alone.values[0, k]
    assert torque == pytest.approx(alone.values[:, k], rel=2e-3)  # largest of other samples


def test_sources_that_are_nearly_one_share_what_they_make():
    matrix = np.array([[1.0, 0.999, 0.0], [0.999, 1.0, 0.0], [0.0, 0.0, 1.0]])
    explained = []
    for seed in range(20):
        given = places(40, matrix, seed)
        explained.append(draws_of(given[:, 0] + given[:, 1] + 0.5 * given[:, 2] ** 2, given, matrix).explained[0])
    assert np.mean(explained) == pytest.approx(4 / 4.5, abs=0.06)  # 4 of the sum, 0.5 of the square
    one = np.ones((2, 2))
    given = places(40, one, 1)
    assert draws_of(given.sum(axis=1), given, one).shares[:, 0] == pytest.approx([0.5, 0.5], abs=1e-6)


@pytest.mark.parametrize("options", [{"until": len}, {"seed": -1}, {"seed": "a"}])
def test_options_that_make_no_sense_are_refused(sinking, options):
    with pytest.raises(InputError):
        spread(sinking, "steady", draws=8, **options)
