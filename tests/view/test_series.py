import numpy as np
import pytest
import xarray as xr
from tests.made_up_runs import OMEGA

from nectosome.view import series
from nectosome.view.style import span

# turns as fast as the one that is made up
ROBOT = f"""
name: made up
body: {{kind: rigid, shape: point, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 1 kg m2],
        joint: {{kind: revolute, axis: x, motion: {{kind: rate, rate: {OMEGA} rad/s}}}}}}
"""


def test_speed_is_forward_and_the_turn_is_that_of_the_drive(run):
    assert series.steady_speed(run) == pytest.approx(0.5)
    assert series.drive_rate(run) == pytest.approx(OMEGA)
    start, end = series.last_turn(run.assign_attrs(robot=ROBOT))
    assert (start, end) == pytest.approx((1 - 2 * np.pi / OMEGA, 1))


def test_without_a_drive_the_last_tenth_counts(run):
    passive = run.isel(prescribed=slice(0)).drop_attrs()
    assert series.last_turn(passive) == pytest.approx((0.9, 1.0))
    assert list(series.powers(passive)) == ["drag"]


def driven(run, names, watts):
    """The run with other prescribed coordinates, each with an even power [W]."""
    even = xr.DataArray(np.tile(np.asarray(watts, float), (run.sizes["time"], 1)), dims=("time", "prescribed"))
    bare = run.drop_vars(["prescribed", "reaction", "reaction_power"])
    return bare.assign(reaction_power=even).assign_coords(prescribed=names)


def test_a_prescribed_strain_is_one_line_and_many_drives_are_a_few(run):
    """Its coefficients together; of nine joints five have their own line, and the four with least power one."""
    strains = [f"body.{strain}.{k}" for strain in ("bending_y", "bending_z") for k in range(5)]
    flow = series.powers(driven(run, [*strains, "fin.angle"], [*range(10), -3]))
    sums = {name: power[0] for name, power in flow.items() if name != "drag"}
    assert sums == {"drive of body.bending_y": 10, "drive of body.bending_z": 35, "drive of fin.angle": -3}
    flow = series.powers(driven(run, [f"leg{k}.angle" for k in range(9)], [3, -9, 1, 8, 2, 7, 6, 4, -5]))
    names = [name for name in flow if name != "drag"]
    assert names == [*(f"drive of leg{k}.angle" for k in (1, 3, 5, 6, 8)), "4 other drives"]
    assert flow["4 other drives"][0] == 3 + 1 + 2 + 4


def test_means_of_a_cycle_are_over_the_cycle(run):
    """Not over a part of it: here the body goes to and fro, and comes nowhere."""
    there = np.sin(2 * np.pi * run["time"]).broadcast_like(run["velocity"])
    caption = series.velocity_panel(run.assign(velocity=there).assign_attrs(period=1.0)).caption
    mean = [float(x) for x in caption.partition("mean over the cycle: (")[2].partition(")")[0].split(",")]
    assert mean == pytest.approx([0, 0, 0], abs=1e-9)


def test_forces_are_along_the_forward_axis_of_the_body(run):
    """A push of 2 N along world y on each part, of a body whose x has turned to y; forward is against x."""
    push = xr.zeros_like(run["load_force"])
    push[:, 0, :, 1] = 2.0
    turned = run["rotation"].copy(data=np.broadcast_to([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]], run["rotation"].shape))
    (panel,) = series.force_panels(run.assign(load_force=push, rotation=turned).assign_attrs(forward="-x"))
    (line,) = panel.figure.data
    assert line.name == str(run["load"].values[0])
    np.testing.assert_allclose(line.y, -2.0 * run.sizes["part"], rtol=1e-12)
    assert series.force_panels(run.assign(load_force=xr.zeros_like(push))) == []


def test_the_track_is_in_the_plane_of_the_largest_travel(run):
    place = np.zeros(run["position"].shape)
    time = run["time"].values
    place[:, :, 0], place[:, :, 2] = time[:, None], -3 * time[:, None]
    (panel,) = series.track_panels(run.assign(position=run["position"].copy(data=place)))
    path = panel.figure.data[0]
    np.testing.assert_array_equal([path.x, path.y], [time, -3 * time])
    assert (panel.figure.layout.xaxis.title.text, panel.figure.layout.yaxis.title.text) == ("x (m)", "z (m)")
    assert series.track_panels(run.assign(position=run["position"].copy(data=np.ones(place.shape)))) == []


def test_span_ignores_what_is_no_number():
    assert span([np.nan, 1, 3], room=0.5) == (0, 4)
    assert span([np.nan]) == pytest.approx((-0.08, 1.08))
    assert span([2.0, 2.0]) == pytest.approx((1.9, 2.1))
