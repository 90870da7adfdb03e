"""A robot brought to recordings: slopes and intervals against a hinge whose motion is known in closed form."""

import json
import pickle
import re
from concurrent.futures import CancelledError, ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from tests.afar import Afar
from tests.small_robots import DRIVEN, M0, F, I

from nectosome.core.programs import remember
from nectosome.description import parse_robot
from nectosome.description.variables import read_variable
from nectosome.identification import identify
from nectosome.identification.robot.fit import fit_robot
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build
from nectosome.search.executors.spread import LostError
from nectosome.units import InputError

K, C, NOISE = 0.75, 0.034, 2e-3  # N m/rad, N m s/rad, rad
TIME = np.linspace(0.0, 4.0, 201)


def angle(k, c, time=TIME):
    """I q'' + c q' + k q = M0 sin(2 pi F t + 0.4) from rest."""
    w = 2 * np.pi * F
    steady = M0 * np.exp(0.4j) / (k - I * w**2 + 1j * w * c), np.conj(M0 * np.exp(0.4j)) / (k - I * w**2 - 1j * w * c)
    forced = sum(s * a * np.exp(s * 1j * w * time) for s, a in zip((1, -1), steady, strict=True)) / 2j
    root = np.sqrt(c**2 / (4 * I**2) - k / I + 0j)
    poles = -c / (2 * I) + root, -c / (2 * I) - root
    begun = sum(s * a for s, a in zip((1, -1), steady, strict=True)) / 2j
    rate = 1j * w * sum(steady) / 2j
    free = np.linalg.solve([[1, 1], poles], [-begun, -rate])
    return (forced + free[0] * np.exp(poles[0] * time) + free[1] * np.exp(poles[1] * time)).real


def recording(values, name="hinge", unit="rad", column="encoder", time=TIME, **conditions):
    about = {"file": f"{name}.csv", "repairs": [], "warnings": []}
    coords = {"time": ("time", time)} | {k: ((), x, {"units": u}) for k, (x, u) in conditions.items()}
    return xr.Dataset({column: ("time", values, {"units": unit})}, coords, {"provenance": json.dumps(about)})


@pytest.fixture(scope="module")
def hinge():
    description = parse_robot(DRIVEN)
    variables = [
        read_variable("k", "0.5 N m/rad .. 1.2 N m/rad log", description),
        read_variable("c", "0.01 N m s/rad .. 0.1 N m s/rad log", description),
    ]
    return description, variables, [read_compared("encoder", "body.angle", build(description))]


def trials_of(hinge, *recordings, **how):
    return robot_trials(recordings, hinge[0], hinge[2], how.pop("inputs", {}), **how)


def test_slopes_are_those_of_the_closed_form(hinge):
    problem = RobotMisfit(trials_of(hinge, recording(angle(K, C))), hinge[1], hinge[2])
    misfit, h = problem.misfit(np.array([1.0])), 1e-6
    expected = np.stack([angle(K + h, C) - angle(K - h, C), angle(K, C + h) - angle(K, C - h)], axis=1) / (2 * h)
    np.testing.assert_allclose(misfit.residuals(np.array([[K, C]])), 0, atol=4e-5)
    np.testing.assert_allclose(misfit.jacobian(np.array([K, C])), expected, atol=2e-4 * np.abs(expected).max())


def test_intervals_hold_the_truth_as_often_as_they_say(hinge):
    """Of 30 draws of noise 95 % intervals miss in more than 5 of 60 with a probability of 0.08 only."""
    rng, missed, off = np.random.default_rng(0), 0, []
    for _ in range(30):
        trials = trials_of(hinge, recording(angle(K, C) + NOISE * rng.normal(size=TIME.size)))
        found = fit_robot(hinge[0], hinge[1], trials, hinge[2], {})
        assert found.errors[0] == pytest.approx(NOISE, rel=0.2)
        ends = found.identifiability.intervals()
        missed += sum(not one.low < true < one.high for one, true in zip(ends, (K, C), strict=True))
        off.append([(x - true) / (one.high - one.low) for x, true, one in zip(found.theta, (K, C), ends, strict=True)])
    assert missed <= 5
    assert np.all(np.abs(np.mean(off, axis=0)) < 0.15)


