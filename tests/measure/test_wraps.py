"""Readings that start again come back as the quantity that made them; what does not start again stays as it is."""

import json

import numpy as np
import pytest

from nectosome.io.schema.validate import validate_as
from nectosome.measure import Sheet, read
from nectosome.units import InputError

TIME = 0.01 * np.arange(1500)
SWING = np.round(8000 * np.sin(3 * TIME) + 30 * np.cos(500 * TIME))  # counts, up to 8030


def recorded(tmp_path, heading, cells, **sheet):
    rows = [f"{t:.2f},{x:.17g}" for t, x in zip(TIME, cells, strict=True)]
    (path := tmp_path / "a.csv").write_text("\n".join([f"time (s),{heading}", *rows]) + "\n")
    run = read(path, validate_as(Sheet, {"columns": {"x": {"column": 2} | sheet}}, "sheet"))
    about = json.loads(run.attrs["provenance"])
    return run["x"].values, run["x"].attrs, about["repairs"] + about["warnings"]


@pytest.mark.parametrize("bits", [16, 24, 32])
@pytest.mark.parametrize("first", [0, 900])  # the second begins below zero
def test_signed_numbers_that_were_read_as_unsigned_are_signed_again(tmp_path, bits, first):
    signed = np.roll(SWING, -first)
    got, about, said = recorded(tmp_path, "current", signed % 2.0**bits)
    np.testing.assert_array_equal(got, signed)
    assert about["minimum"] == signed.min()
    assert said == [f"x: negative numbers of {bits} bits, read as unsigned ones, are negative again"]


def test_negative_numbers_alone_are_clear_with_32_bits_and_asked_for_with_16(tmp_path):
    negative = -100 - np.round(20 * np.sin(TIME))
    np.testing.assert_array_equal(recorded(tmp_path, "x", negative % 2.0**32)[0], negative)
    got, _, said = recorded(tmp_path, "x", negative % 2.0**16)
    np.testing.assert_array_equal(got, negative + 2**16)
    assert "negative numbers read as unsigned ones? If so, write wrap: 65536" in said[0]
    np.testing.assert_array_equal(recorded(tmp_path, "x", negative % 2.0**16, wrap=65536)[0], negative)


@pytest.mark.parametrize(
    ("quantity", "bits", "step"),
    [
        (np.round(60_000 + 800 * TIME), 16, 360 / 4096),  # a counter, in degrees
        (np.round(2000 - 900 * TIME), 16, 0.05),  # backwards
        (np.round(120 * np.sin(2 * TIME - 1)), 16, 2.69),  # a signed current, in mA; its first one is negative
        (np.round(30_000 * np.sin(2 * TIME)), 24, 5 / 2**24),  # a converter, in V
        (np.floor(300 * TIME), 8, 1.0),
    ],
)
def test_a_counter_that_started_again_and_was_scaled_is_asked_for(tmp_path, quantity, bits, step):
    """The period is that of the finest step; with it in a sheet the quantity comes back, signed where that fits."""
    cells = step * (quantity % 2.0**bits)
    got, _, said = recorded(tmp_path, "x", cells)
    np.testing.assert_array_equal(got, cells)
    assert f"write wrap: {step * 2.0**bits:.8g} beside" in said[0]
    got = recorded(tmp_path, "x", cells, wrap=step * 2.0**bits)[0] / step
    fits = -(2.0 ** (bits - 1)) <= quantity.min() and quantity.max() < 2.0 ** (bits - 1)
    turns = 0.0 if fits else (got[0] - quantity[0]) / 2.0**bits
    assert turns == np.round(turns)
    np.testing.assert_allclose(got - turns * 2.0**bits, quantity, atol=1e-6)


@pytest.mark.parametrize("period", [2**11, 2**13, 2**17, 2**20, 2**22, 2000, 4000])
def test_the_period_of_an_encoder_is_asked_for_exactly(tmp_path, period):
    """Of any number of bits, also where no step is a single count; 4000 counts of a turn are not taken for 4096."""
    position = np.floor(period * (0.4 + 0.55 * TIME + 0.3 * np.sin(3 * TIME)))
    assert f"write wrap: {period} beside" in recorded(tmp_path, "position", position % period)[2][0]
    np.testing.assert_array_equal(recorded(tmp_path, "position", position % period, wrap=period)[0], position)


@pytest.mark.parametrize(("heading", "period"), [("position", 2.0**12), ("ticks", 2.0**16), ("angle (deg)", 360.0)])
def test_what_goes_by_more_than_a_quarter_turn_a_sample_is_told(tmp_path, heading, period):
    """0.05 to 0.75 turns a sample: how many is not known. Noise over the whole range is no turning."""
    turning = np.floor(period * np.cumsum(0.4 + 0.35 * np.sin(2 * TIME))) % period
    said = recorded(tmp_path, heading, turning)[2]
    assert any(f"goes by more than a quarter of {period:g} between samples" in note for note in said)
    noise = np.floor(period * np.random.default_rng(0).random(TIME.size))
    assert not any("again" in note for note in recorded(tmp_path, heading, noise)[2])


def test_turns_within_a_gap_are_unknown_and_said(tmp_path):
    """30,000 counts/s: two starts and more fit into a gap of 5 s, none into one of 0.1 s."""
    whole = np.round(30_000 * TIME)
    for gap, unknown in ((TIME > 5) & (TIME < 10), True), ((TIME > 5) & (TIME < 5.1), False):
        cells = np.where(gap, np.nan, whole % 2.0**16)
        got, _, said = recorded(tmp_path, "x", cells)
        np.testing.assert_array_equal(got[TIME < 5], whole[TIME < 5])
        off = (whole - got)[TIME > 10] / 2.0**16
        assert (off == off[0]).all() and off[0] == (2 if unknown else 0)
        assert any("1 gap in which it may have started again" in note for note in said) == unknown


