"""Guards stop what is beyond a limit, when it is, and nothing else."""

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from nectosome.rigs import CommandLimits, Limits, MeasurementLimits
from nectosome.rigs.guards import Frozen, Guards, Overruns, Timer, slewed
from nectosome.units import InputError

from .faulty import changed

DT = 0.005
COMMAND, MEASURED = CommandLimits(-6e4, 6e4, 3.8e5), MeasurementLimits(-0.02, 0.02, 2e-3)
LIMITS = Limits({"pressure": COMMAND}, {"displacement": MEASURED})
PRESSURE, DISPLACEMENT = {"pressure": "Pa"}, {"displacement": "m"}
NUMBERS = [name for one in (COMMAND, MEASURED, LIMITS) for name, x in vars(one).items() if isinstance(x, float | int)]


def guards(count: int = 10_000, **other) -> Guards:
    limits = changed(LIMITS, **other)
    return Guards(limits, PRESSURE, DISPLACEMENT, DT, count, DISPLACEMENT, PRESSURE)


def first(guard: Guards, samples) -> tuple[float, str]:
    """When and why it stops a row of (late, reference, measured, wanted); (inf, "") where it does not."""
    command = 0.0
    for k, (late, reference, measured, wanted) in enumerate(samples):
        why = guard.sample(late, {"displacement": reference}, (measured,), (command,))
        if why:
            return k * DT, why
        (command,) = guard.allowed((wanted,), (command,), DT)
    return math.inf, ""


def rows(time: float, late=0.0, reference=0.0, measured=None, wanted=0.0) -> np.ndarray:
    """Numbers, or functions of the time; what is measured has noise."""
    t = np.arange(round(time / DT)) * DT
    noise = 1e-6 * np.random.default_rng(0).normal(size=t.size)
    measured = noise if measured is None else measured(t) + noise
    columns = [late, reference, measured, wanted]
    return np.stack([np.broadcast_to(c(t) if callable(c) else c, t.shape) for c in columns], axis=1)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", NUMBERS)
def test_no_limit_can_be_left_open(name, value):
    with pytest.raises(InputError, match=name):
        changed(LIMITS, **{name: value})


@pytest.mark.parametrize(
    "other",
    [{"slew": 0.0}, {"error": -1.0}, {"overruns_in_row": 0}, {"low": 1.0}, {"high": -1.0}, {"least": 0.03}],
)
def test_limits_that_make_no_sense_are_refused(other):
    with pytest.raises(InputError):
        changed(LIMITS, **other)


@given(
    wanted=st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=30),
    elapsed=st.lists(st.floats(-0.01, 1.0), min_size=30, max_size=30),
)
def test_commands_keep_their_range_and_rate_whatever_is_wanted(wanted, elapsed):
    guard, before = guards(), 0.0
    for w, e in zip(wanted, elapsed, strict=False):
        (command,) = guard.allowed((w,), (before,), e)
        assert COMMAND.low <= command <= COMMAND.high
        assert abs(command - before) <= COMMAND.slew * min(max(e, 0.0), DT) * (1 + 1e-12) + 1e-9
        before = command


def test_what_is_allowed_is_let_through_and_the_rest_is_counted():
    guard = guards()
    assert guard.allowed((1000.0,), (0.0,), DT) == (1000.0,)
    assert guard.allowed((1e5,), (59_000.0,), DT) == (6e4,)
    assert guard.allowed((-1e4,), (0.0,), DT) == pytest.approx((-1900.0,))
    assert guard.counts() == {"clamped": 1, "slowed": 1, "overruns": 0, "latest": 0.0}


def test_a_command_that_touches_its_limit_is_not_clamped():
    """0.2 and 0.4 bar are 1e-11 Pa above 0.6 bar in binary numbers."""
    guard, high = guards(), COMMAND.high
    for command in (high, math.nextafter(high, math.inf), high * (1 + 1e-12)):
        assert guard.allowed((command,), (high,), DT) == (high,)
    assert guard.counts()["clamped"] == 0
    assert guard.allowed((high * (1 + 1e-6),), (high,), DT) == (high,)
    assert guard.counts()["clamped"] == 1


def test_slewed_goes_no_further_than_it_may():
    assert (slewed(5.0, 1.0, 2.0), slewed(-5.0, 1.0, 2.0), slewed(1.5, 1.0, 2.0)) == (3.0, -1.0, 1.5)


def test_a_rig_at_rest_is_left_alone_even_without_noise():
    quiet = [(0.0, 0.0, 0.0, 0.0)] * 4000
    assert first(guards(), quiet) == (math.inf, "")


def test_following_with_a_small_error_is_left_alone():
    """12 mm at 0.5 Hz, 1.5 mm behind."""
    reference = lambda t: 0.006 * np.sin(np.pi * t)  # noqa: E731
    samples = rows(20.0, 1e-4, reference, lambda t: reference(t) - 1.5e-3, lambda t: 3e4 * np.sin(np.pi * t))
    assert first(guards(), samples) == (math.inf, "")