def test_starts_come_to_one_end_and_what_was_held_out_is_predicted(hinge):
    noise = NOISE * np.random.default_rng(1).normal(size=(2, TIME.size))
    trials = trials_of(hinge, *(recording(angle(K, C) + e, n) for e, n in zip(noise, ("one", "other"), strict=True)))
    found = fit_robot(hinge[0], hinge[1], trials[:1], hinge[2], {"encoder": NOISE}, starts=3)
    assert (found.starts, found.agree, found.warnings) == (3, 3, ())
    predicted = RobotMisfit(trials[1:], hinge[1], hinge[2]).computed(found.theta)
    data = found._replace(test=tuple(zip(trials[1:], predicted, strict=True))).to_dataset()
    assert data["used"].values.tolist() == ["train", "test"]
    np.testing.assert_allclose(data["e_rmsp"], 100 * NOISE / np.ptp(angle(K, C)), rtol=0.2)
    assert found.robot.body.joint.stiffness == found.theta[0] == pytest.approx(K, rel=0.01)


def test_a_compass_may_jump_by_a_turn_and_count_from_elsewhere(hinge):
    """It swings about north, where 0 and 360 deg meet."""
    description, variables, _ = hinge
    noise = NOISE * np.random.default_rng(2).normal(size=TIME.size)
    compass = np.mod(angle(K, C) + noise, 2 * np.pi)
    assert np.abs(np.diff(compass)).max() > 6
    compass[50] = np.nan
    compared = [read_compared("encoder", "heading", build(description))]
    trials = trials_of((description, variables, compared), recording(compass))
    found = fit_robot(description, variables, trials, compared, {"encoder": NOISE})
    np.testing.assert_allclose(found.theta, [K, C], rtol=0.02)
    data = found.to_dataset()
    np.testing.assert_allclose(data["e_rmsp"], 100 * NOISE / np.ptp(angle(K, C)), rtol=0.2)
    assert np.nanmax(np.abs(data["measured"] - data["computed"])) < 5 * NOISE


def test_what_the_model_lacks_is_told(hinge):
    lacking = angle(K, C) + 0.01 * np.sin(2 * np.pi * 0.4 * TIME)
    found = fit_robot(hinge[0], hinge[1], trials_of(hinge, recording(lacking)), hinge[2], {"encoder": NOISE})
    assert "are correlated over" in found.warnings[0]
    assert "times its standard error" in found.warnings[1]


def test_a_prediction_far_above_the_noise_is_told_with_what_to_do(hinge):
    """0.05 rad at another frequency are 25 / sqrt(2) of NOISE; the recording that is as the model says is not told."""
    noise = NOISE * np.random.default_rng(3).normal(size=(3, TIME.size))
    more = [np.zeros_like(TIME), np.zeros_like(TIME), 0.05 * np.sin(2 * np.pi * 0.5 * TIME)]
    names = ("fitted", "same", "other")
    given = [recording(angle(K, C) + e + m, n) for e, m, n in zip(noise, more, names, strict=True)]
    errors = {"encoder": NOISE}
    found = identify(hinge[0], given[:2], **NAMED, errors=errors, test=["same.csv"], starts=1)
    assert found.warnings == ()
    found = identify(hinge[0], given, **NAMED, errors=errors, test=["same.csv", "other.csv"], starts=1)
    (told,) = found.warnings
    assert told.startswith("encoder of other, held out, is off by ")
    assert "fit a recording of such conditions too" in told
    assert float(told.split("off by ")[1].split()[0]) == pytest.approx(np.hypot(25 / np.sqrt(2), 1), rel=0.02)


def test_recordings_may_have_gaps_other_lengths_and_a_first_part_that_is_skipped(hinge):
    holes = np.where((TIME > 1) & (TIME < 1.5), np.nan, angle(K, C))
    long = np.linspace(0.0, 5.0, 251)
    given = recording(holes), recording(angle(K, C, long), "long", time=long + 7.0)
    trials = trials_of(hinge, *given, skip=0.5)
    assert trials[0].notes == ("24 values are missing and are not compared",)
    assert np.isnan(trials[1].measured[0, :25]).all()
    found = fit_robot(hinge[0], hinge[1], trials, hinge[2], {})
    np.testing.assert_allclose(found.theta, [K, C], rtol=2e-4)


