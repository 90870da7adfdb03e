"""Flows by tables in netCDF files: parabolas come back, slopes are continuous, files are read, bad ones are told."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import xarray as xr

from nectosome.core import current_of
from nectosome.description import dump_robot, load_robot, parse_robot
from nectosome.description.period import drive_period
from nectosome.description.water import WaterDescription
from nectosome.io.schema.quantity import QuantitySource
from nectosome.solve import reading, simulate
from nectosome.units import InputError

TIME, X, Z = np.linspace(0, 2, 6) ** 1.2, np.linspace(-1.0, 1.0, 5), np.array([0.0, 0.1, 0.4, 0.5])
FLOAT = """
name: float
about: A ball as heavy as water, which goes with it.
water:
  flows: {sea: {kind: flow_table, file: sea.nc, factor: 0.5}}
body:
  kind: rigid
  shape: spheroid
  length: 20 mm
  radius: 10 mm
  density: 1000 kg/m3
  joint: {kind: free}
  loads:
    drag: {kind: lumped_drag, drag_area: [3 cm2, 3 cm2, 3 cm2]}
    water: {kind: spheroid_added_mass}
"""


def parabolic(t, x, z):
    """Velocities u and w, of second order along each axis."""
    return 1 + 0.3 * x + 0.2 * x * t**2 + z**2, 0.1 * t**2 - 0.4 * x * z


def table(**changes) -> xr.Dataset:
    u, w = parabolic(*np.meshgrid(TIME, X, Z, indexing="ij"))
    dims = "time", "x", "z"
    data = xr.Dataset(
        {"u": (dims, u, {"units": "m/s"}), "w": (dims[::-1], 100 * w.T, {"units": "cm/s"})},
        {"time": ("time", TIME / 60, {"units": "minutes since 2020-01-01"}), "x": X, "z": Z},
    )
    return data.assign(changes)


def described(folder: Path, data: xr.Dataset) -> WaterDescription:
    data.to_netcdf(folder / "sea.nc", engine="h5netcdf")
    flows = {"flows": {"sea": {"kind": "flow_table", "file": "sea.nc"}}}
    return WaterDescription.model_validate(flows, context=QuantitySource(folder=folder))


def field(folder: Path, data: xr.Dataset):
    found = current_of(described(folder, data))
    assert found is not None
    return jax.jit(lambda t, x: found(t, x))


def test_parabolas_come_back_between_the_outer_points(tmp_path):
    flow = field(tmp_path, table())
    for t, x, z in np.random.default_rng(0).uniform([TIME[1], -0.5, 0.1], [TIME[4], 0.5, 0.4], (5, 3)):
        u, w = parabolic(t, x, z)
        np.testing.assert_allclose(flow(t, jnp.array([x, 7.0, z])), [u, 0.0, w], rtol=1e-12)


def test_points_come_back_and_slopes_are_continuous(tmp_path):
    """At a point of the table; just before and just after it; and beyond the end."""
    data = table(u=(("time", "x", "z"), np.random.default_rng(1).normal(size=(6, 5, 4))))
    flow = field(tmp_path, data)
    at = float(data["u"][2, 3, 1])
    np.testing.assert_allclose(flow(TIME[2], jnp.array([X[3], 0.0, Z[1]]))[0], at, rtol=1e-12)
    slope = jax.jit(jax.jacfwd(flow, argnums=(0, 1)))
    for axis in (0, 1):
        sides = []
        for off in (-1e-9, 1e-9):
            t, x = (TIME[2] + off, X[3]) if axis == 0 else (TIME[2], X[3] + off)
            by_time, by_place = slope(t, jnp.array([x, 0.0, Z[1]]))
            sides.append(np.append(by_time, by_place[:, 0]))
        np.testing.assert_allclose(*sides, atol=1e-6)
    beyond = [flow(t, jnp.array([x, 0.0, 0.5])) for t, x in ((-1.0, 3.0), (0.0, 1.0))]
    np.testing.assert_allclose(*beyond, rtol=1e-12)


def test_a_table_of_one_axis_is_the_same_along_the_others_and_may_be_steady(tmp_path):
    one = table().isel(time=3, x=2, drop=True)
    flow = field(tmp_path, one)
    np.testing.assert_allclose(flow(5.0, jnp.array([3.0, 4.0, 0.4]))[0], one["u"][2], rtol=1e-12)
    assert current_of(described(tmp_path, one)).others[0].steady  # type: ignore[union-attr]
    assert not current_of(described(tmp_path, table())).others[0].steady  # type: ignore[union-attr]


def test_a_ball_goes_with_the_water_of_a_file_which_is_not_needed_any_more(tmp_path):
    """Along x the table gives u = 0.4 m/s at 0.5 of its values; the robot that is written has the numbers itself."""
    data = table(u=(("time", "x", "z"), np.full((6, 5, 4), 0.4)), w=(("time", "x", "z"), np.zeros((6, 5, 4))))
    data.to_netcdf(tmp_path / "sea.nc", engine="h5netcdf")
    (tmp_path / "float.yaml").write_text(FLOAT, encoding="utf-8")
    robot = load_robot(tmp_path / "float.yaml")
    (tmp_path / "sea.nc").unlink()
    again = parse_robot(dump_robot(robot))
    assert again == robot
    with pytest.raises(InputError, match="does not repeat itself"):
        drive_period(again)
    run = simulate(again, 20.0, samples=3)
    assert float(reading(run, "velocity.x")[-1]) == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (table().rename(u="speed", w="other"), "has no u, v or w, the velocities along x, y and z, but speed, other"),
        (table().rename(x="lon"), "has its velocities over time, lon, z. Name these dimensions time, x, y and z"),
        (table().assign_coords(z=Z[::-1]), "the values of z must be numbers that increase"),
        (table().assign_coords(x=("x", X, {"units": "kg"})), "has x in kg, and m is needed"),
        (table(u=table()["u"].where(table()["x"] > -0.9)), "u is no number at time = 0, x = -1, z = 0"),
        (table().isel(x=np.zeros(5, int)), "the values of x must be numbers that increase"),
        (xr.Dataset({"u": (("x",), np.zeros(20001))}, {"x": np.arange(20001.0)}), "20001 points, at most 20000"),
    ],
)
def test_what_is_no_table_is_told(tmp_path, data: xr.Dataset, message: str):
    with pytest.raises((InputError, ValueError)) as caught:
        described(tmp_path, data)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"file": "nothing.nc"}, "nothing.nc"),
        ({}, "Name the netCDF file"),
        ({"velocity": "AAAA", "x": [0.0, 1.0]}, "was cut or changed"),
        ({"velocity": "AAAA", "x": [0.0]}, "is a single one"),
    ],
)
def test_wrong_fields_are_told(tmp_path, fields: dict, message: str):
    with pytest.raises((InputError, ValueError)) as caught:
        WaterDescription.model_validate({"flows": {"sea": {"kind": "flow_table", **fields}}})
    assert message in str(caught.value)
