"""Plans of runs: the grid and its order, ramps, and what is refused before anything moves."""

import math
from pathlib import Path

import numpy as np
import pytest

from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan
from nectosome.units import InputError

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
TAIL = load_rig(RIGS / "fishtail_simulated.yaml")
FINS = load_rig(RIGS / "fins_bench.yaml")
GRID = """
about: sines
signals:
  tail.pressure: {kind: sine, amplitude: [5 kPa, 10 kPa], frequency: [0.5 Hz, 1 Hz, 2 Hz]}
periods: 4
ramp: 0.5 s
settle: 0.2 s
rest: 10 s
repeats: 2
"""


def plan_of(tmp_path, text, rig=TAIL):
    (tmp_path / "plan.yaml").write_text(text)
    return load_plan(tmp_path / "plan.yaml", rig)


def test_lists_are_the_axes_of_a_grid_and_repeats_come_after_the_whole_grid(tmp_path):
    plan = plan_of(tmp_path, GRID)
    grid = [(a, f) for a in ("5 kPa", "10 kPa") for f in ("0.5 Hz", "1 Hz", "2 Hz")]
    assert [tuple(run.conditions.values()) for run in plan.runs] == grid * 2
    assert [run.name for run in plan.runs] == [f"run_{k:03d}" for k in range(1, 13)]


def test_its_time_counts_rest_ramps_periods_and_pauses(tmp_path):
    """0.2 + 2 x 0.5 + 4/f each, and eleven pauses of 10 s."""
    plan = plan_of(tmp_path, GRID)
    assert plan.seconds(plan.runs[0]) == pytest.approx(0.2 + 1.0 + 8.0)
    assert plan.total == pytest.approx(2 * 2 * (3 * 1.2 + 8 + 4 + 2) + 11 * 10)
    assert plan.window(plan.runs[1]) == pytest.approx((0.7, 4.7))


def test_a_random_order_has_every_condition_as_often_and_comes_again_with_its_seed(tmp_path):
    plan = plan_of(tmp_path, GRID + "order: random\nseed: 3\n")
    names = [run.words for run in plan.runs]
    written = [run.words for run in plan_of(tmp_path, GRID).runs]
    assert sorted(names) == sorted(written) != names and names != written
    assert names == [run.words for run in plan_of(tmp_path, GRID + "order: random\nseed: 3\n").runs]
    assert names != [run.words for run in plan_of(tmp_path, GRID + "order: random\nseed: 4\n").runs]


def test_a_sine_grows_as_half_a_cosine_from_rest_and_falls_to_it(tmp_path):
    """The samples of a run: 0 at rest, the formula within its window, the factor within the ramps, 0 at the end."""
    plan = plan_of(tmp_path, GRID)
    run = plan.runs[1]
    found = plan.signals(run)["tail.pressure"]
    t = np.arange(len(found)) * 5e-3
    begin, end = plan.window(run)
    sine = 5e3 * np.sin(2 * math.pi * (t - begin))
    within = (t >= begin) & (t <= end)
    np.testing.assert_allclose(found[within], sine[within], atol=1e-9)
    assert not found[t <= 0.2].any() and found[-1] == 0
    grows = (t > 0.2) & (t < begin)
    factor = 0.5 - 0.5 * np.cos(math.pi * (t - 0.2) / 0.5)
    np.testing.assert_allclose(found[grows], (sine * factor)[grows], atol=1e-9)
    assert np.abs(np.diff(found)).max() <= 5e3 * 2 * math.pi * 5e-3 * 1.01


def test_a_copy_may_be_turned_round_and_ahead(tmp_path):
    text = """
signals:
  servos.left: {kind: sine, amplitude: [10 deg, 20 deg], frequency: 1 Hz}
  servos.right: {kind: copy, of: servos.left, factor: -0.5, phase: 90 deg}
time: 2 s
"""
    plan = plan_of(tmp_path, text, FINS)
    assert [dict(run.conditions) for run in plan.runs] == [{"amplitude": "10 deg"}, {"amplitude": "20 deg"}]
    assert plan.constants == {"frequency": "1 Hz", "factor": "-0.5", "phase": "90 deg"}
    signals = plan.signals(plan.runs[1])
    t = np.arange(len(signals["servos.left"])) * 0.01 - 1.5
    within = (t >= 0) & (t <= 2)
    right = -0.5 * math.radians(20) * np.cos(2 * math.pi * t)
    np.testing.assert_allclose(signals["servos.right"][within], right[within], atol=1e-12)


def test_fields_of_several_signals_are_told_apart(tmp_path):
    text = """
signals:
  servos.left: {kind: step, height: [5 deg, 10 deg]}
  servos.right: {kind: step, height: [0 deg, 20 deg]}
time: 1 s
conditions: {depth: 0.3 m}
"""
    plan = plan_of(tmp_path, text, FINS)
    assert [*plan.runs[3].conditions.items()] == [("servos.left.height", "10 deg"), ("servos.right.height", "20 deg")]
    assert plan.constants == {"depth": "0.3 m"}
    assert plan.columns["servos.left"] == "servos.left"
    assert {"cell.thrust", "servos.right.command"} <= {*plan.columns}


def test_a_file_says_its_own_length(tmp_path):
    (tmp_path / "run.csv").write_text("t (s),pressure (kPa)\n0,0\n1,5\n3,0\n")
    plan = plan_of(tmp_path, "signals: {tail.pressure: {kind: file, file: run.csv, factor: [1, 2]}}\n")
    assert plan.window(plan.runs[0]) == (1.5, 4.5)
    peaks = [float(plan.signals(run)["tail.pressure"].max()) for run in plan.runs]
    assert peaks == pytest.approx([5e3, 1e4])
    before = plan.contents["files"]
    (tmp_path / "run.csv").write_text("t (s),pressure (kPa)\n0,0\n1,4\n3,0\n")
    again = plan_of(tmp_path, "signals: {tail.pressure: {kind: file, file: run.csv, factor: [1, 2]}}\n")
    assert again.contents["files"] != before