def test_conditions_are_those_of_the_robot_and_columns_may_drive_it(hinge):
    dense = np.linspace(0.0, 4.0, 801)
    torque = M0 * np.sin(2 * np.pi * F * dense + 0.4)
    driven = recording(angle(K, C, dense), time=dense).assign(pull=("time", torque, {"units": "N m"}))
    trials = trials_of(hinge, driven, inputs={"pull": "body.joint.torque"})
    computed = RobotMisfit(trials, hinge[1], hinge[2]).computed(np.array([K, C]))
    np.testing.assert_allclose(computed[0][0], angle(K, C, dense), atol=5e-5)
    named = trials_of(
        hinge, driven.assign_coords(size=((), 2.0, {"units": "N m"})), inputs={"pull": "body.joint.torque"}
    )
    assert named[0].notes == ("size is no quantity of driven: it only names the recording",)
    np.testing.assert_array_equal(named[0].measured, trials[0].measured)
    stiffer = trials_of(hinge, recording(angle(K, C), k=(0.9, "N m/rad")))
    assert stiffer[0].description.body.joint.stiffness == pytest.approx(0.9)


MISTAKES = {
    "has no time": lambda r: r.isel(time=0),
    "is missing; there are turned": lambda r: r.rename(encoder="turned"),
    "is in N, and body.angle in rad": lambda r: r.assign(encoder=r["encoder"].assign_attrs(units="N")),
    "is constant": lambda r: r.assign(encoder=0 * r["encoder"]),
    "has no values": lambda r: r.assign(encoder=np.nan * r["encoder"]),
    "has 1 value: nothing": lambda r: r.assign(encoder=r["encoder"].where(r["time"] == 1.0)),
    "has 9 rows; at least 10 are needed": lambda r: r.isel(time=slice(9)),
    "3 values to compare": lambda r: r.assign(encoder=r["encoder"].where(r["time"] < 0.05)),
    'there is nothing called "kk"': lambda r: r.assign_coords(kk=((), 1.0, {"units": "m"})),
    "must be at least": lambda r: r.assign_coords(k=((), -1.0, {"units": "N m/rad"})),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes_in_recordings_are_told_with_their_file(hinge, words):
    with pytest.raises(InputError, match=words) as told:
        trials_of(hinge, MISTAKES[words](recording(angle(K, C))))
    assert told.value.file == "hinge.csv"


@pytest.mark.parametrize("path", ["body.joint.stiffness", "k"])
def test_a_number_is_driven_by_no_recording(hinge, path):
    with pytest.raises(InputError, match="is a number: no recording can drive it") as told:
        trials_of(hinge, recording(angle(K, C)), inputs={"encoder": path})
    assert told.value.field == path


@pytest.mark.parametrize(
    ("text", "name", "sign"),
    [
        ("body.angle", "body.angle", 1.0),
        ("- body.angle", "body.angle", -1.0),
        ("-body.angle + 0.1", "-body.angle + 0.1", 1.0),
    ],
)
def test_a_minus_before_a_name_turns_the_sensor_and_one_in_an_expression_is_its_own(text, name, sign):
    compared = read_compared("encoder", text, build(parse_robot(DRIVEN)))
    assert (compared.reading.name, compared.sign, compared.reading.unit) == (name, sign, "rad")


@pytest.mark.parametrize("reading", ["", "body.angel", "-", "body"])
def test_what_is_compared_must_be_of_the_robot(reading):
    with pytest.raises(InputError) as told:
        read_compared("encoder", reading, build(parse_robot(DRIVEN)))
    assert told.value.field == "encoder"


NAMED = {"vary": {"k": "0.5..1.2N m/rad log", "c": (0.01, 0.1)}, "compare": {"encoder": "body.angle"}}


def test_arrays_are_recordings_too(hinge):
    """In SI, or with a unit; one is fitted from several starts, the other predicted."""
    noise = NOISE * np.random.default_rng(1).normal(size=(2, TIME.size))
    one = {"time": TIME, "encoder": angle(K, C) + noise[0]}
    other = {"time": (1e3 * TIME, "ms"), "encoder": (np.degrees(angle(K, C) + noise[1]), "deg"), "k": (K, "N m/rad")}
    found = identify(hinge[0], [one, other], **NAMED, errors={"encoder": NOISE}, test=["recording 2"], starts=3)
    assert (found.starts, found.agree, found.warnings) == (3, 3, ())
    np.testing.assert_allclose(found.theta, [K, C], rtol=0.01)
    data = found.to_dataset()
    assert data["used"].values.tolist() == ["train", "test"]
    np.testing.assert_allclose(data["e_rmsp"], 100 * NOISE / np.ptp(angle(K, C)), rtol=0.2)
    assert found.robot.body.joint.damping == found.theta[1]
    again = identify(
        build(hinge[0]), [recording(angle(K, C) + noise[0])], **NAMED, errors={"encoder": "2mrad"}, starts=1
    )
    np.testing.assert_allclose(again.theta, found.theta, rtol=1e-6)


def test_a_robot_whose_motion_is_prescribed_is_fitted_by_its_forces():
    """A sphere of 20 ml that is moved to and fro: its mass on a load cell, with nothing of it unknown."""
    robot = parse_robot("""
name: ball
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 50 g
  volume: 20 mL
  joint: {kind: prismatic, axis: x, motion: {kind: sine, amplitude: 2 cm, frequency: 1 Hz}}
""")
    t = np.linspace(0.0, 1.0, 41)
    w = 2 * np.pi
    force = 0.1 * 0.02 * w**2 * np.sin(w * t)  # of a ball of 100 g on what moves it
    found = identify(
        robot, [{"time": t, "push": force}], vary={"body.mass": "0.02..0.5kg"}, compare={"push": "force.x"}
    )
    assert float(found.to_dataset()["value"][0]) == pytest.approx(0.1, rel=1e-6)


def test_what_a_fit_waits_for_is_told(hinge, monkeypatch):
    """Its programs are kept for the next fit, and count as compiling while they are made."""
    told, told_now = [], remember._told
    monkeypatch.setattr(remember, "_programs", {})
    monkeypatch.setattr(remember, "_told", lambda name: told.append(name) or told_now(name))
    fit_robot(hinge[0], hinge[1], trials_of(hinge, recording(angle(K, C))), hinge[2], {})
    assert {"_computed", "_jacobian"} <= {*told}


def test_clocks_are_tested_by_the_programs_of_the_fit(hinge, monkeypatch):
    """A gyroscope that is late beside the encoder: its own clock is freed, and nothing is compiled anew."""
    told, told_now = [], remember._told
    monkeypatch.setattr(remember, "_programs", {})
    monkeypatch.setattr(remember, "_told", lambda name: told.append(name) or told_now(name))
    rng, h = np.random.default_rng(1), 1e-6
    rate = (angle(K, C, TIME - 0.03 + h) - angle(K, C, TIME - 0.03 - h)) / (2 * h)
    noisy = {"encoder": angle(K, C) + NOISE * rng.normal(size=TIME.size), "gyro": rate + 0.02 * rng.normal(size=201)}
    compare = {"encoder": "body.angle", "gyro": "body.angle.rate"}
    found = identify(hinge[0], [{"time": TIME, **noisy}], **{**NAMED, "compare": compare}, skip=0.1)
    assert "gyro of recording 1 late by 30" in " ".join(found.warnings)
    assert (told.count("_computed"), told.count("_jacobian")) == (1, 1)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"vary": {}}, "vary: is empty"),
        ({"compare": {}}, "compare: is empty"),
        ({"vary": {"k": "1..2N m/rad", "body.joint.stiffness": (1, 2)}}, "vary: body.joint.stiffness is named twice"),
        ({"errors": {"other": 1.0}}, "error: other is not compared"),
        ({"errors": {"encoder": 0.0}}, "error: of encoder is 0; it must be more than 0"),
        ({"errors": {"encoder": "1 N"}}, "error of encoder: "),
        ({"starts": 0}, 'starts: "0" must be'),
        ({"test": ["nobody.csv"]}, 'test: "nobody.csv" is no recording here'),
        ({"test": ["hinge.csv"]}, "test: all recordings are named"),
        ({"campaign": []}, "recordings: there is no recording"),
        ({"campaign": [{"encoder": TIME}]}, "recording 1: has no time, but encoder"),
        ({"campaign": [{"time": TIME, "encoder": TIME[1:]}]}, r"recording 1, encoder: has the shape \(200,\)"),
        ({"campaign": [{"time": TIME, "encoder": (TIME, "rat")}]}, "recording 1, encoder: its unit has no unit called"),
        ({"campaign": "nowhere.yaml"}, "nowhere.yaml: cannot be read"),
    ],
)
def test_what_is_asked_wrongly_is_told_in_a_sentence(hinge, changes, said):
    asked = {"campaign": [recording(angle(K, C))], **NAMED} | changes
    with pytest.raises(InputError, match=said):
        identify(hinge[0], **asked)