@pytest.mark.parametrize("seed", range(3))
def test_pulses_steps_and_spikes_are_not_taken_for_starts(tmp_path, seed):
    rng = np.random.default_rng(seed)
    slow, is_on = np.cumsum(rng.normal(0, 1e-3, TIME.size)), np.sin(3 * TIME) > 0
    spikes = np.where(rng.random(TIME.size) < 0.01, 400.0, 20 * np.sin(TIME))
    for cells in (
        is_on + 0.01 * rng.normal(size=TIME.size),
        is_on + slow,
        is_on * TIME,
        (TIME > 7) + np.sin(TIME) / 9,
        spikes,
    ):
        assert not any("again" in note for note in recorded(tmp_path, "x", cells)[2])


@pytest.mark.parametrize("sign", [1, -1])
def test_a_counter_counts_on_where_it_starts_again(tmp_path, sign):
    turns = sign * np.round(50_000 * TIME)
    got, _, said = recorded(tmp_path, "encoder", turns % 2.0**16)
    np.testing.assert_array_equal(got - got[0], turns - turns[0])
    times = 11 if sign > 0 else 12  # the first step down starts it again
    assert f"a counter of 16 bits that starts again, {times} times: counted on from there" in said[0]


@pytest.mark.parametrize(("unit", "turn"), [("deg", 360.0), ("rad", 2 * np.pi)])
@pytest.mark.parametrize("low", [0.0, -0.5])  # of its range, in turns
def test_a_direction_goes_on_where_a_turn_ends(tmp_path, unit, turn, low):
    angle = turn * (0.45 + 0.3 * TIME + 0.1 * np.sin(5 * TIME))
    got, about, said = recorded(tmp_path, f"heading ({unit})", (angle - low * turn) % turn + low * turn)
    np.testing.assert_allclose(got - got[0], 2 * np.pi / turn * (angle - angle[0]), atol=1e-12)
    assert about["units"] == "rad"
    assert "times: counted on from there" in said[0]


def test_an_encoder_of_12_bits_is_asked_for_and_counts_on_by_the_sheet(tmp_path):
    position = np.floor(1500 + 2500 * np.sin(TIME) + 800 * TIME)
    got, _, said = recorded(tmp_path, "position", position % 4096)
    np.testing.assert_array_equal(got, position % 4096)
    assert "does it start again? If so, write wrap: 4096 beside the column in a sheet" in said[0]
    np.testing.assert_array_equal(recorded(tmp_path, "position", position % 4096, wrap=4096)[0], position)
    degrees = recorded(tmp_path, "position", position % 4096, wrap=4096, gain="0.087890625 deg/count", unit="count")[0]
    np.testing.assert_allclose(degrees, 2 * np.pi * position / 4096, rtol=1e-12)


@pytest.mark.parametrize(
    "cells",
    [
        np.where(np.sin(TIME) > 0, 65535, 0),  # a trigger
        np.floor(500 + 450 * np.sin(TIME)),  # a converter
        np.round(40_000 + 25_000 * np.sin(TIME)),  # an unsigned one of 16 bits
        65536 * np.abs(np.sin(TIME)),
    ],
)
def test_what_does_not_start_again_stays_as_it_is(tmp_path, cells):
    got, _, said = recorded(tmp_path, "x", cells)
    np.testing.assert_array_equal(got, cells)
    assert not any("again" in note or "unsigned" in note for note in said)


def test_a_sheet_may_forbid_it_and_is_told_where_its_period_does_not_fit(tmp_path):
    swing = SWING % 2.0**16
    np.testing.assert_array_equal(recorded(tmp_path, "x", swing, wrap="none")[0], swing)
    got, _, said = recorded(tmp_path, "x", swing, wrap=600)
    np.testing.assert_array_equal(got, swing)
    assert "x: does not start again after 600: readings or steps do not fit; left as it is" in said
    with pytest.raises(InputError, match=r'x\.wrap: "-5" is out of range: it must be more than 0, or the word none'):
        recorded(tmp_path, "x", swing, wrap=-5)
    with pytest.raises(InputError, match=r"x\.wrap: 3 N has not the dimension of the reading"):
        recorded(tmp_path, "x", swing, wrap="3 N")


@pytest.mark.parametrize(("digits", "half"), [(4, np.pi), (9, np.pi), (0, 180.0), (2, 180.0)])
def test_a_direction_that_was_rounded_beyond_half_a_turn_goes_on(tmp_path, digits, half):
    """-3.1416 rad is a little more than half a turn."""
    angle = half + half / 10 * np.sin(2 * TIME)
    cells = np.round((angle + half) % (2 * half) - half, digits)
    got, about, said = recorded(tmp_path, "yaw (rad)" if half < 4 else "yaw (deg)", cells)
    turned = np.pi / half * angle - (2 * np.pi if cells[0] < 0 else 0.0)
    np.testing.assert_allclose(got, turned, atol=np.pi / half * 10.0**-digits)
    assert about["maximum"] == got.max() and "start again" in said[0]


@pytest.mark.parametrize(("turn", "start"), [(360.0, 0.0), (360.0, -180.0), (2 * np.pi, 0.0)])
def test_a_direction_without_a_unit_is_asked_for(tmp_path, turn, start):
    cells = (turn * (0.9 + 0.3 * TIME) - start) % turn + start
    got, _, said = recorded(tmp_path, "heading", cells)
    np.testing.assert_array_equal(got, cells)
    assert f"does it start again? If so, write wrap: {turn:.8g} beside" in said[0]
