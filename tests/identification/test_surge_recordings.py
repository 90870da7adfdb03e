"""Speed and thrust of files as one recording: pairs, clocks, gaps, units, and what is refused."""

import json

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

from nectosome.identification.surge.estimators import fit_surge
from nectosome.identification.surge.files import surge_recordings
from nectosome.units import InputError
from nectosome_studies.poseidrone.recordings import OMEGA, body, settled, thrust

MASS, *TRUTH = body()
UNITS = {"speed": "m/s", "thrust": "N", "position": "m", "crank": "rad"}
W = OMEGA["train"]


def dataset(file, time, conditions=None, **columns):
    data = xr.Dataset(
        {name: ("time", x, {"units": UNITS[name]}) for name, x in columns.items()},
        {"time": time} | {name: ((), x, {"units": unit}) for name, (x, unit) in (conditions or {}).items()},
    )
    return data.assign_attrs(provenance=json.dumps({"file": f"lab/{file}"}))


def swim(**columns):
    """The speed at 50 Hz."""
    time, speed = settled(W)
    return dataset("swim.csv", time, speed=speed, **{name: f(time) for name, f in columns.items()})


def held(later=0.0, rate=200.0, file="hold.csv", **columns):
    """The thrust, of which a clock tells times that are later."""
    time = np.arange(-0.2, 12.5, 1 / rate)
    return dataset(file, time + later, thrust=thrust(W * time), **{name: f(time) for name, f in columns.items()})


def found_in(recordings, within):
    """The truth, found in a single recording."""
    (one,) = surge_recordings(recordings)
    np.testing.assert_allclose(fit_surge([one], MASS).physical.values, TRUTH, rtol=within)
    return one


def test_one_file_with_both():
    one = found_in([swim(thrust=lambda t: thrust(W * t))], 0.02)
    assert (one.name, one.static, one.notes) == ("swim", False, ())


def test_two_files_of_one_clock_and_two_rates():
    one = found_in([held(), swim()], 1e-3)
    assert one.static
    assert one.notes == ("thrust of hold.csv, taken to be on the same clock",)


def test_a_shift_is_taken_off_the_clock_of_its_file():
    other = held(later=0.13).assign_coords(shift=((), 0.13, {"units": "s"}))
    assert found_in([swim(), other], 1e-3).notes == ("thrust of hold.csv, shifted as the campaign says",)


def test_the_crank_tells_where_the_thrust_belongs():
    """Another clock, an encoder that starts anew with each turn, and one that turns the other way."""
    turns = {"crank": lambda t: W * t % (2 * np.pi)}
    one = found_in([swim(**turns), held(later=3.21, **turns)], 2e-3)
    assert one.notes[0] == "thrust of hold.csv, put by the crank angle where it belongs"
    back = {"crank": lambda t: -W * t}
    found_in([swim(**back), held(later=-1.0, **back)], 2e-3)


def test_pairs_are_those_of_the_same_conditions():
    def at(data, omega):
        return data.assign_coords(omega=((), omega, {"units": "rad/s"}), repeat=((), 1, {"units": "1"}))

    strong = held(file="strong.csv")
    strong["thrust"] = 2 * strong["thrust"]
    (one,) = surge_recordings([at(swim(), W), at(strong, 12.0), at(held(), W)])
    assert one.thrust.max() < 0.8
    assert "not used, since no speed was recorded at its conditions: strong.csv" in one.notes
    with pytest.raises(
        InputError, match=r"swim.csv, thrust: has no thrust, and no other file has one at omega 11 rad/s"
    ):
        surge_recordings([at(swim(), 11.0), at(held(), W)])
    with pytest.raises(InputError, match=r"several files .*: strong\.csv, hold\.csv"):
        surge_recordings([at(swim(), W), at(strong, W), at(held(), W)])


def test_gaps_make_stretches_and_missing_values_are_left_out():
    """Of 12 s half a second is missing in the speed, and the thrust ends at 10 s."""
    whole, push = swim(), held()
    kept = (whole["time"] < 4.0) | (whole["time"] > 4.5)
    parts = surge_recordings([whole.isel(time=np.flatnonzero(kept)), push.isel(time=np.flatnonzero(push["time"] < 10))])
    assert [part.name for part in parts] == ["swim, part 1", "swim, part 2"]
    assert "left out" in parts[0].notes[-1]
    assert parts[1].time[-1] <= 10.0
    np.testing.assert_allclose(fit_surge(parts, MASS).physical.values, TRUTH, rtol=1e-3)
    holes = whole.copy()
    holes["speed"] = holes["speed"].where(np.arange(600) % 7 != 3)
    assert "interpolated to even steps of 0.02 s" in found_in([holes, push], 0.02).notes[-1]


def test_positions_are_differentiated_and_the_thrust_goes_through_the_same_filter():
    """A filter on the position alone would make the added mass 3 % larger."""
    time, speed = settled(W)
    where = dataset("track.csv", time, position=CubicSpline(time, speed).antiderivative()(time))
    one = found_in([where, held()], 1e-3)
    assert "speed from positions" in one.notes[-1]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.assign(speed=0 * d["speed"] + 0.08), r"swim.csv, speed: is constant"),
        (
            lambda d: d.assign(speed=d["speed"].assign_attrs(units="kg")),
            r"swim.csv, speed: is in kg; m/s or a multiple",
        ),
        (lambda d: d.assign(speed=d["speed"].assign_attrs(units="")), r"swim.csv, speed: is in no unit"),
        (lambda d: d.rename(speed="v"), r"swim.csv: has no speed, position or thrust, but v\. Name the columns"),
        (lambda d: d.rename(time="row").drop_vars("row"), r"swim.csv: has no time"),
        (lambda d: d.isel(time=slice(5)), r"swim.csv, speed: has 5 values; 20 at least"),
        (lambda d: d.isel(time=slice(1)), r"swim.csv, speed: has 1 value; 20 at least"),
        (lambda d: d.assign_coords(time=d["time"] + 50.0), r"have no 20 samples in common"),
        (lambda d: d.assign_coords(shift=((), 1.0, {"units": "m"})), r"swim.csv, shift: is no time"),
    ],
)
def test_what_is_wrong_names_file_and_column(change, message):
    with pytest.raises(InputError, match=message):
        surge_recordings([change(swim()), held()])


def test_swapped_columns_and_standing_cranks_are_refused():
    both = swim(thrust=lambda t: thrust(W * t))
    swapped = both.rename(speed="thrust", thrust="speed")
    with pytest.raises(InputError, match="swapped"):
        surge_recordings([swapped])
    stands = {"crank": lambda t: np.minimum(W * t, 40.0)}
    with pytest.raises(InputError, match=r"hold.csv, crank: stands still or turns back at 3\.4"):
        surge_recordings([swim(crank=lambda t: W * t), held(**stands)])
    with pytest.raises(InputError, match="no recording of a speed"):
        surge_recordings([held()])