def test_more_starts_are_made_only_where_one_does_not_fit(hinge):
    noisy = recording(angle(K, C) + NOISE * np.random.default_rng(1).normal(size=TIME.size))
    assert identify(hinge[0], [noisy], **NAMED).starts == 1
    found = identify(hinge[0], [noisy], **{**NAMED, "vary": {**NAMED["vary"], "k": (0.5 * K, 0.8 * K)}})
    assert found.starts == 4 and "k is at the upper end of its range" in " ".join(found.warnings)


def test_a_start_takes_four_recordings_and_the_fit_all(hinge, monkeypatch):
    """Each of six starts where it wants: what belongs to the others stays where it was, and is fitted after that."""
    noise = NOISE * np.random.default_rng(4).normal(size=(6, TIME.size))
    given = [recording(angle(K, C) + e, f"run{k}") for k, e in enumerate(noise)]
    trials = trials_of(hinge, *given, start={"body.joint.position": "-0.2..0.2rad"})
    problem = RobotMisfit(trials, hinge[1], hinge[2])
    few, own = problem.of_few(4)
    assert [one.name for one in few.trials] == ["run0", "run2", "run3", "run5"]
    assert [few.box.names[k] for k in range(6)] == [problem.box.names[k] for k in own]
    theta = np.array([K, C, 0.1, 0.02, -0.1, 0.05, 0.0, 0.15])
    np.testing.assert_array_equal(few.computed(theta[own]), np.array(problem.computed(theta))[[0, 2, 3, 5]])
    sizes, once = list[int](), RobotMisfit._once
    monkeypatch.setattr(RobotMisfit, "_once", lambda self, *args: sizes.append(len(self.trials)) or once(self, *args))
    found = fit_robot(hinge[0], hinge[1], trials, hinge[2], {"encoder": NOISE})
    assert 4 in sizes
    assert sizes[-1] == 6
    np.testing.assert_allclose(found.theta[:2], [K, C], rtol=0.01)
    np.testing.assert_allclose(found.theta[2:], 0, atol=5 * NOISE)


