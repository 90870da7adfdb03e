"""PoseiDRONE's swimming: the study's part, its synthetic recordings, and the robot that ships."""

import numpy as np
import pytest

from nectosome.description import with_values
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome_studies import STUDIES, catalogue
from nectosome_studies.poseidrone import study, swim
from nectosome_studies.poseidrone.recordings import OMEGA, body, recording, settled, thrust
from nectosome_studies.study import printed

OWN = ("table1/", "table2/", "swim/", "better-water/", "section3/pulses")


@pytest.fixture(scope="module")
def quick():
    """The study as if swimming were all of it."""
    rows = {row: entry for row, entry in printed("poseidrone").items() if row.partition("/")[2].startswith(OWN)}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "_PARTS", {"swimming": (1.0, swim.part)})
        patch.setattr(catalogue, "printed", lambda name: rows)
        return STUDIES["poseidrone"].run(True, lambda what, share: None)


def test_the_robot_that_ships_has_the_parameters_of_table_1_and_the_thrust():
    """Its 32 values are those of the formula to half a digit of the file."""
    np.testing.assert_allclose(body(), (0.755, 2.768, 5.094), rtol=1e-6)
    force = describe("poseidrone_swim").body.joint.force  # type: ignore[union-attr]
    np.testing.assert_allclose(force.values, thrust(2 * np.pi * np.arange(32) / 32), atol=5.1e-6)
    assert 2 * np.pi * force.frequency == pytest.approx(OMEGA["train"], rel=1e-8)


def test_the_robot_swims_as_eq_1_says():
    """Against an integrator of its own, from the same speed, over three cycles; the thrust is a spline of 32 values."""
    time, speed = settled(OMEGA["train"])
    robot = describe("poseidrone_swim")
    started = with_values(robot, {"body.joint.velocity": speed[0]})
    data = simulate(build(started), 1.6, samples=81, rtol=1e-8, atol=1e-10).to_dataset()
    np.testing.assert_allclose(data["v"].sel(coordinate="body.position"), speed[:81], rtol=2e-4)
    np.testing.assert_allclose(data["velocity"].sel(axis="x").isel(part=0), -speed[:81], rtol=2e-4)
    assert time[80] == pytest.approx(1.6)


def test_the_thrust_has_the_shape_that_the_standard_errors_tell():
    """sigma(gamma) / sigma(alpha) of Table 1 is the ratio of root mean squares of squared speed and thrust."""
    book = printed("poseidrone")
    sigmas = [book[f"poseidrone/table1/sigma_{name}"]["printed"] for name in ("mas", "lambda")]
    push, speed = thrust(np.linspace(0, 2 * np.pi, 1000, endpoint=False)), settled(OMEGA["train"])[1]
    assert np.sqrt(np.mean(push**2) / np.mean(speed**4)) == pytest.approx(sigmas[1] / sigmas[0], rel=1e-3)
    assert speed.mean() == pytest.approx(0.08, rel=1e-3)


def test_every_row_has_its_number(quick):
    rows = {row["id"].removeprefix("poseidrone/"): row for row in quick.rows}
    for name, within in (("gamma", 0.027), ("alpha", 0.0004)):  # of the printed digits
        assert rows[f"table1/p_{name}"]["ours"] == pytest.approx(rows[f"table1/p_{name}"]["printed"], rel=within)
    assert rows["table1/sigma_mas"]["ours"] == pytest.approx(0.067, abs=5e-4)
    assert rows["table1/sigma_lambda"]["ours"] == pytest.approx(0.86, abs=5e-3)
    assert rows["table1/p_mas"]["ours"] == pytest.approx(100 * 0.067 / 2.768, abs=0.02)
    assert rows["table1/p_lambda"]["ours"] == pytest.approx(np.hypot(1.9024, 16.7643), abs=1e-3)
    assert rows["section3/pulses"]["ours"] == pytest.approx(2.387, abs=1e-3)
    assert {row["ours"] for name, row in rows.items() if name.startswith("table2/")} == {None}
    assert rows["swim/statistics/train/std"]["ours"] < 0  # noise makes the recorded one larger
    assert {row["kind"] for name, row in rows.items() if name.startswith("swim/")} == {"method"}


def test_the_printed_estimator_is_biased_and_the_recommended_is_not(quick):
    """40 draws: the mean has an error of 0.7 % in the added mass; the study's 200 are held to 2 %."""
    ours = {row["id"].removeprefix("poseidrone/swim/"): row["ours"] for row in quick.rows}
    assert 8 < ours["printed/bias_mas"] < 18
    assert 20 < ours["printed/bias_lambda"] < 35
    assert ours["printed/coverage"] < 50
    assert abs(ours["recommended/bias_mas"]) < 2
    assert abs(ours["recommended/bias_lambda"]) < 1
    assert ours["recommended/coverage"] > 85


def test_errors_of_statistics_are_percent_of_each():
    """A signal of 2 +- 1 computed as 3 +- 0.5: mean 50 % too high, spread half too small, maximum 3.5 for 3."""
    wave = np.array([1.0, -1.0])
    found = swim.of_statistics(3 + 0.5 * wave, 2 + wave)
    assert found == pytest.approx({"mean": 50.0, "std": -50.0, "max": 100 * 0.5 / 3})


@pytest.mark.slow
def test_200_draws_of_the_recommended_way_are_unbiased_with_honest_intervals():
    made = swim.draws(200, lambda what, share: None).sel(estimator="output error")
    assert np.all(np.abs(made["bias"]) < 2)
    assert np.all((made["coverage"] >= 90) & (made["coverage"] <= 98))


def test_a_model_found_on_one_recording_predicts_the_other(quick):
    """The mean speed to 1 %, errors no larger than those of the recording that was fitted."""
    data = quick.data["swim"]
    assert np.all(np.abs(data["deviation_mean"]) < 1)
    assert float(data["deviation_std"][1]) < 1.1 * float(data["deviation_std"][0])


def test_its_figures_are_the_recordings_and_the_estimators(quick):
    drawn = {panel.title: panel.caption for panel in quick.figures(quick.data, quick.runs)}
    *recorded, estimators = drawn
    assert [title.rpartition(", as ")[2] for title in recorded] == ["Fig. 9", "Fig. 10"]
    assert all("this one is synthetic" in drawn[title] for title in recorded)
    assert estimators == "Errors of the estimators"
    assert " % (as printed, unfiltered)." in drawn[estimators]


def test_recordings_differ_by_their_noise_alone():
    one, other = (recording("train", np.random.default_rng(k)) for k in (0, 1))
    assert np.std(one.speed - other.speed) == pytest.approx(5e-3 * np.sqrt(2), rel=0.1)
    np.testing.assert_array_equal(one.thrust, other.thrust)
