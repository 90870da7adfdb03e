"""Signals tell their own derivatives; water tells the acceleration of its flow."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from nectosome.core import (
    Chirp,
    Constant,
    Cycle,
    Jump,
    Rate,
    Recording,
    Shaped,
    Sine,
    SmoothRecording,
    Solution,
    Status,
    Steps,
    Stroke,
    Sum,
    Triangle,
    UniformCurrent,
    Varying,
    Water,
    sampled,
    signal_of,
)
from nectosome.core.signals import crest_phases
from nectosome.description.fields import Number
from nectosome.description.signals import MultisineSignal

number = jnp.asarray
SMOOTH = {
    "constant": Constant(number(0.7)),
    "rate": Rate(number(-3.0), number(0.2)),
    "sine": Sine(number(0.4), number(1.5), number(0.3), number(-0.1)),
    "stroke": Stroke(number(0.4), number(1.5), number(0.3), number(-0.1), number(0.3)),
    "cycle": Cycle(jnp.array([0.3, -0.2, 0.8, 0.1, 0.4]), number(1.5), number(0.3)),
    "triangle": Triangle(number(0.4), number(1.5), number(0.3), number(-0.1)),
    "chirp": Chirp(*map(number, (0.4, 0.5, 0.3, -0.1, 3.0, 4.0))),
    "even chirp": Chirp(*map(number, (0.4, 1.5, 0.3, -0.1, 1.5, 4.0))),
    "varying": Varying(jnp.array([0.4, 0.2]), jnp.array([1.5, 2.0]), number(-0.1)),
    "multisine": signal_of(MultisineSignal[Number](kind="multisine", amplitude=0.4, frequency=0.5, phase=0.3, to=3.0)),
    "vector": Sine(jnp.array([0.4, 0.1]), jnp.array([1.5, 0.0]), jnp.array([0.3, 1.0]), jnp.zeros(2)),
}
# and those that grow from rest
RAMPED = {
    name: replace(SMOOTH[name], ramp=number(0.8)) for name in ("rate", "sine", "stroke", "cycle", "triangle", "chirp")
}
SMOOTH |= {f"{name} with a ramp": signal for name, signal in RAMPED.items()}
KNOTS, HEIGHTS = np.array([-0.2, 0.3, 0.35, 1.0, 2.1, 40.0]), np.array([0.3, -0.2, 0.1, 0.8, 0.1, 0.4])
SMOOTH["smooth recording"] = SmoothRecording.through(jnp.asarray(KNOTS), jnp.asarray(HEIGHTS))
SMOOTH["shaped"] = Shaped(SMOOTH["smooth recording"], jnp.array([2.0, -0.5]))
SMOOTH["sum"] = Sum((SMOOTH["sine"], SMOOTH["rate"], SMOOTH["stroke with a ramp"]))
RECORDING = Recording(jnp.array([0.0, 0.5, 0.6, 2.0]), jnp.array([1.0, 2.0, 0.0, 0.7]))


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("t", [0.0, 0.37, 12.0])
def test_derivatives_are_those_of_the_value(name, t):
    """At the beginning of a chirp the second one jumps, so that it is tested right after it."""
    t += 1e-3 * ("chirp" in name)

    @jax.jit
    def compare(t):
        signal = lambda t: SMOOTH[name](t)[0]  # noqa: E731
        return SMOOTH[name](t), (signal(t), jax.jacfwd(signal)(t), jax.jacfwd(jax.jacfwd(signal))(t))

    told, found = compare(number(t))
    for a, b in zip(told, found, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-12)


def test_a_cycle_is_the_periodic_spline_through_its_values():
    """As SciPy's; its phase and its period count as those of a sine do."""
    values, f, phase = np.array([0.3, -0.2, 0.8, 0.1, 0.4]), 1.5, 0.3
    spline = CubicSpline(np.arange(6) / 5, [*values, values[0]], bc_type="periodic")
    for t in (-3.1, 0.0, 0.26, 7.77):
        turns = (f * t + phase / (2 * np.pi)) % 1
        wanted = [f**k * spline(turns, k) for k in range(3)]
        np.testing.assert_allclose(SMOOTH["cycle"](number(t)), wanted, rtol=1e-9, atol=1e-9)


def test_a_smooth_recording_is_the_spline_through_its_samples():
    """As SciPy's, whose third derivative is continuous at the last inner samples; uneven times, also only four."""
    for n in (4, 5, 6):
        recording = SmoothRecording.through(jnp.asarray(KNOTS[:n]), jnp.asarray(HEIGHTS[:n]))
        spline = CubicSpline(KNOTS[:n], HEIGHTS[:n], bc_type="not-a-knot")
        for t in np.linspace(KNOTS[0], KNOTS[n - 1], 23):
            np.testing.assert_allclose(recording(number(t)), [spline(t, k) for k in range(3)], rtol=1e-9, atol=1e-9)


