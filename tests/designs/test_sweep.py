"""Sweeps against closed forms and single solutions; axes; what a kill leaves behind."""

import sys

import numpy as np
import pytest
from tests.small_robots import DRIVEN, LOOSE, M0, PENDULUM, SHAKEN, F, I, K

from nectosome.core import Status
from nectosome.description import parse_robot, resolve, with_values
from nectosome.designs.axes import SweepAxis, axis_of
from nectosome.designs.batches import RobotPoints
from nectosome.designs.kept_parts import forget
from nectosome.designs.sweep import plan_of, sweep
from nectosome.robots import describe
from nectosome.solve import periodic
from nectosome.units import InputError

SINKING = """
name: sinking
water: {density: 1000 kg/m3, gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 1 l
  joint: {kind: prismatic, axis: z}
  loads: {drag: {kind: lumped_drag, drag_area: [0 m2, 0 m2, 0.01 m2]}}
aliases:
  area: [body.loads.drag.drag_area.2]
"""


@pytest.fixture(scope="module")
def driven():
    return with_values(parse_robot(DRIVEN), {"c": 0.2, "body.joint.torque.offset": 0.01})


@pytest.fixture(scope="module")
def loose(driven):
    """Without a spring, turning at 0.9 rad/s as it begins."""
    return with_values(driven, {"k": LOOSE, "body.joint.velocity": 0.9})


def power(c, f, inertia=I, stiffness=K):
    """Mean power of a driven oscillator, c |v|^2 / 2."""
    w = 2 * np.pi * f
    return 0.5 * c * abs(1j * w * M0 / (stiffness - inertia * w**2 + 1j * c * w)) ** 2


DAMPING, FREQUENCY = [0.0, 0.02, 0.2, 0.25], [0.7, 1.3]


@pytest.fixture(scope="module")
def swept(driven):
    return sweep(driven, {"c": DAMPING, "f": FREQUENCY}, rtol=1e-7)


def test_a_driven_oscillator_takes_what_its_transfer_function_says(swept):
    c, f = np.meshgrid(np.array(DAMPING), np.array(FREQUENCY), indexing="ij")
    assert swept["power"].dims == ("c", "f")
    np.testing.assert_allclose(swept["power"], power(c, f), rtol=2e-6, atol=1e-9)
    np.testing.assert_allclose(swept["period"], 1 / f, rtol=1e-15)
    assert swept["power"].attrs["units"] == "W"


def test_points_have_the_status_and_numbers_of_periodic_alone(driven, swept):
    assert set(swept["status"].values.ravel()) == {"SOLVED"}
    for c, f in ((0.25, 0.7), (0.02, 1.3)):
        alone = periodic(with_values(driven, {"c": c, "f": f}))
        assert int(alone.status) == int(Status.SOLVED)
        assert float(swept["power"].sel(c=c, f=f)) == pytest.approx(float(alone.means().power), rel=1e-6)


def test_cycles_that_grow_are_unstable_as_alone():
    """A bob on a shaken hinge hangs still: at twice its own frequency that grows (Mathieu)."""
    shaken = sweep(parse_robot(SHAKEN), {"f": [0.5, 0.70486, 1.1]})
    assert shaken["status"].values.tolist() == ["SOLVED", "UNSTABLE", "SOLVED"]
    assert (abs(shaken["power"]) < 1e-9).all()


def test_rests_that_grow_are_unstable_as_alone():
    """A top-heavy rod tips."""
    standing = parse_robot(PENDULUM.replace("axis: y", "axis: y, stiffness: 10 N m/rad, damping: 1 N m s/rad"))
    standing = with_values(standing, {"body.rotation.1": -np.pi / 2})
    over = {"body.joint.stiffness": [4.0, 6.0]}  # m g l / 2 = 4.905 N m/rad
    assert sweep(standing, over)["status"].values.tolist() == ["UNSTABLE", "SOLVED"]


def test_a_sinking_body_is_steady():
    """(rho V - m) g = rho A v^2 / 2."""
    area = [0.01, 0.02, 0.03]
    found = sweep(parse_robot(SINKING), {"area": area})
    np.testing.assert_allclose(found["speed"], np.sqrt(2 * 9.81 / (1000 * np.array(area))), rtol=1e-9)
    assert set(found["status"].values) == {"SOLVED"}
    assert np.isnan(found["period"]).all()


