"""Designs of a body that sinks and is not known exactly: V = sqrt(2 (m - displaced) g / (rho A)), m or A off."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import beta
from tests.designs.test_cycle_design import RANGES, power
from tests.designs.test_problem import DISPLACED, SINKER, sinking
from tests.small_robots import DRIVEN, F

from nectosome.description import RobotDescription, get_value, parse_robot, resolve, with_values
from nectosome.description.uncertainty import SIGMAS
from nectosome.designs import Problem, load_problem, read_constraint
from nectosome.designs.robust import LOST, RobustDesign, quantile_error, shares_between, weights_of
from nectosome.designs.uncertain_runs import draws_of
from nectosome.search import Gradient, multistart
from nectosome.units import InputError

DRAG, MASS = "body.loads.drag.drag_area.2", "body.mass"


def robot(drag: str, mass: str) -> RobotDescription:
    """With a spread of both; what is known to a part in 1e9 is as good as known."""
    text = SINKER.replace("1.2e-3 m2", f"1.2e-3 m2 +- {drag}").replace("0.15 kg", f"0.15 kg +- {mass}")
    return parse_robot(text)


OFF_DRAG, OFF_MASS, BOTH = robot("30 %", "1e-7 %"), robot("1e-7 %", "20 %"), robot("30 %", "20 %")
WIDTH = math.log1p(0.3) / SIGMAS  # of the logarithm of the drag area
WORDS = Problem({"m": "0.09 kg .. 0.3 kg", "A": "1e-4 m2 .. 1e-2 m2 log"}, forward="-z", quantile=0.1)
U = np.array([0.4, 0.6])


def factors(description: RobotDescription, path: str, draws: int = 16, seed: int = 1) -> np.ndarray:
    """What a number is off by in each draw."""
    return np.array([values[path] for values in draws_of(description, draws, seed)[1:]]) / get_value(description, path)


def quantile(values: np.ndarray, q: float) -> float:
    return float(np.quantile(values, q, method="median_unbiased"))


def best_of(task: RobustDesign) -> tuple[float, dict[str, float], dict[str, float]]:
    """Objective, outputs and variables of the best design."""
    best = multistart(task, Gradient(), 2, 3, executor=ThreadPoolExecutor(1)).best()[0].best
    assert best is not None
    return best.objective, dict(best.outputs), task.values(best.u)


def limited(*limits: str, **changes) -> Problem:
    return replace(WORDS, keep=tuple(map(read_constraint, limits)), **changes)


@pytest.mark.parametrize("q", [0.1, 0.25, 0.5, 0.9, 0.99])
def test_weights_are_those_of_the_quantile(q):
    values = np.random.default_rng(3).normal(size=16)
    assert weights_of(values, q) @ values == pytest.approx(quantile(values, q), rel=1e-12)


def test_the_standard_error_of_a_median_is_that_of_its_closed_form():
    """1.2533 deviations over the root of k, of normal values; 60 samples of 100."""
    draws = np.random.default_rng(3).normal(size=(60, 100))
    found = np.array([quantile_error(values, 0.5) for values in draws])
    assert found.mean() == pytest.approx(math.sqrt(math.pi / 2) / 10, rel=0.06)
    assert math.isnan(quantile_error(np.array([0.0, np.inf, 1.0, 2.0]), 0.5))


def test_where_a_quantile_lies_is_the_deviation_of_an_order_statistic():
    """The second of 16 independent draws is beta distributed (2, 15); its mean is 2/17."""
    low, high = shares_between(2 / 17, 16)
    assert (high - low) / 2 == pytest.approx(beta(2, 15).std(), rel=1e-12)
    assert shares_between(0.02, 16)[0] == 0.0


def test_quantiles_are_those_of_the_closed_form_and_their_derivatives_those_of_central_differences():
    task = limited("speed <= 1.1 m/s @ 90 %", "speed >= 0.5 m/s").task(BOTH)
    evaluate = task.prepare()
    got = evaluate(U, True, None)
    values = task.values(U)
    speeds = sinking(values["m"] * factors(BOTH, MASS), values["A"] * factors(BOTH, DRAG))
    own = sinking(values["m"], values["A"])
    assert -got.objective == pytest.approx(quantile(speeds, 0.1), rel=1e-9)
    assert got.constraints == pytest.approx([quantile(speeds, 0.9) / 1.1 - 1, 1 - own / 0.5], abs=1e-9)
    assert got.outputs["speed"] == pytest.approx(own, rel=1e-9)
    assert got.outputs["speed, 10 % quantile"] == pytest.approx(quantile(speeds, 0.1), rel=1e-9)
    ends = [[evaluate(U + s * d, False, None) for s in (1e-5, -1e-5)] for d in np.eye(2)]
    np.testing.assert_allclose(got.gradient, [(up.objective - down.objective) / 2e-5 for up, down in ends], rtol=1e-6)
    differences = np.array([(up.constraints - down.constraints) / 2e-5 for up, down in ends]).T
    np.testing.assert_allclose(got.jacobian, differences, rtol=1e-6)


def test_of_designs_that_are_equally_fast_the_one_that_its_mass_changes_least_is_found():
    """At 1.1 m/s by the file, the 10 % quantile is the higher the heavier: by 0.3 kg at the end of the range."""
    objective, outputs, values = best_of(limited("speed <= 1.1 m/s").task(OFF_MASS))
    assert values["m"] == pytest.approx(0.3, rel=1e-6)
    assert outputs["speed"] == pytest.approx(1.1, rel=1e-5)
    area = 2 * (0.3 - DISPLACED) * 9.80665 / (1000 * 1.1**2)
    assert values["A"] == pytest.approx(area, rel=2e-5)
    assert -objective == pytest.approx(quantile(sinking(0.3 * factors(OFF_MASS, MASS), area), 0.1), rel=1e-5)


def test_a_speed_that_is_to_be_met_is_aimed_at_so_that_both_ends_miss_it_alike():
    """2 a V - V^2 is highest at V = a; its 10 % quantile where the V that are off by a factor miss a on both sides."""
    off, a = factors(OFF_DRAG, DRAG) ** -0.5, 1.1
    miss = minimize_scalar(lambda v: -quantile(2 * a * v * off - (v * off) ** 2, 0.1), (0.8, 1.2), tol=1e-12)
    assert abs(miss.x / a - 1) > 5e-3  # the best design is another one than that of a robot that is known
    objective, outputs, _ = best_of(replace(WORDS, maximise="2.2 * speed - speed ** 2").task(OFF_DRAG))
    assert objective == pytest.approx(miss.fun, rel=1e-5)
    assert outputs["speed"] == pytest.approx(miss.x, rel=1e-3)


def test_a_limit_is_kept_with_its_probability():
    """Of 2000 other draws; a stratum of the 16 is 6 % wide in probability: so far the share may be off."""
    *_, values = best_of(limited("speed <= 1.1 m/s @ 90 %", quantile=0.0).task(OFF_DRAG))
    speeds = sinking(values["m"], values["A"] * factors(OFF_DRAG, DRAG, 2000, 7))
    assert (speeds <= 1.1).mean() == pytest.approx(0.9, abs=1 / 16)
    nominal = sinking(values["m"], values["A"])
    assert nominal == pytest.approx(1.1 * math.exp(-0.5 * WIDTH * NormalDist().inv_cdf(0.9)), rel=0.03)


def test_a_draw_without_a_value_is_worse_than_all_others():
    """log(V - V0) is NaN in three draws: the median is that of the others, the 10 % quantile has none."""
    values = WORDS.task(OFF_DRAG).values(U)
    speeds = np.sort(sinking(values["m"], values["A"] * factors(OFF_DRAG, DRAG)))
    least = round(speeds[2:4].mean(), 4)
    words = replace(WORDS, maximise=f"log(speed - {least})")
    got = replace(words, quantile=0.5).task(OFF_DRAG).prepare()(U, False, None)
    assert got.outputs[LOST] == 3
    assert -got.objective == pytest.approx(np.log(speeds[7:9] - least).mean(), rel=1e-7)
    got = words.task(OFF_DRAG).prepare()(U, False, None)
    assert got.reason.startswith(f"3 of 16 draws have no motion: log(speed - {least}) is NaN")


@pytest.mark.slow
def test_draws_of_a_cycle_have_periods_and_powers_of_their_own():
    """Power of a driven oscillator by its transfer function, with frequency, damping and stiffness off."""
    text = DRIVEN.replace(f"{F} Hz", f"{F} Hz +- 5 %")
    task = Problem(RANGES, minimise="power", quantile=0.9).task(with_values(parse_robot(text), {"c": 0.1}))
    u, paths = np.array([0.5, 0.6, 0.4]), [resolve(task.description, name)[0] for name in RANGES]
    off = np.array([factors(task.description, path) for path in paths])

    def robust(u: np.ndarray) -> float:
        return quantile(power(task.box.values(u)[:, None] * off), 0.9)

    got = task.prepare()(u, True, None)
    assert got.objective == pytest.approx(robust(u), rel=2e-5)
    expected = [(robust(u + h) - robust(u - h)) / 2e-5 for h in 1e-5 * np.eye(3)]
    np.testing.assert_allclose(got.gradient, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def test_what_is_chosen_keeps_its_spread():
    """As a share of the mass; by the same amount, of an angle, which may be negative."""
    turned = SINKER.replace("mass: 0.15 kg", "mass: 0.15 kg +- 20 %\n  rotation: [0 deg, 0 deg, 10 deg +- 2 deg]")
    task = Problem({"m": "0.09..0.3 kg", "body.rotation.2": "-30..30 deg"}, forward="-z", quantile=0.1).task(
        parse_robot(turned)
    )
    chosen = task.robot_at(np.array([1.0, 0.0]))
    assert get_value(chosen, "body.mass").plus_minus == pytest.approx(0.2 * 0.3)
    assert get_value(chosen, "body.rotation.2").plus_minus == pytest.approx(math.radians(2))


def test_other_draws_are_another_search():
    tasks = [replace(WORDS, **change).task(OFF_DRAG) for change in ({}, {"quantile": 0.2}, {"draws": 20})]
    tasks += [WORDS.task(OFF_DRAG, seed=2), WORDS.task(OFF_MASS), replace(WORDS, quantile=0.0).task(OFF_DRAG)]
    assert len({task.key() for task in tasks}) == len(tasks)


@pytest.mark.parametrize("text", ["torque <= 0.5 N m @ 90 %", "motor 890 mN m, 22 rad/s @ 97.5 %", "speed >= 1 m/s"])
def test_limits_are_written_as_they_are_read(text):
    limit = read_constraint(text)
    assert str(limit) == text
    assert read_constraint(str(limit)) == limit


def test_a_problem_file_has_a_quantile(tmp_path):
    file = tmp_path / "ball.yaml"
    file.write_text("vary: {m: 0.1..0.3 kg}\nquantile: 10 %\ndraws: 20\nkeep: [speed <= 1 m/s @ 90 %]\n")
    problem = load_problem(file)
    assert (problem.quantile, problem.draws, problem.keep[0].probability) == (0.1, 20, 0.9)
    file.write_text("vary: {m: 0.1..0.3 kg}\nquantile: 110 %\n")
    with pytest.raises(InputError, match=r'line 2, quantile: "1.1" is out of range'):
        load_problem(file)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (replace(WORDS, quantile=0.01), "draws: 16 are too few for 1 %: it takes 67 or more."),
        (replace(WORDS, draws=3), 'draws: "3" must be a whole number of at least 8.'),
        (replace(WORDS, quantile=0.0, draws=20), "draws: they go with a quantile, or with a limit"),
    ],
)
def test_what_makes_no_sense_gets_a_sentence(words, message):
    with pytest.raises(InputError, match=message):
        words.task(OFF_DRAG)


def test_a_robot_that_is_known_exactly_has_no_draws():
    known = SINKER[: SINKER.index("  loads")].replace(", A: body.loads.drag.drag_area.2", "")
    with pytest.raises(InputError, match="sinker: all of it is known exactly"):
        Problem({"m": "0.09..0.3 kg"}, forward="-z", quantile=0.1).task(parse_robot(known))