def test_a_standard_error_that_is_much_too_large_costs_no_precision(hinge):
    """All residuals together are less than a standard error from the first step on."""
    found = fit_robot(hinge[0], hinge[1], trials_of(hinge, recording(angle(K, C))), hinge[2], {"encoder": 100.0})
    np.testing.assert_allclose(found.theta, [K, C], rtol=2e-3)


def test_a_fit_that_still_depends_on_its_steps_says_by_how_much(hinge):
    """The closed form is the truth: what more exact steps move k by is how far the fit is from it, to 3 %."""
    trials = trials_of(hinge, recording(angle(K, C)))
    description, variables, compared = hinge
    exact, rough = (fit_robot(description, variables, trials, compared, {"encoder": x}) for x in (1e-7, 1e-9))  # rad
    assert not any("steps" in words for words in exact.warnings)
    (said,) = json.loads(rough.to_dataset().attrs["warnings"])[1:]
    words = re.search(r"move k by (\S+) N m/rad \(half of its 95 % interval: (\S+)\)", said)
    assert words is not None
    by, half = map(float, words.groups())
    assert by == pytest.approx(K - rough.theta[0], rel=0.03)
    interval = rough.identifiability.intervals()[0]
    assert half == pytest.approx(0.5 * (interval.high - interval.low), rel=0.03) and abs(by) > 0.3 * half / 1.96


def test_a_start_is_judged_by_the_recordings_that_it_took(hinge):
    """Each of six begins elsewhere: two of that are found after the start, which asks for no more starts therefore."""
    begins = {"start": {"body.joint.position": "-0.5..0.5rad"}}
    given = [recording(angle(K, C), f"run{k}") for k in range(6)]
    true = np.array([K, C, 0.2, 0.3, -0.2, 0.1, -0.3, 0.25])
    made = RobotMisfit(trials_of(hinge, *given, **begins), hinge[1], hinge[2]).computed(true)
    noise = NOISE * np.random.default_rng(5).normal(size=(6, TIME.size))
    given = [recording(rows[0] + e, f"run{k}") for k, (rows, e) in enumerate(zip(made, noise, strict=True))]
    found = fit_robot(hinge[0], hinge[1], trials_of(hinge, *given, **begins), hinge[2], {"encoder": NOISE}, starts=None)
    assert found.starts == 1
    np.testing.assert_allclose(found.theta, true, rtol=0.02)