def test_points_that_leave_the_plane_do_not_stay_in_it(monkeypatch, tmp_path):
    """A hinge that lies down carries a pendulum: with its bob above, the spring is the softer by m g r."""
    leaning = parse_robot(
        DRIVEN.replace("gravity: 0 m/s2", "gravity: 9.81 m/s2").replace(
            "body:\n",
            """body:
  centre_of_mass: [-3 mm, 0 m, 0 m]
  volume: 0 m3
  rotation: [0 deg, 0 deg, 0 deg]
""",
        )
    )
    found = sweep(leaning, {"body.rotation.1": [0.0, np.pi / 2]}, ["c=0.2 N m s/rad"], rtol=1e-6)
    flat, upright = found["power"].values
    assert flat == pytest.approx(power(0.2, F, I + 0.003**2), rel=1e-5)
    # the bob swings by a twentieth of a radian: a thousandth of what gravity does is not linear
    assert upright == pytest.approx(power(0.2, F, I + 0.003**2, K - 9.81 * 0.003), rel=1e-4)
    monkeypatch.setattr(sys.modules[RobotPoints.__module__], "_MANY", 1)  # two points are many
    over = {"body.rotation.1": [0.0, np.pi / 2]}
    together = sweep(leaning, over, ["c=0.2 N m s/rad"], rtol=1e-6, folder=tmp_path)
    assert [file.name for file in tmp_path.glob("*.npz")] == ["part-00000.npz"]
    assert together.drop_attrs().identical(found.drop_attrs())


def test_what_has_no_cycle_is_not_a_number(loose):
    """Without a spring the steady part of the torque turns the body on and on, faster and faster without a damper."""
    found = sweep(loose, {"c": [0.0, 0.1]}, rtol=1e-6)
    assert found["status"].values[0] == "NO_PERIOD"
    assert np.isnan(found["power"].values[0])
    assert float(found["power"].values[1]) == pytest.approx(0.01**2 / 0.1 + power(0.1, F, stiffness=0.0), rel=1e-5)


def test_a_count_alone_is_an_axis():
    """The rigid paddle strokes evenly: no thrust."""
    found = sweep("paddle", {"N": [0]}, ["A=60deg", "f=0.7Hz"], samples=33)
    assert found["force"].dims == ("N", "axis")
    assert abs(float(found["force"].sel(N=0, axis="y"))) < 1e-9


def test_points_of_another_kind_are_refused(driven):
    with pytest.raises(InputError, match="free to do without end"):
        sweep(driven, {"k": [0.0, K]})


@pytest.mark.slow
def test_members_of_a_family_stand_side_by_side():
    """A stiff plate rows to and fro alike: no thrust. With a hinge that gives way to one side it has some."""
    found = sweep("paddle", {"N": [0, 1], "A": [np.radians(60)]}, ["f=0.9Hz"], rtol=1e-5)
    assert found["force"].dims == ("N", "A", "axis")
    thrust = -found["force"].sel(axis="y").values[:, 0]
    assert abs(thrust[0]) < 1e-9
    assert 0.2 < thrust[1] < 0.4
    assert np.isnan(found["hinge_stress_peak"].sel(N=0, part="segment1")).all()
    assert (found["hinge_stress_peak"].sel(N=1, part="segment1") > 1e4).all()


def test_a_sweep_goes_on_where_it_was_stopped(driven, tmp_path, monkeypatch):
    grid = {"c": np.linspace(0.22, 0.28, 30).tolist(), "f": FREQUENCY}
    whole = sweep(driven, grid, workers=1)
    computed = []
    solve = RobotPoints.solved
    monkeypatch.setattr(RobotPoints, "solved", lambda self: computed.append(self) or solve(self))
    stopped = sweep(driven, grid, folder=tmp_path / "parts", progress=lambda what, share: share == 0, workers=1)
    assert (stopped["status"] == "CANCELLED").any()
    assert np.isnan(stopped["power"].where(stopped["status"] == "CANCELLED")).all()
    assert len(computed) < 3
    again = sweep(driven, grid, folder=tmp_path / "parts", workers=1)
    assert len(computed) == 3
    assert again.drop_attrs().identical(whole.drop_attrs())
    with pytest.raises(InputError, match="holds parts of another computation"):
        sweep(driven, {"f": FREQUENCY}, folder=tmp_path / "parts")
    monkeypatch.setattr(
        sys.modules[RobotPoints.__module__.replace("batches", "sweep")],
        "provenance",
        lambda settings: {"nectosome": "0"},
    )
    with pytest.raises(InputError, match="holds parts of another computation"):
        sweep(driven, grid, folder=tmp_path / "parts")


def test_a_structure_without_parts_is_cancelled_and_another_keeps_its_numbers():
    """Numbers of the first structure are given here; none is computed."""
    plan = plan_of("paddle", {"N": [0, 1]}, (), 33, 1e-4, whole=False)
    given = {name: np.full((1, *shape), 2.0) for name, shape in plan.grids[0].shapes().items()}
    found = plan.dataset({0: given | {"status": np.array([int(Status.SOLVED)])}})
    assert found["status"].values.tolist() == ["SOLVED", "CANCELLED"]
    np.testing.assert_array_equal(found["power"].values, [2.0, np.nan])


