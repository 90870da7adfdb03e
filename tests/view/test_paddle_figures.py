import numpy as np
import pytest
import xarray as xr

from nectosome.view import chains, paddle


def swing(n=8):
    """A chain of two links, told from the tip to the root, that a drive swings; made up."""
    time = np.linspace(0, 1, n + 1)
    beta = np.sin(2 * np.pi * time)
    along = np.stack([np.cos(beta), np.sin(beta), 0 * beta], axis=-1)
    turn = np.zeros((n + 1, 3, 3, 3))
    turn[..., 0, 0], turn[..., 1, 0] = np.cos(beta)[:, None], np.sin(beta)[:, None]
    return xr.Dataset(
        {
            "position": (("time", "station", "axis"), np.stack([2 * along, along, 0 * along], axis=1)),
            "rotation": (("time", "station", "row", "column"), turn),
            "station_x": ("station", [1.0, 1.0, 0.0]),
            "drive_velocity": (("time", "prescribed"), np.stack([0 * beta, np.cos(2 * np.pi * time)], axis=1)),
            "reaction": (("time", "prescribed"), np.stack([beta, beta], axis=1)),
            "load_force": (("time", "load", "part", "axis"), np.ones((n + 1, 1, 3, 3))),
            "q": (("time", "coordinate"), np.stack([beta] * 3, axis=1)),
        },
        coords={
            "time": time,
            "station_part": ("station", ["segment", "arm", "body"]),
            "part": ["body", "arm", "segment"],
            "axis": ["x", "y", "z"],
            "prescribed": ["body.y", "arm.angle"],
        },
    )


@pytest.fixture
def sets():
    size = {"joints": [1, 2, 3], "amplitude": np.radians([30.0, 75.0]), "frequency": [0.5, 1.1]}
    thrust = xr.DataArray(np.arange(12.0).reshape(3, 2, 2), coords=size)
    speed = 2 * np.pi * thrust["amplitude"] * thrust["frequency"] + 0 * thrust
    strokes = xr.Dataset({"thrust": thrust, "thrust_per_power": thrust, "servo_speed": speed})
    hinge = xr.DataArray([[1.0, 2.0], [3.0, 4.0]], coords={"thickness": [3e-3, 6e-3], "length": [0.05, 0.1]})
    on = hinge > 2
    hinges = xr.Dataset({"thrust": hinge, "power": hinge, "stress": hinge, "front_power": on, "front_stress": on})
    swims = {"joints": [1, 3], "amplitude": size["amplitude"], "frequency": [0.5, 1.1]}
    speeds = xr.Dataset({"speed": xr.DataArray(np.ones((2, 2, 2)), coords=swims)})
    own = {"joints": ("row", [3, 1]), "amplitude": ("row", np.radians([75.0, 30.0])), "frequency": ("row", [1.1, 0.5])}
    table5 = xr.Dataset({"printed": ("row", [0.3, 0.1])}, coords=own, attrs={"drag_area": 0.02})
    yaw = xr.Dataset({"yaw_mean": (("frequency", "trial"), np.ones((2, 3))), "printed": ("frequency", [0.1, 0.2])})
    runs = {f"n{n}_{f}Hz": swing() for n in (1, 2, 3) for f in (0.6, 1.1)}
    return {
        "strokes": strokes.assign_attrs(servo_speed_limit=7.0),
        "joints": strokes.isel(amplitude=[1], frequency=[1]),
        "hinges": hinges.assign_attrs(own_thickness=6e-3, own_length=0.05),
        "speeds": speeds,
        "table5": table5,
        "yaw": yaw.assign_coords(frequency=[1.1, 1.3]),
    }, runs


def test_figures_are_there_for_which_there_are_data(sets):
    data, runs = sets
    assert len(paddle.panels(data, runs)) == 10
    assert len(paddle.panels(data, {})) == 7
    assert paddle.panels({}, {}) == []


def test_the_best_stroke_is_told_and_what_the_servo_can_follow(sets):
    """11 N at the corner; at 30 deg and 1.1 Hz the servo turns at 3.6 rad/s, at 75 deg and 0.5 Hz at 4.1: 10 N."""
    panel = paddle.thrust_panel(sets[0])
    assert "11.000 N, FP3JP at 75 deg and 1.1 Hz" in panel.caption
    assert "10.000 N, FP3JP at 75 deg and 0.5 Hz" in panel.caption
    stars = [trace for trace in panel.figure.data if trace.name == "largest"]
    assert [(trace.x[0], round(trace.y[0])) for trace in stars] == [(1.1, 75)] * 3


def test_the_published_hinge_is_marked(sets):
    panel = paddle.hinges_panel(sets[0])
    star = next(trace for trace in panel.figure.data if trace.name == "as published")
    assert (star.x[0], star.y[0], star.text[0]) == (3.0, 3.0, "6 mm thick, 50 mm long")


def test_a_chain_runs_from_its_root_to_its_tip():
    points = chains.chain(swing())
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), np.tile([0.0, 1.0, 2.0], (9, 1)))


def test_strokes_are_told_apart_across_the_end_of_the_cycle():
    """Of eight moments the drive goes forward in those before, at and after the start."""
    run = swing()
    run["drive_velocity"].values[[2, 6], 1] = -1e-9  # where it turns back
    forward, back = chains.strokes(run, "arm.angle")
    assert (forward.tolist(), back.tolist()) == ([7, 0, 1], [2, 3, 4, 5, 6])


def test_printed_speeds_stand_beside_their_own_lines(sets):
    shown = {trace.name: (trace.x.tolist(), trace.y.tolist()) for trace in paddle.speeds_panel(sets[0]).figure.data}
    assert shown["FP3JP, 75 deg, measured"] == ([1.1], [0.3])
    assert shown["FP1JP, 30 deg, measured"] == ([0.5], [0.1])
    assert shown["FP1JP, 75 deg, measured"] == ([], [])