def test_every_kind_of_signal_is_played_and_lists_in_a_sum_are_axes_too(tmp_path):
    text = """
signals:
  servos.left:
    kind: sum
    terms:
      - {kind: stroke, amplitude: [5 deg, 10 deg], frequency: 1 Hz, forward_share: 0.3}
      - {kind: rate, rate: 2 deg/s}
  servos.right: {kind: cycle, values: [0 deg, 10 deg, 0 deg, -10 deg], frequency: 1 Hz}
time: 2 s
"""
    plan = plan_of(tmp_path, text, FINS)
    assert [dict(run.conditions) for run in plan.runs] == [{"terms.0.amplitude": a} for a in ("5 deg", "10 deg")]
    assert plan.constants["terms.1.rate"] == "2 deg/s" and plan.constants["terms.0.forward_share"] == "0.3"
    signals = plan.signals(plan.runs[1])
    t = np.arange(len(signals["servos.left"])) * 0.01 - 1.5
    at = np.flatnonzero(np.isclose(t, 0.15))[0]  # half of a forward stroke
    assert signals["servos.left"][at] == pytest.approx(math.radians(10 + 0.3))
    assert signals["servos.right"][np.flatnonzero(np.isclose(t, 0.25))[0]] == pytest.approx(math.radians(10))


def test_a_chirp_lasts_as_long_as_the_signals_unless_it_says_its_time(tmp_path):
    text = """
signals:
  servos.left: {kind: chirp, amplitude: 5 deg, frequency: 0.5 Hz, to: 2 Hz}
  servos.right: {kind: chirp, amplitude: 5 deg, frequency: 0.5 Hz, to: 2 Hz, time: [1 s, 4 s]}
time: 4 s
"""
    short, long = (plan_of(tmp_path, text, FINS).signals(run) for run in plan_of(tmp_path, text, FINS).runs)
    np.testing.assert_array_equal(long["servos.left"], long["servos.right"])
    np.testing.assert_array_equal(long["servos.left"], short["servos.left"])
    t = np.arange(len(short["servos.right"])) * 0.01 - 1.5
    turns = 0.5 * 3 / np.log(4) + 2 * (t - 1)  # 2 Hz from 1 s on
    after = (t >= 1) & (t <= 4)
    wanted = math.radians(5) * np.sin(2 * np.pi * turns[after])
    np.testing.assert_allclose(short["servos.right"][after], wanted, atol=1e-12)


SINE = "{kind: sine, amplitude: [5 kPa, 10 kPa], frequency: [0.5 Hz, 1 Hz, 2 Hz]}"
WRONG = {  # what stands there, what instead, the field, and words of the message
    "beyond the range": ("10 kPa]", "70 kPa]", "signals.tail.pressure", "70 kPa.*goes from.*-60000 to 60000 Pa"),
    "too fast": ("2 Hz]", "20 Hz]", "signals.tail.pressure", "frequency 20 Hz: it changes by up to.*380000 Pa/s"),
    "a jump": (SINE + "\nperiods: 4\nramp: 0.5 s", "{kind: step, height: 5 kPa}\ntime: 1 s\nramp: 0 s",
               "signals.tail.pressure", "it changes.*longer ramp"),
    "another unit": ("10 kPa]", "10 mm]", "signals.tail.pressure.amplitude", "is in m, and Pa is needed"),
    "no command": ("tail.pressure:", "tail.presure:", "signals.tail.presure", 'Did you mean "tail.pressure"'),
    "no kind": ("kind: sine", "kind: square", "signals.tail.pressure", "no kind.*sine"),
    "no time": ("periods: 4\n", "", "time", "give time or periods"),
    "two times": ("periods: 4\n", "periods: 4\ntime: 2 s\n", "periods", "either"),
    "no periods": (SINE, "{kind: step, height: 5 kPa}", "periods", "none of these signals has periods"),
    "no list": ("[5 kPa, 10 kPa]", "[]", "signals.tail.pressure.amplitude", "at least 1"),
    "no column": ("repeats: 2", "columns: {p: tail.pressure}", "columns.p", "tail.pressure.command"),
    "no condition": ("repeats: 2", "names: {f: frequncy}", "names.f", 'no condition "frequncy".*"frequency"'),
    "two names": ("repeats: 2", "names: {f: frequency, F: frequency}", "names", "frequency has two names"),
    "no copy": (SINE, "{kind: copy, of: tail.pressure}", "signals.tail.pressure.of", "no signal"),
    "no file": (SINE + "\nperiods: 4", "{kind: file, file: gone.csv}", None, "gone.csv"),
    "too many": ("repeats: 2", "repeats: 100000", "repeats", "600000 runs"),
}  # fmt: skip


def test_conditions_have_the_names_that_a_plan_gives_them(tmp_path):
    plan = plan_of(tmp_path, GRID.replace("repeats: 2", "names: {f: frequency, A: amplitude}"))
    assert {*plan.runs[0].conditions} == {"A", "f"}
    assert plan.runs[0].conditions["f"] == "0.5 Hz"


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_is_told_before_anything_moves(tmp_path, name):
    old, new, field, words = WRONG[name]
    assert GRID.count(old) == 1
    with pytest.raises(InputError, match=words) as told:
        plan_of(tmp_path, GRID.replace(old, new))
    assert told.value.file in (str(tmp_path / "plan.yaml"), str(tmp_path / "gone.csv"))
    assert field is None or told.value.field == field