def test_a_long_fit_says_first_what_it_costs(hinge, monkeypatch):
    """With 2 unknowns a derivative counts as 8 evaluations: 40 and 12 of them take 136 times as long as one."""
    monkeypatch.setattr(RobotMisfit, "seconds", lambda self, theta: 0.5)
    seen = []
    identify(hinge[0], [recording(angle(K, C))], **NAMED, starts=1, progress=lambda *now: seen.append(now))
    costs = "0.5 s of processor time, with derivatives about 4 s; about 40 and 12 of them, 68 s in all"
    assert seen[1] == (f"an evaluation takes {costs}", 0.0)
    assert [share for _, share in seen] == sorted(share for _, share in seen)


def test_starts_that_an_executor_fits_come_to_the_same_numbers(hinge):
    trials = trials_of(hinge, recording(angle(K, C) + NOISE * np.random.default_rng(1).normal(size=TIME.size)))
    here = fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, starts=3)
    told = []
    with ThreadPoolExecutor(2) as pool:
        how = {"starts": 3, "executor": pool, "progress": lambda what, share: told.append((what, share))}
        there = fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, **how)
    assert there.theta.tolist() == here.theta.tolist()
    assert there.agree == here.agree
    assert [share for _, share in told] == sorted(share for _, share in told)
    restored = pickle.loads(pickle.dumps(RobotMisfit(trials, hinge[1], hinge[2])))  # as it is sent to a worker
    ours = RobotMisfit(trials, hinge[1], hinge[2])
    assert np.array_equal(restored.residuals(here.theta)[0], ours.residuals(here.theta)[0])


def test_a_fit_goes_on_from_the_starts_that_are_kept(hinge, tmp_path):
    """Two starts are kept here, one by a cluster that is lost, and the last one is left."""
    trials = trials_of(hinge, recording(angle(K, C) + NOISE * np.random.default_rng(1).normal(size=TIME.size)))
    whole = fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, starts=4)

    def again(**how):
        return fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, starts=4, folder=tmp_path / "kept", **how)

    with pytest.raises(CancelledError):
        again(progress=lambda what, share: not what.startswith("start 3"))
    with Afar(most=1) as executor, pytest.raises(LostError):
        again(executor=executor)
    assert executor.calls == 2
    with Afar() as executor:
        found = again(executor=executor)
    assert executor.calls == 1
    assert found.theta.tolist() == whole.theta.tolist()
    assert np.array_equal(found.computed, whole.computed)
    assert (found.agree, found.warnings) == (whole.agree, whole.warnings)
    with Afar() as executor:
        again(executor=executor)
    assert executor.calls == 0
    with pytest.raises(InputError, match=r"starts.jsonl: this journal belongs to other work"):
        fit_robot(hinge[0], hinge[1], trials, hinge[2], {"encoder": NOISE}, starts=4, folder=tmp_path / "kept")


def test_a_fit_goes_on_from_its_last_step(hinge, tmp_path):
    """Killed late in a start, then in what follows: of the start nothing is repeated but its last step."""
    trials = trials_of(hinge, recording(angle(K, C) + NOISE * np.random.default_rng(1).normal(size=TIME.size)))
    said, how = [], {"starts": 1, "folder": tmp_path / "kept"}
    whole = fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, starts=1, progress=lambda *now: said.append(now[0]))
    counted = re.compile(r"fitting, evaluation (\d+)")
    most = max(int(found[1]) for words in said if (found := counted.match(words)))

    def until(count):
        return lambda what, share: (found := counted.match(what)) is None or int(found[1]) != count

    with pytest.raises(CancelledError):
        fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, **how, progress=until(most - 2))
    kept = [json.loads(line)["data"] for line in (tmp_path / "kept" / "starts.jsonl").read_text().splitlines()[1:]]
    assert any("reached" in one for one in kept)
    again = []
    found = fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, **how, progress=lambda *now: again.append(now[0]))
    wide = np.array([one.high - one.low for one in whole.identifiability.intervals()])
    assert np.all(np.abs(found.theta - whole.theta) < 0.01 * wide)
    assert len(again) < len(said)


def test_nothing_is_kept_of_starts_that_led_to_no_fit(hinge, tmp_path, monkeypatch):
    def refused(*_):
        return InputError("no motion", field="k")

    monkeypatch.setattr("nectosome.identification.robot.fit._started", refused)
    trials = trials_of(hinge, recording(angle(K, C)))
    with pytest.raises(InputError, match="could not be simulated: no motion"):
        fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, starts=2, folder=tmp_path / "kept")
    assert not (tmp_path / "kept").exists()
