"""What the studio's tabs read and draw, without a browser: points of a map, saved sweeps, what counts of a search."""

import numpy as np
import pytest
import xarray as xr

from nectosome.designs import Problem, read_constraint
from nectosome.designs.sweep import MEANS, nonzero_means
from nectosome.robots import describe
from nectosome.search import Evaluation
from nectosome.studio.tasks.design import SearchProgress, designs_html, line_html, not_begun
from nectosome.studio.tasks.map import place_of
from nectosome.units import InputError
from nectosome.view.saved import check_sweep


@pytest.fixture
def swept():
    shape = ("A", "f"), np.array([[1.0, 2.0, 3.0], [4.0, 5.0, np.nan]])
    return xr.Dataset(
        {name: (*shape, {"units": "W"}) for name in MEANS}
        | {name: (("A", "f", "axis"), np.zeros((2, 3, 3)), {"units": "N"}) for name in ("force", "force_peak")}
        | {"status": (("A", "f"), [["SOLVED"] * 3, ["SOLVED", "SETTLED", "NO_PERIOD"]])},
        coords={
            "A": ("A", np.deg2rad([30.0, 60.0]), {"units": "rad"}),
            "f": ("f", [1.0, 2.0, 3.0], {"units": "Hz"}),
            "axis": ["x", "y", "z"],
        },
        attrs={"robot": "name: paddle", "title": "made up"},
    )


def test_a_point_is_the_nearest_one_in_the_units_of_the_figure(swept):
    """The quantity with more values goes to the right; angles are in degrees."""
    assert place_of("2.2, 58", swept) == {"f": 1, "A": 1}
    assert place_of("1, 30", swept) == {"f": 0, "A": 0}
    for text in ("-9, 0", "0.9, 45", "2, 61", "", "2", "2, x", "2, 58, 1", "nan, 58", "2,"):
        assert place_of(text, swept) is None


def test_a_file_that_is_no_sweep_is_refused_with_the_reason(swept):
    check_sweep(swept, "a.nc")
    for bad, words in (
        (xr.Dataset(), "it has no status"),
        (swept.assign(status=swept["status"].where(swept["f"] < 2, "GOOD")), "its status is not known"),
        (swept.drop_vars("f"), "it has no f"),
        (swept.drop_vars("power"), "it has no power"),
        (swept.drop_vars("force"), "it has no force over A, f, axis"),
        (swept.assign_attrs(robot=""), "its robot is missing"),
    ):
        with pytest.raises(InputError, match=f"a.nc.*{words}"):
            check_sweep(bad, "a.nc")


def test_forces_are_among_the_means_where_something_holds_the_robot(swept):
    """A force counts beside its own peak: weight along z does not hide a small thrust along y."""
    force, peak = np.zeros((2, 3, 3)), np.zeros((2, 3, 3))
    peak[:] = [0.5, 0.01, 4.0]
    force[:] = [1e-5, -0.001, 3.6]
    held = swept.assign(force=swept["force"].copy(data=force), force_peak=swept["force"].copy(data=peak))
    means = nonzero_means(held)
    assert set(means) == {*MEANS, "force.y", "force.z"}
    assert float(means["force.y"].min()) == -0.001
    assert nonzero_means(swept).keys() == {*MEANS}


LIMITS = (read_constraint("torque <= 0.5 N m"),)


def test_what_was_drawn_and_refused_is_no_best_design():
    """Backward at little power keeps the limit, but is no start; the second start found nothing."""
    task = Problem({"E": "2..9MPa"}, minimise="power", keep=LIMITS, forward="-x").motion(describe("flagellum"))

    def evaluated(speed: float, power: float, torque: float) -> Evaluation:
        outputs = {"speed": speed, "power": power, "torque": torque}
        return Evaluation(np.array([0.5]), power, np.array([torque / 0.5 - 1]), outputs=outputs)

    start = [evaluated(-0.1, 1.0, 0.1), evaluated(0.5, 5.0, 0.4), evaluated(0.6, 4.0, 0.6), evaluated(0.5, 4.5, 0.5)]
    search = SearchProgress(task, [start, [evaluated(-0.1, 0.5, 0.1)]])
    assert [(k, e.objective) for k, e in search.best] == [(0, 4.5)]
    assert search.fits(start) == [False, True, False, True]
    assert search.objective_text(search.best[0][1]) == "4.5 W"


@pytest.mark.parametrize(("u", "told"), [(0.9995, True), (1e-4, True), (0.99, False)])
def test_a_best_design_at_an_end_of_its_range_is_told(u, told):
    task = Problem({"E": "2..9MPa"}, minimise="power").motion(describe("flagellum"))
    outputs = {"speed": 0.5, "power": 4.0, "torque": 0.4}
    search = SearchProgress(task, [[Evaluation(np.array([u]), 4.0, np.array([]), outputs=outputs)]])
    assert ("at an end of its range, widen it if the robot allows: E" in designs_html(search)) == told


@pytest.mark.parametrize(("limit", "kept"), [("power <= 9 W", "voltage_demand &lt;= 1"), ("voltage_demand <= 1.2", "")])
def test_limits_that_are_kept_besides_are_told_before_the_first_evaluation(limit, kept):
    problem = Problem({"A1": "10..20deg"}, maximise="speed", keep=(read_constraint(limit),))
    line = line_html(not_begun(problem, problem.motion(describe("tuna"))))
    said = f"Kept besides, since the robot has servos: {kept} (a line of Limits changes it)."
    assert (said in line) if kept else not line