@pytest.mark.parametrize(("amplitude", "caught"), [(1.1, False), (1.25, True), (3.0, True)])
@pytest.mark.parametrize("frequency", [0.5, 3.0, 8.0])
def test_an_error_that_swings_is_caught_from_1_2_times_its_limit_on(amplitude, caught, frequency):
    """Though it is below the limit again and again: above it for more than a third of the time."""
    swing = lambda t: amplitude * MEASURED.error * np.sin(2 * np.pi * frequency * t)  # noqa: E731
    when, why = first(guards(), rows(20.0, measured=swing))
    assert (when < 20.0) == caught
    assert ("error" in why) == caught


def test_a_steady_error_is_stopped_after_its_time():
    when, why = first(guards(), rows(3.0, measured=lambda t: np.where(t < 1.0, 0.0, 2.1e-3)))
    assert when == pytest.approx(1.5, abs=2 * DT)
    assert "-0.0021" in why
    assert "0.002 m" in why


def test_a_short_error_is_not():
    jumps = rows(3.0, measured=lambda t: np.where((t > 1.0) & (t < 1.45), 2.1e-3, 0.0))
    assert first(guards(), jumps) == (math.inf, "")


def test_a_frozen_sensor_is_noticed_when_the_command_moves():
    """After 0.25 s, and a tenth of the range."""
    samples = rows(3.0, wanted=lambda t: 2e4 * np.sin(2 * np.pi * t))
    samples[200:, 2] = 1.234e-4
    when, why = first(guards(), samples)
    assert 1.25 <= when < 1.3
    assert "to the last bit" in why


def test_a_frozen_reading_is_counted_from_where_it_began():
    frozen = Frozen(DT)
    for reading, command in [(1.0, 0.0), (2.0, 5.0), (2.0, 7.0), (2.0, 4.0)]:
        frozen.count(reading, command)
    assert (frozen.time, frozen.moved) == (2 * DT, 3.0)


def test_a_command_at_the_end_of_its_range_is_stopped_after_its_time():
    """It takes 0.16 s to get there at the largest rate, which counts."""
    when, why = first(guards(), rows(5.0, wanted=1e6))
    assert when == pytest.approx(2.0, abs=3 * DT)
    assert "end of its range" in why


def test_a_valve_that_opens_one_way_may_rest_shut():
    assert first(guards(low=0.0), rows(20.0, wanted=-1.0)) == (math.inf, "")


def test_a_command_that_swings_at_its_largest_rate_is_stopped():
    """Far from the ends of its range."""
    when, _ = first(guards(), rows(5.0, wanted=lambda t: 1e4 * np.sign(np.sin(2 * np.pi * 10 * t))))
    assert 2.0 <= when < 3.5


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 0.0201, -0.0201])
def test_a_measurement_that_is_none_or_out_of_range_stops_at_once(bad):
    samples = rows(1.0)
    samples[100, 2] = bad
    when, why = first(guards(), samples)
    assert when == 0.5
    assert f"{bad:g} m" in why
    assert "Look" in why


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_command_that_is_none_stops_at_once(bad):
    assert f"{bad:g} Pa" in guards().not_finite((bad,))
    assert guards().not_finite((1e9,)) == ""


def test_late_samples_in_a_row_stop():
    late = lambda t: np.where(t >= 1.0, 0.6 * DT, 0.1 * DT)  # noqa: E731
    when, why = first(guards(), rows(2.0, late))
    assert when == pytest.approx(1.0 + 9 * DT)
    assert "10 samples in a row" in why


def test_late_samples_now_and_then_stop_when_they_are_more_than_their_share():
    """Every fourth of 1000: the 51st is one too many."""
    late = lambda t: np.where(np.round(t / DT) % 4 == 0, 0.6 * DT, 0.0)  # noqa: E731
    when, why = first(guards(1000), rows(5.0, late))
    assert when == pytest.approx(50 * 4 * DT)
    assert "51 samples" in why


def test_the_latest_sample_is_told():
    seen = Overruns()
    for late in (0.0, 3e-3, 1e-3):
        seen.count(late, 2.5e-3)
    assert (seen.total, seen.in_row, seen.latest) == (1, 0, 3e-3)


@pytest.mark.parametrize("late", [-0.1, math.nan])
def test_a_clock_that_goes_back_stops(late):
    assert "too early" in first(guards(), [(late, 0.0, 0.0, 0.0)])[1]


def test_a_timer_counts_back_at_half_the_rate():
    timer = Timer(1.0)
    assert [timer.count(so) for so in (True, True, False, False, False, False, False, True)] == [
        1.0, 2.0, 1.5, 1.0, 0.5, 0.0, 0.0, 1.0,
    ]  # fmt: skip