def test_a_smooth_recording_of_a_cubic_is_that_cubic():
    """u = t^3 - 2 t^2 + 3, whatever the times, to its ends."""
    recording = SmoothRecording.through(jnp.asarray(KNOTS), jnp.asarray(KNOTS**3 - 2 * KNOTS**2 + 3))
    for t in (-0.2, 0.31, 1.7, 39.0, 40.0):
        wanted = t**3 - 2 * t**2 + 3, 3 * t**2 - 4 * t, 6 * t - 4
        np.testing.assert_allclose(recording(number(t)), wanted, rtol=1e-10, atol=1e-10)


def test_a_smooth_recording_of_a_sine_converges_to_it_with_the_fourth_power_of_the_interval():
    def worst(n):
        t = np.linspace(0.0, 2.0, n)
        recording = SmoothRecording.through(jnp.asarray(t), jnp.sin(3 * t))
        at = jnp.linspace(0.5, 1.5, 301)  # away from the ends, where it converges faster at first
        return np.abs(jax.vmap(recording)(at)[0] - np.sin(3 * at)).max()

    assert worst(41) / worst(81) == pytest.approx(16.0, rel=0.02)


def test_outside_of_its_samples_a_smooth_recording_stands_still():
    for t, u in ((-0.3, HEIGHTS[0]), (40.1, HEIGHTS[-1])):
        np.testing.assert_array_equal(SMOOTH["smooth recording"](number(t)), [u, 0.0, 0.0])


def test_a_stroke_of_equal_halves_is_a_sine():
    stroke = Stroke(*(number(x) for x in (0.4, 1.5, 0.3, -0.1, 0.5)))
    for t in (0.0, 0.2, 0.41, 3.3):
        np.testing.assert_allclose(stroke(number(t)), SMOOTH["sine"](number(t)), atol=1e-13)


def test_a_stroke_goes_to_and_fro_in_its_shares_of_the_period():
    A, f, share = 0.4, 1.25, 0.3
    stroke = Stroke(*(number(x) for x in (A, f, 0.0, 0.1, share)))
    ends = [stroke(number(t)) for t in (-0.5 * share / f, 0.0, 0.5 * share / f, (0.5 * share + 0.5 * (1 - share)) / f)]
    np.testing.assert_allclose([e[0] for e in ends], [0.1 - A, 0.1, 0.1 + A, 0.1], atol=1e-13)
    speeds = [0, np.pi * f / share * A, 0, -np.pi * f / (1 - share) * A]  # a half cosine is fastest in its middle
    np.testing.assert_allclose([e[1] for e in ends], speeds, atol=1e-12)


@pytest.mark.parametrize(("name", "middle"), [("rate", 0.2), ("sine", -0.1), ("stroke", -0.1), ("cycle", 0.28)])
def test_a_ramp_starts_at_rest_in_the_middle_and_ends_at_full_size(name, middle):
    """A rate has then come half as far as without the ramp."""
    whole, ramped = SMOOTH[name], RAMPED[name]
    np.testing.assert_allclose(ramped(number(0.0)), [middle, 0, 0], atol=1e-15)
    for t in (0.8, 1.7):
        lag = number(0.4 if name == "rate" else 0.0)
        np.testing.assert_allclose(ramped(number(t)), whole(number(t) - lag), rtol=1e-12, atol=1e-12)


def test_the_sine_is_that_of_its_formula():
    assert float(SMOOTH["sine"](number(0.2))[0]) == pytest.approx(-0.1 + 0.4 * np.sin(2 * np.pi * 1.5 * 0.2 + 0.3))
    assert float(SMOOTH["rate"](number(0.2))[0]) == pytest.approx(0.2 - 0.6)


def test_a_triangle_is_the_arc_sine_of_a_sine():
    t = np.linspace(-1.0, 2.0, 301) + 1e-3
    found = sampled_by(SMOOTH["triangle"], t)
    wanted = 0.4 * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * 1.5 * t + 0.3)) - 0.1
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_a_step_comes_at_its_time_or_was_always_there():
    t = np.array([-1.0, 0.4999, 0.5, 2.0])
    np.testing.assert_array_equal(sampled_by(Jump(number(3.0), number(0.5)), t), [0, 0, 3, 3])
    np.testing.assert_array_equal(sampled_by(Jump(number(3.0)), t), [3, 3, 3, 3])


def test_a_chirp_goes_from_its_first_to_its_last_frequency_and_keeps_them_outside():
    """Turns are the integral of 0.5 Hz (2/0.5)^(t/T) within."""
    t = np.linspace(-1, 5, 6001)
    turns = np.where(t < 0, 0.5 * t, 0.5 * np.expm1(np.log(4) * np.clip(t, 0, 4) / 4) * 4 / np.log(4))
    turns = turns + 2.0 * np.maximum(t - 4, 0)
    found = sampled_by(Chirp(*map(number, (1.0, 0.5, 0.0, 0.0, 2.0, 4.0))), t)
    np.testing.assert_allclose(found, np.sin(2 * np.pi * turns), atol=1e-9)


def test_a_varying_signal_has_one_period_of_each_sine():
    """1.5 Hz until 2/3 s, 2 Hz from there on, also after its end."""
    t = np.linspace(-0.5, 2.0, 400)
    first, second = 0.4 * np.sin(2 * np.pi * 1.5 * t), 0.2 * np.sin(2 * np.pi * 2 * (t - 2 / 3))
    np.testing.assert_allclose(sampled_by(SMOOTH["varying"], t), np.where(t < 2 / 3, first, second) - 0.1, atol=1e-12)


