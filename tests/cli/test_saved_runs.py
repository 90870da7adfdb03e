"""Saved runs that lack arrays, as those of older versions: shown without these, or one sentence says what lacks."""

from pathlib import Path

import numpy as np
from tests.measured_files import means, recorded, tracked
from tests.solve.test_stroke import FIN

import nectosome as ns
from nectosome.io import load_dataset, save_dataset
from nectosome.solve.summaries.run_summary import run_summary as summary
from nectosome.solve.summaries.stroke_tables import OF_BEATS
from nectosome.units import InputError
from nectosome.view.saved import saved_run

# a hull with a fin whose servo has limits, an arm with a servo on a battery, and a tendon over the arm
ROBOT = (
    FIN.replace("name: fin", "name: kept")
    .replace("body:", "batteries: {pack: {voltage: 12 V, resistance: 0.4 ohm, capacity: 1 Ah}}\nbody:")
    .replace("frequency: 1.25 Hz}}", "frequency: 4 Hz}, limits: {torque: 90 N m, speed: 600 rpm}}")
    + """
  arm:
    on: body
    kind: rigid
    shape: box
    length: 0.1 m
    width: 4 mm
    height: 60 mm
    mass: 0.1 kg
    joint:
      kind: revolute
      axis: z
      motion: {kind: sine, amplitude: 5 deg, frequency: 4 Hz}
      servo: {model: XW540-T140-R, battery: pack, full_voltage_at: 12 deg, inertia: 20 g m2}
tendons: {cord: {over: {arm: 10 mm}, stiffness: 100 N/m}}
"""
)


def test_each_array_that_lacks_is_done_without_or_told(nectosome):
    """The tables of a run without one of its arrays or names, and the page without all that it can do without."""
    Path("kept.yaml").write_text(ROBOT)
    whole = ns.simulate("kept.yaml", "0.8s", samples=81).to_dataset()
    assert {"speed_error", "tension", "drive_velocity_limit", "impulse_energy", *OF_BEATS} <= {*whole.data_vars}
    told, done = set[str](), set[str]()
    for name in map(str, whole.variables):
        try:
            run = saved_run(whole.drop_vars(name), "less.nc")
        except InputError as error:
            assert error.file == "less.nc" and name in error.message
            assert error.message.startswith("this is not a simulation: ")
            told.add(name)
            continue
        lines = summary({str(key): x.values for key, x in run.variables.items()}, run.attrs, each=True).lines(80)
        assert "nan" not in "\n".join(map(str, lines)), name
        done.add(name)
    assert {"position", "load_power", "motor", "tendon", "axis"} <= told
    assert {"speed_error", "voltage_demand", "tension", "drive_velocity", "momentum_balance", "strouhal"} <= done
    save_dataset(whole.drop_vars("motor"), Path("less.nc"))
    answer = nectosome("show", "less.nc")
    assert (answer.code, answer.out) == (2, "") and answer.err.endswith("its motor has no names.\n")
    save_dataset(whole.drop_vars([*done]), Path("least.nc"))
    answer = nectosome("show", "least.nc", "--plot", "least.html")
    assert (answer.code, answer.err) == (0, "") and "Track" in Path("least.html").read_text()


def test_what_lacks_is_not_a_number_and_what_is_there_stays(nectosome):
    """A file without speed errors shows the currents that it has."""
    Path("kept.yaml").write_text(ROBOT)
    assert nectosome("simulate", "kept.yaml", "--time", "0.8s", "--samples", "81", "--save", "kept.nc").code == 0
    whole = load_dataset("kept.nc")
    # nor with numbers of the flow that came later
    save_dataset(whole.drop_vars("speed_error").isel(number=slice(5)), Path("old.nc"))
    assert nectosome("show", "old.nc").out == nectosome("show", "kept.nc").out
    current = float(np.abs(whole["current"]).max())
    assert f"{current:.4g}" in nectosome("show", "old.nc").out


def test_what_measure_and_track_saved_is_shown(nectosome, tmp_path):
    """The words and the page of the command that saved it; damaged files and options of runs are refused."""
    files = {"push.nc": recorded(tmp_path), "means.nc": means(), "track.nc": tracked()}
    for name, data in files.items():
        save_dataset(data, tmp_path / name)
    save_dataset(tracked().drop_vars("quality"), tmp_path / "bad.nc")
    said = {name: nectosome("show", str(tmp_path / name), "--plot", f"{name}.html") for name in files}
    assert all(answer.code == 0 and Path(f"{name}.html").exists() for name, answer in said.items())
    told = {name: " ".join(answer.out.split()) for name, answer in said.items()}
    assert "push push 1 2 3 N 0" in told["push.nc"]
    assert "20 deg, 0.4 Hz" in told["means.nc"]
    assert "tail 80.0 %" in told["track.nc"]
    bad = nectosome("show", str(tmp_path / "bad.nc"))
    assert bad.code == 2 and "this is not a track of segments: it has no quality over time, segment" in bad.err
    loads = nectosome("show", str(tmp_path / "push.nc"), "--loads")
    assert (loads.code, loads.err) == (2, "--loads: is for a saved run, and this is a recording.\n")