@pytest.mark.slow
def test_a_structure_that_a_stopped_sweep_did_not_come_to_is_cancelled():
    found = sweep("paddle", {"N": [0, 1]}, samples=33, progress=lambda what, share: share == 0, workers=1)
    assert found["status"].values.tolist() == ["SOLVED", "CANCELLED"]
    assert np.isfinite(found["power"].values[0])
    assert np.isnan(found["power"].values[1])


def test_what_else_lies_in_the_folder_of_parts_stays(tmp_path):
    for name in ("part-00000.npz", "part-of-my-thesis.txt"):
        (tmp_path / name).write_text("")
    forget(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["part-of-my-thesis.txt"]
    (tmp_path / "part-of-my-thesis.txt").unlink()
    forget(tmp_path)
    assert not tmp_path.exists()


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("A=30..75:15deg", np.radians([30, 45, 60, 75])),
        ("A=30deg", np.radians([30])),
        ("A = 0.5, 1 rad", [0.5, 1.0]),
        ("A=30deg, 1rad", [np.radians(30), 1.0]),
        ("A=0deg..1rad:30deg", np.radians([0, 30])),
        ("f=0.3..1.3:0.1Hz", [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3]),
        ("f = 0.3 Hz .. 0.5 Hz : 0.1 Hz", [0.3, 0.4, 0.5]),
        ("f=1.3..0.9:-0.2Hz", [1.3, 1.1, 0.9]),
        ("f=0.5..4Hz:2 log", [0.5, 1.0, 2.0, 4.0]),
        ("Cn=1,1.2", [1.0, 1.2]),
        ("Cn=1..8:2 log", [1, 2, 4, 8]),
        ("N=1..3", [1, 2, 3]),
        ("N=1..5:2", [1, 3, 5]),
        ("N=0,5", [0, 5]),
    ],
)
def test_axes_are_read(text, values):
    found = axis_of(*_named(text), describe("paddle"))
    assert isinstance(found, SweepAxis)
    np.testing.assert_allclose(found.values, values, rtol=1e-12)


def test_values_one_by_one_are_in_si_or_text_with_a_unit():
    assert axis_of("f", (x for x in (1, "1.5 Hz", 2.0)), describe("paddle")).values == (1.0, 1.5, 2.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("A", "is not a number"),
        ("A=", "is not a number"),
        ("=1,2", "no quantity called"),
        ("A=30..75deg", "needs a step"),
        ("A=30:75:5deg", "has no readable unit"),
        ("A=thirty deg", "is not a number"),
        ("A=30..75:0deg", "leads nowhere"),
        ("A=30..75:-5deg", "leads nowhere"),
        ("A=0..75deg:2 log", "starts above 0"),
        ("A=30..75deg:1 log", "a ratio above 1"),
        ("A=30..75deg:-2 log", "a ratio above 1"),
        ("f=0..1:1e-9Hz", "too fine"),
        ("A=30,30deg", "takes a value twice"),
        ("A=30,45", "has no unit"),
        ("A=30,45kg", "Angle expected|angle"),
        ("f=-1,1Hz", "at least|out of range|more than"),
        ("B=1,2", 'no quantity called "B"'),
        ("N=1.5", "is a count"),
        ("N=1,2deg", "is an angle"),
    ],
)
def test_wrong_axes_are_told(text, message):
    with pytest.raises(InputError, match=message):
        axis_of(*_named(text), describe("paddle"))


def _named(text: str) -> tuple[str, str]:
    name, _, values = text.partition("=")
    return name.strip(), values


def test_wrong_sweeps_are_told(driven):
    with pytest.raises(InputError, match="nothing to sweep over"):
        sweep(driven, {})
    with pytest.raises(InputError, match="counts the parts of a family"):
        sweep(driven, {"N": [1]})
    with pytest.raises(InputError, match="takes no value"):
        sweep(driven, {"f": []})
    path = resolve(driven, "f")[0]
    with pytest.raises(InputError, match=f"set {path} and f both set {path}"):
        sweep(driven, {"f": [1.0]}, [f"{path}=2 Hz"])
    with pytest.raises(InputError, match=f"f and {path} both set {path}"):
        sweep(driven, {"f": [1.0], path: [1.0, 2.0]})


def test_what_settles_slowly_is_not_taken_for_settled(loose):
    """It turns on and on, and gains a thousandth of what it lacks in a period: torque over damping, not its start."""
    slow = with_values(loose, {"body.joint.torque.offset": 2e-5, "M": 2e-4})
    found = sweep(slow, {"c": [2e-5, 2.5e-5]})
    np.testing.assert_allclose(found["turn_rate"], [1.0, 0.8], rtol=1e-4)
