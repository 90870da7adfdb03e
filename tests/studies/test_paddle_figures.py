import numpy as np
import pytest
import xarray as xr

from nectosome_studies import charts
from nectosome_studies.paddle import figures as paddle
from nectosome_studies.paddle import figures_rowing as rowing


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
    speeds = xr.Dataset(
        {"speed": xr.DataArray(np.ones((2, 2, 2)), coords=swims), "dropped": ("frequency", [1.0, 0.5])},
        attrs={"drop_slope": 4.0},
    )
    steering = xr.Dataset(
        {"rate": ("left", [0.8, 0.0]), "radius": ("left", [0.3, np.inf]), "multiplier": ("left", [0.2, 1.017])},
        coords={"left": np.radians([45.0, 75.0])},
        attrs={"right": np.radians(75.0)},
    )
    heading = xr.Dataset(
        {
            "yaw": (("control", "time"), np.radians([[0.0, 30.0, 90.0], [0.0, 4.0, 1.0]])),
            "amplitude": (("control", "half_stroke", "side"), np.ones((2, 2, 2))),
        },
        coords={"control": ["none", "PID"], "time": [0.0, 0.5, 1.0]},
    )
    own = {"joints": ("row", [3, 1]), "amplitude": ("row", np.radians([75.0, 30.0])), "frequency": ("row", [1.1, 0.5])}
    table5 = xr.Dataset({"printed": ("row", [0.3, 0.1])}, coords=own, attrs={"drag_area": 0.02, "coefficient": 2.1})
    swims = (("row", "trial"), np.ones((2, 3)))
    told = {"printed_yaw": ("row", [0.1, np.nan]), "printed_speed": ("row", [0.3, 0.1])}
    yaw = xr.Dataset({"yaw_mean": swims, "speed": swims, **told}, coords=own)
    differ = np.radians([5.0, 3.0, 4.0])[:, None, None] * np.ones((3, 2, 3))
    servo_yaw = xr.Dataset(
        {"yaw_mean": (("differ", "row", "trial"), differ), **told},
        coords=own | {"differ": ["all", "paddles", "servos"]},
    )
    speed = [[[0.3, 0.2], [0.33, 0.1]]] * 2
    carried = xr.Dataset(
        {"speed": (("drive", "joints", "share"), speed)},
        coords={"drive": ["ideal", "servo"], "joints": [1, 3], "share": [0.0, 1.0]},
    )
    runs = {f"n{n}_{f}Hz": swing() for n in (1, 2, 3) for f in (0.6, 1.1)}
    return {
        "strokes": strokes.assign_attrs(servo_speed_limit=7.0),
        "joints": strokes.isel(amplitude=[1], frequency=[1]),
        "hinges": hinges.assign_attrs(own_thickness=6e-3, own_length=0.05),
        "speeds": speeds,
        "table5": table5,
        "yaw": yaw,
        "servo_yaw": servo_yaw,
        "carried": carried,
        "steering": steering,
        "heading": heading,
        **transfers(),
    }, runs


def transfers():
    """Corrections of two methods on two truths, three experiments by two plans."""
    methods, ratios = ["cn", "svd", "cn-svd", "gp", "cn-gp"], [0.0, 0.25]
    of = ("case", "correction", "ratio")
    errors = {name: (of, np.full((4, 5, 2), 93.4)) for name in ("mean", "coverage")}
    keys = {"truth": ["drop", "drop", "held-out", "held-out"], "noise": [0.02, 0.0] * 2, "seed": [0] * 4}
    keys["recipe"] = ["half at 1.3 Hz", "half at 1.3 Hz", "blind", "blind"]
    found = xr.Dataset(
        {**errors, "floor": (of, np.full((4, 5, 2), 1.6))},
        coords={"correction": methods, "ratio": ratios} | {name: ("case", x) for name, x in keys.items()},
    )
    what = ["simulated", "measured", "cn", "svd", "cn-svd", "cn-gp"]
    grid = {"A": [0.5, 1.0], "f": [0.5, 0.7, 1.1]}
    thrust = (("what", "A", "f"), np.arange(1.0, 37.0).reshape(6, 2, 3))
    maps = xr.Dataset(
        {"thrust": thrust, "made": (("A", "f"), np.eye(2, 3) > 0)}, {"what": what, **grid}, {"ratio": 0.3}
    )
    numbers = (("truth", "seed", "plan", "count"), np.arange(18.0).reshape(1, 2, 3, 3))
    plans = xr.Dataset(
        {"total": numbers, "found": numbers},
        coords={"truth": ["drop"], "plan": ["uniform", "error", "highest"], "count": [4, 5, 6]},
    )
    return {"transfer": found, "transfer_maps": maps, "transfer_plans": plans}