def test_a_multisine_has_its_lines_alone_all_of_one_size_and_its_peak():
    """32 lines from 0.25 to 8 Hz over one period of 4 s: the spectrum has these and no others."""
    t = np.arange(4000) / 1000
    described = MultisineSignal[Number](kind="multisine", amplitude=0.2, frequency=0.25, to=8.0)
    found = sampled(described, t)
    sizes = np.abs(np.fft.rfft(found)) / 2000
    assert sizes[1:33] == pytest.approx(sizes[1], rel=1e-9)
    assert np.abs(sizes[[0, *range(33, len(sizes))]]).max() < 1e-12
    assert np.abs(found).max() == pytest.approx(0.2, rel=2e-3)
    np.testing.assert_allclose(sampled(described, t + 4), found, atol=1e-9)


def test_its_crest_factor_is_low_and_its_phases_are_those_of_its_seed():
    """All phases alike give sqrt(2 n) = 8; random ones about 3; the best of 200 draws are below 2.3."""
    phases = crest_phases(32, 1)
    t = np.arange(2048) / 2048
    found = sum(np.cos(2 * np.pi * k * t + phase) for k, phase in enumerate(phases, start=1))
    assert np.abs(found).max() / np.sqrt(np.mean(found**2)) < 2.3
    np.testing.assert_array_equal(phases, crest_phases(32, 1))
    assert not np.array_equal(phases, crest_phases(32, 2))


def sampled_by(signal, t):
    return jax.jit(jax.vmap(lambda at: signal(at)[0]))(jnp.asarray(t))


@pytest.mark.parametrize("name", RAMPED)
def test_a_ramp_of_no_time_is_none(name):
    """Also at t = 0, where a share of it would be 0/0: a number that a fit or a design may vary."""
    none = replace(RAMPED[name], ramp=number(0.0))
    for t in (0.0, 0.3):
        np.testing.assert_allclose(none(number(t)), SMOOTH[name](number(t)), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("t", [-1.0, 0.2, 0.55, 0.6, 1.9, 2.0, 3.0])
def test_a_recording_is_joined_by_lines_and_held_outside(t):
    u, du, ddu = RECORDING(number(t))
    assert float(u) == pytest.approx(np.interp(t, RECORDING.times, RECORDING.values), abs=1e-15)
    h = 1e-6
    right = (RECORDING(number(t + h))[0] - u) / h
    assert float(du) == pytest.approx(float(right), abs=1e-8)
    assert float(ddu) == 0


def test_steps_are_held_until_the_next():
    steps = Steps(jnp.array([0.0, 1.0, 2.0]), jnp.array([3.0, 5.0, 4.0]))
    for t, wanted in [(-1.0, 3.0), (0.0, 3.0), (0.999, 3.0), (1.0, 5.0), (1.5, 5.0), (2.0, 4.0), (9.0, 4.0)]:
        u, du, ddu = steps(number(t))
        assert (float(u), float(du), float(ddu)) == (wanted, 0, 0)


def test_water_tells_the_acceleration_of_its_flow():
    """c = (s t z, 0, w): Dc/Dt = (s z + w s t, 0, 0)."""
    s, w, t = 0.3, 0.2, 1.7
    current = lambda t, x: jnp.stack([s * t * x[2], 0 * t, w + 0 * t])  # noqa: E731
    points = jnp.array([[0.0, 0.0, 0.5], [1.0, 2.0, -2.0]])
    flow = jax.jit(lambda t, x: Water(number(1000.0), number(9.81), None, current).flow(t, x))
    c, dc = flow(number(t), points)
    np.testing.assert_allclose(c, [[s * t * 0.5, 0, w], [-s * t * 2, 0, w]], atol=1e-15)
    np.testing.assert_allclose(dc, [[s * 0.5 + w * s * t, 0, 0], [-s * 2 + w * s * t, 0, 0]], atol=1e-15)


def test_still_water_and_a_uniform_current():
    x = jnp.zeros((2, 3))
    still, uniform = (Water(number(1000.0), number(9.81), None, c) for c in (None, UniformCurrent(jnp.arange(3.0))))
    np.testing.assert_array_equal(still.flow(number(0.0), x), np.zeros((2, 2, 3)))
    c, dc = uniform.flow(number(0.0), x)
    np.testing.assert_array_equal(c, [[0, 1, 2]] * 2)
    np.testing.assert_array_equal(dc, np.zeros((2, 3)))


def test_a_solution_passes_through_jit_and_vmap_and_every_status_has_words():
    solve = jax.jit(jax.vmap(lambda x: Solution(x**2, jnp.where(x > 1, 1, 0), {"steps": x}, jnp.abs(x))))
    solution = solve(jnp.array([0.5, 2.0]))
    np.testing.assert_array_equal(solution.value, [0.25, 4])
    assert [Status(int(s)).reason for s in solution.status] == ["solved", "stopped at the event"]
    assert len({s.reason for s in Status}) == len(Status)
