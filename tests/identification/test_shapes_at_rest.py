"""Shapes at rest identify a robot: a rod under weights and pressures, against closed forms and single equilibria.

Two programs serve nearly all: six rows, two unknowns and three readings, or one row, one unknown and one reading.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.small_robots import DRIVEN, M0, F, I

from nectosome import static
from nectosome.core.programs import remember
from nectosome.description import parse_robot, with_values
from nectosome.description.variables import read_variable
from nectosome.identification import identify
from nectosome.identification.recordings import recordings_of
from nectosome.identification.robot.misfit import RobotMisfit
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build
from nectosome.solve import reading
from nectosome.units import InputError

# a strip that hangs out sideways, with a hook at its tip and a chamber above its middle
STRIP = """
name: strip
water: {density: 1.2 kg/m3}
body:
  kind: rod
  section: rectangle
  length: 120 mm
  width: 20 mm
  height: 4 mm
  young: 3 MPa
  density: 1080 kg/m3
  strains: {bending_y: 2}
  points: 6
  marks: [0.5]
  loads:
    hook: {kind: force, force: [0 N, 0 N, 0 N]}
    chamber: {kind: chamber, place: [0 mm, 1 mm], area: 20 mm2, pressure: {kind: constant, value: 0 Pa}}
aliases: {E: body.young, area: body.loads.chamber.area, hook: body.loads.hook.force.2}
"""
E, AREA, NOISE = 2.6e6, 26e-6, 0.3e-3  # Pa, m2, m
VARY = {"E": "1..8MPa log", "area": "10..60mm2"}
COMPARE = {"tip": "body.tip.position.z", "middle": "body.0.5.position.z", "pitch": "body.tip.pitch"}
DRIVE = {"weight": "hook", "pressure": "body.loads.chamber.pressure"}
ONE = {"vary": {"E": VARY["E"]}, "compare": {"tip": COMPARE["tip"]}, "drive": DRIVE, "starts": 1}
WEIGHTS = np.array([0.0, -0.02, 0.0, -0.01, 0.01, 0.03])  # N
PRESSURES = np.array([0.0, 0.0, 30e3, 50e3, 20e3, 0.0])  # Pa


@pytest.fixture(scope="module")
def strip():
    return parse_robot(STRIP)


@pytest.fixture(scope="module")
def shapes(strip):
    """Readings of single equilibria, one a row."""
    out = []
    for weight, pressure in zip(WEIGHTS.tolist(), PRESSURES.tolist(), strict=True):
        set_ = {"E": E, "area": AREA, "hook": weight, "body.loads.chamber.pressure.value": pressure}
        run = static(build(with_values(strip, set_)))
        out.append([reading(run, name)[0] for name in COMPARE.values()])
    return dict(zip(COMPARE, np.transpose(out), strict=True))


def rows(read, **more):
    """Arrays of a recording."""
    given = {"weight": (WEIGHTS, "N"), "pressure": (PRESSURES, "Pa")}
    return {"time": None, **given, **read, **more}


def problem_of(strip, *recordings, compare=COMPARE, drive=DRIVE, vary=VARY):
    compared = [read_compared(column, name, build(strip)) for column, name in compare.items()]
    units = {one.column: one.reading.unit for one in compared}
    trials = robot_trials(recordings_of(recordings, units), strip, compared, drive)
    return RobotMisfit(trials, [read_variable(name, span, strip) for name, span in vary.items()], compared)


def noisy(shapes, seed, columns=("tip", "middle")):
    rng = np.random.default_rng(seed)
    return {name: shapes[name] + NOISE * rng.normal(size=WEIGHTS.size) for name in columns}


@pytest.mark.parametrize(
    ("change", "how", "said"),
    [
        ({"weight": (WEIGHTS, "kg")}, {}, '"0.0 kg" has not the unit of a force|is no force|kg'),
        ({"weight": (np.where(WEIGHTS < 0, np.nan, WEIGHTS), "N")}, {}, "weight: is missing in row 2"),
        ({"tip": (1e3 * WEIGHTS, "N")}, {}, "tip: is in N, and body.tip.position.z in m"),
        ({"tip": np.full(6, np.nan)}, {}, "tip: has no values"),
        ({"tip": np.zeros(6), "middle": np.zeros(6), "pitch": np.zeros(6)}, {}, "reads 0 in all rows"),
        ({"tip": np.ones(5)}, {}, "has the shape"),
        ({"E": (3e6, "Pa")}, {}, "body.young is set in a recording, and in vary too"),
        ({"hook": (0.1, "N")}, {}, "weight: body.loads.hook.force.2 is set twice"),
        ({"area": (-1e-6, "m2")}, {"vary": {"E": VARY["E"]}}, "area: row 1: .* is out of range"),
        ({"shift": "0.1 s"}, {}, "has a start or a shift"),
        ({}, {"drive": {"wind": "hook"}}, "wind: is missing; there are weight, pressure, tip"),
        ({}, {"drive": {"weight": "body.loads.hoook.force.2"}}, "is no number and no signal of strip"),
        ({}, {"drive": {"weight": "body.loads.hook"}}, "is no number and no signal of strip"),
        ({}, {"compare": {"tip": "body.0.4.position.z"}}, "tip: .*is nothing that can be measured"),
    ],
)
def test_what_is_wrong_is_told(strip, shapes, change, how, said):
    with pytest.raises(InputError, match=said):
        identify(strip, [rows(shapes, **change)], **{"vary": VARY, "compare": COMPARE, "drive": DRIVE, **how})


def test_rows_are_the_equilibria_of_static(strip, shapes):
    computed = problem_of(strip, rows(shapes)).computed(np.array([E, AREA]))
    np.testing.assert_allclose(computed[0], [*shapes.values()], rtol=1e-8, atol=1e-10)
    assert np.ptp(shapes["tip"]) > 0.04


def test_derivatives_are_those_of_finite_differences(strip, shapes):
    length = "100..150mm"
    for vary, theta in ((VARY, [E, AREA]), ({"E": VARY["E"], "body.length": length}, [E, 0.12])):
        check_derivatives(problem_of(strip, rows(shapes), vary=vary).misfit(np.ones(3)), np.array(theta))


def check_derivatives(misfit, theta):
    found = misfit.jacobian(theta)
    for k, h in enumerate(1e-4 * theta):
        step = h * np.eye(2)[k]
        ends = misfit.residuals(np.stack([theta + 2 * step, theta + step, theta - step, theta - 2 * step]))
        expected = (-ends[0] + 8 * ends[1] - 8 * ends[2] + ends[3]) / (12 * h)
        np.testing.assert_allclose(found[:, k], expected, atol=1e-6 * np.abs(expected).max())


def test_what_made_the_shapes_is_found(strip, shapes):
    found = identify(strip, [rows(shapes)], vary=VARY, compare=COMPARE, drive=DRIVE, starts=2)
    np.testing.assert_allclose(found.theta, [E, AREA], rtol=1e-6)
    assert found.agree == 2
    assert found.robot.body.young == found.theta[0]
    assert not found.warnings


def test_a_cantilever_bends_as_the_closed_form_says(strip, shapes):
    """P L^3 / (3 E I) at the tip, by small forces in no weight; the middle is 5/16 as far."""
    light = with_values(strip, {"water.gravity": 1e-30})
    force = 1e-6 * np.arange(1.0, 7.0)
    given = {**rows(shapes), "weight": (force, "N"), "pressure": (0 * force, "Pa")}
    tip, middle, _ = problem_of(light, given).computed(np.array([E, AREA]))[0]
    droop = force * 0.12**3 / (3 * E * 0.02 * 0.004**3 / 12)
    np.testing.assert_allclose(tip, droop, rtol=1e-6)
    np.testing.assert_allclose(middle, 5 / 16 * droop, rtol=1e-6)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say(strip, shapes):
    """Of 30 draws 95 % intervals miss in more than 7 of 60 with a probability of 0.01; their errors are of few rows."""
    compare = {name: COMPARE[name] for name in ("tip", "middle")}
    missed, errors = 0, []
    for seed in range(30):
        found = identify(strip, [rows(noisy(shapes, seed))], vary=VARY, compare=compare, drive=DRIVE, starts=1)
        ends = found.identifiability.intervals()
        missed += sum(not one.low < x < one.high for one, x in zip(ends, (E, AREA), strict=True))
        errors.append(found.errors)
    assert missed <= 7
    assert np.ptp(errors, axis=1).max() == 0  # columns of one dimension share it
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(NOISE, rel=0.1)


def test_few_rows_make_an_interval_wider(strip, shapes):
    """Of 3 readings and 1 unknown the interval is 4.303 / 1.960 times that of a known standard error."""
    read = noisy(shapes, 3)["tip"]
    given = [one_row({"tip": read}, k) for k in range(3)]
    found = identify(strip, given, ["area=26mm2"], **ONE)
    known = identify(strip, given, ["area=26mm2"], **ONE, errors={"tip": float(found.errors[0])})
    wide, narrow = (np.log(one.high / one.low) for fit in (found, known) for one in fit.identifiability.intervals())
    assert wide / narrow == pytest.approx(4.30265 / 1.95996, rel=1e-4)


def one_row(shapes, k=1, **more):
    given = {"weight": (WEIGHTS[k], "N"), "pressure": (PRESSURES[k], "Pa"), "tip": shapes["tip"][k : k + 1], **more}
    return {"time": None, **{k: (np.atleast_1d(v[0]), v[1]) if isinstance(v, tuple) else v for k, v in given.items()}}


def test_one_row_tells_a_value_and_an_interval_only_with_an_error(strip, shapes):
    """Half the interval is 1.96 errors by the derivative; without an error there is none, and it is asked for."""
    bare = identify(strip, [one_row(shapes)], **ONE)
    assert bare.theta[0] == pytest.approx(E, rel=1e-6)
    data = bare.to_dataset()
    assert np.isnan([*data["low"].values, *data["high"].values, *data["error"].values]).all()
    (told,) = bare.warnings
    assert told.startswith("no intervals: 1 reading and 1 unknown cannot tell the error of tip. Give it (--error tip=")
    found = identify(strip, [one_row(shapes)], **ONE, errors={"tip": "0.1mm"})
    (ends,) = found.identifiability.intervals()
    slope = problem_of(strip, one_row(shapes), compare=ONE["compare"], vary=ONE["vary"]).misfit(np.ones(1))
    half = 1.959964 * 1e-4 / abs(slope.jacobian(np.array([E]))[0, 0] * E)  # on the scale of log E
    assert np.log(ends.high / ends.low) == pytest.approx(2 * half, rel=1e-4)
    assert not found.warnings


def test_a_fit_does_not_stay_at_the_bound_where_it_begins(strip, shapes):
    found = identify(strip, [one_row(shapes)], ["E=1MPa"], **ONE, errors={"tip": "0.1mm"})
    assert found.theta[0] == pytest.approx(E, rel=1e-6)


def test_a_missing_reading_is_not_compared_and_a_held_out_row_is_predicted(strip, shapes):
    holes = {**shapes, "middle": np.where(np.arange(6) == 2, np.nan, shapes["middle"])}
    held = rows({name: np.where(np.arange(6) == 1, shapes[name], np.nan) for name in COMPARE})
    found = identify(
        strip, [rows(holes), held], vary=VARY, compare=COMPARE, drive=DRIVE, test=["recording 2"], starts=1
    )
    np.testing.assert_allclose(found.theta, [E, AREA], rtol=1e-6)
    data = found.to_dataset()
    assert data["used"].values.tolist() == ["train", "test"]
    assert data["start"].values.tolist() == ["at rest", "at rest"]
    assert np.nanmax(np.abs(data["measured"] - data["computed"])) < 1e-8
    assert "1 value of shapes at rest missing" in data.attrs["notes"]


def test_one_program_serves_all_rows_files_and_parameters(strip, shapes, monkeypatch):
    """Recordings of one row with conditions, whatever is zero in them, and of many rows."""
    files = [
        {"time": None, "tip": shapes["tip"][k : k + 1], "hook": (w, "N"), "area": (AREA, "m2")}
        | {"body.loads.chamber.pressure.value": (p, "Pa")}
        for k, (w, p) in enumerate(zip(WEIGHTS, PRESSURES, strict=True))
    ]
    how = ONE | {"drive": {}}
    told, told_now = [], remember._told
    monkeypatch.setattr(remember, "_told", lambda name: told.append(name) or told_now(name))
    found = identify(strip, files, **how)
    assert found.theta[0] == pytest.approx(E, rel=1e-6)
    assert told.count("shapes") <= 1
    again = identify(strip, files[::-1], ["E=5MPa"], **how)
    assert again.theta[0] == pytest.approx(E, rel=1e-6)
    assert told.count("shapes") <= 1


def test_fewer_readings_than_unknowns_identify_nothing(strip, shapes):
    with pytest.raises(InputError, match=r"1 reading cannot identify 2 unknown quantities \(E, area\)"):
        identify(strip, [one_row(shapes)], **{**ONE, "vary": VARY}, errors={"tip": "0.1mm"})


def test_two_unknowns_that_only_their_ratio_moves_are_told(strip, shapes):
    """In no weight the droop is that of E and the width together, E b: both are named."""
    light = with_values(strip, {"water.gravity": 1e-30, "body.width": 0.02})
    vary = {"E": VARY["E"], "body.width": "10..40mm log"}
    given = {**rows(shapes), "pressure": (0 * PRESSURES, "Pa")}
    droops = problem_of(light, given, vary=vary).computed(np.array([E, 0.02]))[0]
    given |= dict(zip(COMPARE, droops, strict=True))
    errors = {"tip": "0.1mm", "middle": "0.1mm", "pitch": "0.1deg"}
    found = identify(light, [given], vary=vary, compare=COMPARE, drive=DRIVE, starts=1, errors=errors)
    assert any("only in combination, E body.width" in words for words in found.identifiability.words())


def test_a_row_without_an_equilibrium_is_told_with_its_file(shapes):
    """A free body falls: nothing holds it."""
    free = parse_robot(
        "name: stone\nbody: {kind: rigid, shape: point, mass: 1 kg, joint: {kind: prismatic, axis: z}}\n"
        "aliases: {m: body.mass}"
    )
    given = {"time": None, "z": np.array([0.1, 0.2]), "m": (2.0, "kg")}
    with pytest.raises(InputError, match=r"recording 1: row 1, with .*: nothing holds body.position, so that"):
        identify(free, [given], vary={"water.gravity": "5..15m/s2"}, compare={"z": "position.z"})


def test_a_row_whose_equilibrium_is_unstable_is_told():
    """A rod that stands on a spring of 1 N m/rad falls over where m g L / 2 is more: above 0.204 kg of 1 m."""
    standing = parse_robot(
        "name: mast\nbody: {kind: rigid, shape: cylinder, length: 1 m, radius: 1 cm, mass: 0.1 kg, volume: 1e-9 m3,"
        " rotation: [0 deg, -90 deg, 0 deg], joint: {kind: revolute, axis: y, stiffness: 1 N m/rad}}\n"
        "aliases: {m: body.mass, k: body.joint.stiffness}"
    )
    given = {"time": None, "mass": (np.array([0.1, 0.2, 0.21, 5.0]), "kg"), "top": np.array([1.0, 1.0, 1.0, 1.0])}
    how = {"compare": {"top": "body.tip.position.z"}, "drive": {"mass": "m"}, "starts": 1, "errors": {"top": "1mm"}}
    found = identify(standing, [given], vary={"k": (0.999, 1.001)}, **how)
    assert any(words.startswith("rows 3, 4 of recording 1: the equilibrium") for words in found.warnings)


def test_motions_and_shapes_at_rest_are_fitted_together():
    """A hinge that stands under its torque at t = 0, M0 sin(0.4) / k, and that is driven from rest by it."""
    k, c, hinge, time = 0.75, 0.034, parse_robot(DRIVEN), np.linspace(0.0, 2.0, 101)
    named = {"vary": {"k": "0.3..1.2N m/rad log", "c": (0.01, 0.1)}, "compare": {"encoder": "body.angle"}, "starts": 1}
    stands = M0 * np.sin(0.4) / k

    def moves(t, x):
        return x[1], (M0 * np.sin(2 * np.pi * F * t + 0.4) - c * x[1] - k * x[0]) / I

    moving = {"time": time, "encoder": solve_ivp(moves, (0.0, 2.0), (0.0, 0.0), "DOP853", time, rtol=1e-10).y[0]}
    found = identify(hinge, [{"time": None, "encoder": np.full(101, stands)}, moving], **named)
    np.testing.assert_allclose(found.theta, [k, c], rtol=1e-3)
    assert found.to_dataset()["start"].values.tolist() == ["at rest", "as described"]
    assert found.computed[0][0, 0] == pytest.approx(M0 * np.sin(0.4) / found.theta[0], rel=1e-9)
    off = identify(hinge, [{"time": None, "encoder": np.full(101, 1.5 * stands)}, moving], **named)
    assert off.theta[0] < 0.74