def test_corrections_are_called_synthetic_and_tell_their_intervals(sets):
    panels = [panel for panel in paddle.panels(sets[0], {}) if "Sim-to-real" in panel.title]
    assert len(panels) == 4
    recipes, *panels = panels
    assert "<td>half at 1.3 Hz</td>" in recipes.figure
    assert "synthetic" in recipes.caption
    assert all("Synthetic experiments" in panel.caption for panel in panels)
    assert "93.4 % (noise of 2 %) and 93.4 % (without noise)" in panels[0].caption
    points = next(trace for trace in panels[2].figure.data if trace.name == "measured")
    np.testing.assert_allclose(points.x, [0.5, 0.7])
    np.testing.assert_allclose(points.y, np.degrees([0.5, 1.0]))


def test_figures_are_there_for_which_there_are_data(sets):
    data, runs = sets
    assert len(paddle.panels(data, runs)) == 19
    assert len(paddle.panels(data, {})) == 16
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
    points = paddle.chain(swing())
    np.testing.assert_allclose(np.linalg.norm(points, axis=-1), np.tile([0.0, 1.0, 2.0], (9, 1)))


def test_strokes_are_told_apart_across_the_end_of_the_cycle():
    """Of eight samples the drive goes forward in those before, at and after the start."""
    run = swing()
    run["drive_velocity"].values[[2, 6], 1] = -1e-9  # where it turns back
    forward, back = paddle.strokes(run, "arm.angle")
    assert (forward.tolist(), back.tolist()) == ([7, 0, 1], [2, 3, 4, 5, 6])


def test_printed_speeds_stand_beside_their_own_lines(sets):
    shown = {trace.name: (trace.x.tolist(), trace.y.tolist()) for trace in rowing.speeds_panel(sets[0]).figure.data}
    assert shown["FP3JP, 75 deg, measured"] == ([1.1], [0.3])
    assert shown["FP1JP, 30 deg, measured"] == ([0.5], [0.1])
    assert shown["FP1JP, 75 deg, measured"] == ([], [])


def test_what_a_search_found_takes_the_place_of_the_grids_front(sets):
    data = sets[0]
    searched = xr.Dataset(
        {
            name: ("level", values)
            for name, values in {
                "thrust": [2.5, 3.5],
                "power": [2.2, 3.1],
                "thickness": [4e-3, 6e-3],
                "length": [0.06, 0.08],
            }.items()
        }
    )
    fig = paddle.hinges_panel({**data, "front_power": searched}).figure
    lines = [trace for trace in fig.data if trace.name == "front"]
    assert (lines[0].x.tolist(), lines[0].y.tolist()) == ([2.2, 3.1], [2.5, 3.5])
    assert lines[0].text[0] == "4 mm thick, 60 mm long"
    assert lines[1].y.tolist() == [3.0, 4.0]


def test_strokes_between_the_points_are_told(sets):
    row = {"A": np.radians([49.2, 52.0]), "f": [1.3, 1.2], "thrust": [0.464, 0.5], "power": [0.787, 0.683]}
    layers = {"thickness": [6e-3, 4e-3], "length": [0.105, 0.12]}
    best = xr.Dataset(
        {k: ("chosen", v) for k, v in (row | layers).items()}, {"chosen": ["stroke", "stroke and hinges"]}
    )
    caption = paddle.thrust_panel({**sets[0], "best": best}).caption
    assert "it is 0.464 N at 49.2 deg and 1.3 Hz for 0.79 W" in caption
    assert "0.500 N at 52.0 deg and 1.2 Hz for 0.68 W, with layers 4 mm thick and 120 mm long" in caption


def test_the_circle_of_a_straight_swim_is_not_drawn(sets):
    panel = charts.panels("paddle", sets[0])["Turning by unequal strokes"]
    assert [trace.x.size for trace in panel.figure.data] == [2, 1]
    assert "multiplied by 1.017 in each cycle: it grows" in panel.caption


def test_yaw_on_servos_is_told_with_what_it_comes_from(sets):
    caption = rowing.servo_yaw_panel(sets[0]).caption
    assert "at 1.1 Hz 5.0 deg, 3.0 deg by the paddles alone, 4.0 deg by the servos alone, printed 5.7 deg" in caption


def test_the_order_of_robots_is_told_with_and_without_the_water_of_the_plates(sets):
    caption = charts.panels("paddle", sets[0])["Water that the plates carry along"].caption
    assert "1.10 (on servos 1.10) without it, 0.50 (on servos 0.50) with all of it, printed 1.16" in caption


def test_the_control_is_told_by_the_second_half_of_its_swim(sets):
    assert "yaw is 1.0 deg on the mean and 1.0 deg at most" in rowing.heading_panel(sets[0]).caption
