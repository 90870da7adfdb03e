"""References: values, lengths, periods, and the frequency that each sample belongs to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.controllers import Reference, eased, local_frequency, times, wave
from nectosome.units import InputError

DT = 5e-3


def sine(amplitude, frequency, time, dt):
    return wave("sine", time, dt, amplitude=amplitude, frequency=frequency)


def triangle(amplitude, frequency, time, dt):
    return wave("triangle", time, dt, amplitude=amplitude, frequency=frequency)


def chirp(amplitude, first, last, time, dt):
    return wave("chirp", time, dt, amplitude=amplitude, frequency=first, to=last)


def varying(amplitudes, frequencies, dt):
    return wave("varying", None, dt, amplitude=amplitudes, frequency=frequencies)


hertz = st.floats(0.1, 4.0)
sizes = st.floats(1e-3, 1e3)


@pytest.mark.parametrize(("time", "count"), [(1.0, 201), (0.3, 61), (0.0, 1), (0.0049, 1), (0.012, 3)])
def test_times_go_from_0_to_the_last_sample_within(time, count):
    """0.3/0.005 is less than 60 by rounding: its sample is there."""
    t = times(time, DT)
    assert len(t) == count
    np.testing.assert_allclose(t, np.arange(count) * DT, rtol=1e-15)


@given(sizes, hertz)
def test_a_sine_and_a_triangle_turn_together(amplitude, frequency):
    t = times(3.0, DT)
    round_, sharp = (one(amplitude, frequency, 3.0, DT) for one in (sine, triangle))
    np.testing.assert_allclose(round_, amplitude * np.sin(2 * np.pi * frequency * t), rtol=1e-12)
    np.testing.assert_allclose(np.sin(0.5 * np.pi * sharp / amplitude), round_ / amplitude, atol=1e-9)
    assert np.abs(sharp).max() <= amplitude * (1 + 1e-12)
    rates = np.abs(np.diff(sharp)) / DT
    assert rates.max() == pytest.approx(4 * amplitude * frequency, rel=1e-6)
    straight = np.isclose(rates, 4 * amplitude * frequency, rtol=1e-6)
    assert np.sum(~straight) <= 2 * 3.0 * frequency + 1  # samples around the turns


@given(st.lists(st.tuples(sizes, hertz), min_size=1, max_size=5))
def test_each_sine_of_a_varying_reference_has_one_period(parts):
    amplitudes, frequencies = zip(*parts, strict=True)
    found = varying(amplitudes, frequencies, DT)
    ends = np.concatenate([[0.0], np.cumsum(1 / np.array(frequencies))])
    assert len(found) == len(times(ends[-1], DT))
    t = np.arange(len(found)) * DT
    for amplitude, frequency, begin, end in zip(amplitudes, frequencies, ends[:-1], ends[1:], strict=True):
        mine = (t > begin + 1e-9) & (t < end - 1e-9)
        wanted = amplitude * np.sin(2 * np.pi * frequency * (t[mine] - begin))
        np.testing.assert_allclose(found[mine], wanted, atol=1e-9 * amplitude)


def test_the_rate_of_a_varying_reference_jumps_between_its_sines():
    """From 2 pi 0.5 to 2 pi 2 per second at t = 2 s; the value does not."""
    found = varying((1.0, 1.0), (0.5, 2.0), 1e-4)
    rates = np.diff(found) / 1e-4
    assert found[20000] == pytest.approx(0.0, abs=1e-9)
    assert rates[19999] == pytest.approx(np.pi, rel=1e-4)
    assert rates[20000] == pytest.approx(4 * np.pi, rel=1e-4)


@pytest.mark.parametrize(("amplitudes", "frequencies"), [((1.0, 2.0), (0.5,)), ((), ())])
def test_as_many_amplitudes_as_frequencies_are_needed(amplitudes, frequencies):
    with pytest.raises(InputError, match=r"as many are needed|at least 1 value expected"):
        varying(amplitudes, frequencies, DT)


@given(hertz, hertz, sizes)
def test_the_frequency_of_a_chirp_grows_by_equal_shares(first, last, amplitude):
    """Its k-th zero is where the turns are k/2: f_0 (e^(g t) - 1)/g with g = log(f_1/f_0)/T."""
    found = chirp(amplitude, first, last, 10.0, 1e-3)
    assert np.abs(found).max() <= amplitude
    assert found[0] == 0.0
    k = np.flatnonzero(np.diff(np.sign(found[1:])) != 0) + 1
    zeros = 1e-3 * (k - found[k] / (found[k + 1] - found[k]))
    half = 0.5 * np.arange(1, len(zeros) + 1)
    g = np.log(last / first) / 10.0
    wanted = np.log1p(g * half / first) / g if abs(g) > 1e-6 else half / first
    np.testing.assert_allclose(zeros, wanted, atol=1e-5)


def test_a_chirp_begins_with_its_first_frequency_and_ends_with_its_last():
    found = chirp(1.0, 0.5, 8.0, 20.0, 1e-4)
    frequency = local_frequency(found, 1e-4)
    g = np.log(16) / 20.0
    assert frequency[0] == pytest.approx(0.5 * g / np.log((1 + 0.75 * g / 0.5) / (1 + 0.25 * g / 0.5)), rel=1e-3)
    assert frequency[-1] == pytest.approx(8.0, rel=0.02)
    assert frequency[100_000] == pytest.approx(2.0, rel=0.05)  # the geometric mean, in the middle
    np.testing.assert_allclose(chirp(2.0, 1.5, 1.5, 3.0, DT), sine(2.0, 1.5, 3.0, DT), atol=1e-12)


def test_what_is_eased_begins_at_rest_and_is_as_it_was_later():
    plain = sine(1.0, 0.5, 4.0, DT)
    found = eased(plain, 1.0, DT)
    np.testing.assert_array_equal(found[200:], plain[200:])
    share = found[1:200] / plain[1:200]
    assert np.all(np.diff(share) > 0)
    assert share[99] == pytest.approx(0.5, rel=1e-12)
    assert found[1] == pytest.approx(plain[1] * DT**2 * (3 - 2 * DT), rel=1e-12)


@given(st.sampled_from([sine, triangle]), sizes, st.floats(0.5, 4.0))
def test_the_local_frequency_of_a_wave_is_its_own(wave, amplitude, frequency):
    """To within a sample in half a period."""
    found = local_frequency(wave(amplitude, frequency, 5.0, DT), DT)
    assert len(found) == 1001
    np.testing.assert_allclose(found, frequency, rtol=1.001 * DT / (0.5 / frequency - DT))


def test_the_local_frequency_of_a_varying_reference_is_that_of_each_sine():
    """Between the first and the last turn of each period; half a wave of both where one goes over into the other."""
    found = local_frequency(varying((1.0, 2.0), (0.5, 2.0), 1e-3), 1e-3)
    np.testing.assert_allclose(found[:1500], 0.5, rtol=2e-3)
    np.testing.assert_allclose(found[2126:], 2.0, rtol=1e-2)
    np.testing.assert_allclose(found[1502:2124], 0.5 / 0.625, rtol=4e-3)  # from 3/4 of 2 s to 1/4 of 0.5 s


def test_what_does_not_turn_twice_has_no_frequency():
    for still in (np.zeros(50), np.full(50, 3.0), np.linspace(0, 1, 50), np.abs(np.linspace(-1, 1, 50)), np.ones(1)):
        np.testing.assert_array_equal(local_frequency(still, DT), np.zeros(len(still)))


def test_rests_do_not_turn_a_reference():
    """Up, rest, up, down, down to a rest, up: two turns, 100 samples apart."""
    up = np.arange(1.0, 51.0)
    found = np.concatenate([up, np.full(30, 50.0), 50 + up, 100 - up, 50 - up, np.zeros(40), up])
    frequency = local_frequency(found, DT)
    turns = 0.5 / ((100 + 40) * DT)  # the rest below belongs to what came before it
    np.testing.assert_allclose(frequency, turns, rtol=0.03)


def test_a_constant_is_read_with_its_unit_and_shown_in_it():
    found = Reference.parse(" 30deg ", "angle")
    assert (found.kind, found.unit, found.constant) == ("constant", "deg", pytest.approx(np.pi / 6))
    np.testing.assert_allclose(found.samples(1.0, 0.5, start=9.0), np.pi / 6)
    assert found.show(np.pi / 2) == "90 deg"
    assert found.duration(0.1) == 10.0


def test_shapes_oscillate_about_the_start():
    """Two periods where no time is given; a chirp needs one."""
    options = {"amplitude": "6 mm", "frequency": "0.5 Hz"}
    for kind, shape in (("sine", sine), ("triangle", triangle)):
        found = Reference.parse(kind, "length", **options)
        assert found.duration(DT) == 4.0
        np.testing.assert_array_equal(found.samples(4.0, DT, start=0.1), 0.1 + shape(6e-3, 0.5, 4.0, DT))
    found = Reference.parse("chirp", "length", **options, to="2Hz")
    np.testing.assert_array_equal(found.samples(3.0, DT), chirp(6e-3, 0.5, 2.0, 3.0, DT))
    with pytest.raises(InputError, match="time: a chirp needs it"):
        found.duration(DT)
    found = Reference.parse("varying", "length", amplitude="4mm, 6 mm", frequency="0.5Hz,1Hz")
    np.testing.assert_array_equal(found.samples(3.0, DT), varying((4e-3, 6e-3), (0.5, 1.0), DT))
    assert found.duration(DT) == 3.0 and found.constant is None


def test_every_kind_of_signal_is_a_reference_with_its_fields():
    """Without an offset it goes about the start; a stroke of 0.3 of its period forward is at its largest there."""
    text = "{kind: stroke, amplitude: 6 mm, frequency: 0.5 Hz, forward_share: 0.3}"
    found = Reference.parse(text, "length")
    assert (found.kind, found.unit, found.duration(DT)) == ("stroke", "mm", 4.0)
    samples = found.samples(2.0, 0.1, start=0.1)
    assert samples[3] == samples.max() == pytest.approx(0.106) and samples[0] == pytest.approx(0.1)
    fields = {"kind": "sum", "terms": [{"kind": "constant", "value": 0.1}, {"kind": "rate", "rate": 0.02}]}
    ramp = Reference.parse(fields, "length")
    np.testing.assert_allclose(ramp.samples(2.0, 1.0), [0.1, 0.12, 0.14], rtol=1e-12)
    assert ramp.duration(DT) == 10.0


def test_numbers_and_arrays_are_in_si():
    assert Reference.parse(0.5, "angle").show(0.5) == "0.5 rad"
    found = Reference.parse(np.array([1.0, 2.0, 4.0]), "length")
    assert found.duration(0.1) == pytest.approx(0.2)
    np.testing.assert_array_equal(found.samples(0.4, 0.1), [1, 2, 4, 4, 4])
    assert Reference.parse(found, "length") is found
    with pytest.raises(InputError, match="no finite number"):
        Reference.parse([1.0, np.nan], "length")  # type: ignore[arg-type]


def test_a_recording_is_put_on_samples(tmp_path):
    file = tmp_path / "wanted.csv"
    file.write_text("time (s),displacement (mm)\n2,0\n3,5\n5,0\n")
    found = Reference.parse(file, "length")
    np.testing.assert_allclose(
        found.samples(found.duration(0.5), 0.5), np.array([0, 2.5, 5, 3.75, 2.5, 1.25, 0]) * 1e-3
    )
    file.write_text("time (s),a (mm),b (m),p (bar)\n0,0,1,1\n1,5,2,1\n")
    with pytest.raises(InputError, match=r"column: .* has several columns of this quantity: a, b"):
        Reference.parse(file, "length")
    np.testing.assert_allclose(Reference.parse(file, "length", column="b").samples(1.0, 0.5), [1.0, 1.5, 2.0])
    np.testing.assert_allclose(Reference.parse(file, "pressure").samples(1.0, 1.0), [1e5, 1e5])


@pytest.mark.parametrize(("text", "options", "why"), [
    ("time (s),displacement (mm)\n0,0\n1,\n3,0\n", {}, "1 row missing.* at 1 s"),
    ("time (s),pressure (bar)\n0,0\n1,1\n", {}, "no column of .* is a length; it has pressure"),
    ("time (s),pressure (bar)\n0,0\n1,1\n", {"column": "pressure"}, "has it in Pa. Length expected"),
    ("time (s),pressure (bar)\n0,0\n1,1\n", {"column": "presure"}, "pressure"),
])  # fmt: skip
def test_a_recording_without_the_quantity_is_refused(tmp_path, text, options, why):
    (tmp_path / "wanted.csv").write_text(text)
    with pytest.raises(InputError, match=why):
        Reference.parse(str(tmp_path / "wanted.csv"), "length", **options)


@pytest.mark.parametrize(("reference", "options", "field"), [
    ("sine", {"amplitude": "6mm"}, "frequency"),
    ("sine", {"amplitude": "6mm", "frequency": "1Hz", "to": "2Hz"}, "to"),
    ("sine", {"amplitude": "0mm", "frequency": "1Hz"}, "amplitude"),
    ("varying", {"amplitude": "6mm,4mm", "frequency": "1Hz"}, "frequency"),
    ("1mm", {"amplitude": "6mm"}, "amplitude"),
    ("1mm", {"column": "a"}, "column"),
    ("1", {}, "reference"),
    ("1deg", {}, "reference"),
    ("sinus", {}, "reference"),
    ("{kind: sinus}", {}, "reference"),
    ("{kind: stroke, amplitude: 6 mm}", {}, "reference"),
    ("{kind: stroke, amplitude: 6 mm, frequency: 1 Hz}", {"amplitude": "6mm"}, "amplitude"),
    ("stroke", {"amplitude": "6mm", "frequency": "0 Hz"}, "frequency"),
    (1.0, {"frequency": "1Hz"}, "frequency"),
])  # fmt: skip
def test_options_that_are_missing_or_do_not_belong_there_are_named(reference, options, field):
    with pytest.raises(InputError) as told:
        Reference.parse(reference, "length", **options)
    assert told.value.field == field
