"""Slip where a wave runs along hinges and rods: against its known speed; none where nothing runs along the robot."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.solve.test_stroke import EEL

from nectosome.description import parse_robot
from nectosome.mechanism import Diagnosis, bending_of
from nectosome.model import bind, build
from nectosome.solve.stroke import wave_speed

F, LINK, V = 1.5, 0.08, 0.2  # Hz, m, m/s


def link(on: str, phase: float, amplitude: float, at: str = "tip", yaw: int = 0) -> str:
    return f"""
    on: {on}
    at: {at}
    rotation: [0 deg, 0 deg, {yaw} deg]
    kind: rigid
    shape: box
    length: {LINK} m
    width: 10 mm
    height: 40 mm
    mass: 0.05 kg
    joint:
      kind: revolute
      axis: z
      motion: {{kind: sine, amplitude: {float(amplitude)} rad, frequency: {F} Hz, phase: {float(phase)} rad}}"""


def snake(phases, amplitudes, more: str = "") -> str:
    """A head that looks along x, and links behind it on hinges."""
    names = ["body", *(f"link{i}" for i in range(len(phases)))]
    each = zip(names, names[1:], phases, amplitudes, strict=False)
    links = [
        f"\n  {name}:{link(on, phase, a, *(('root', 180) if on == 'body' else ()))}" for on, name, phase, a in each
    ]
    return f"""
name: snake
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: box
  length: 0.1 m
  width: 10 mm
  height: 40 mm
  mass: 0.1 kg
  joint: {{kind: planar, axis: z}}
limbs:{"".join(links)}{more}
"""


def slip_of(robot, period: float = 1 / F, n: int = 64):
    """V over the speed of the wave, NaN without one, of a robot whose motion is prescribed."""

    def at(t):
        q, *_ = robot.tree.complete(t, robot.start.q, robot.start.v)
        shape = robot.tree.shape(q)
        return shape.rotation, shape.position, bending_of(robot, q)

    rotation, position, bending = jax.vmap(at)(period * jnp.arange(n) / n)
    none = Diagnosis(*[jnp.zeros(0)] * len(Diagnosis._fields))
    once = none._replace(rotation=rotation, position=position, bending=bending)
    runs, speed = wave_speed(robot, jnp.asarray(period), once, rotation[0, 0] @ robot.ahead)
    return jnp.where(runs, V / speed, jnp.nan)


compiled = jax.jit(slip_of)


def slip(text: str, period: float = 1 / F) -> float:
    return float(compiled(build(parse_robot(text)), period))


GROWING = np.array([0.05, 0.1, 0.2, 0.3, 0.35])  # rad


@pytest.mark.parametrize("lag", [0.5, 1.3, -0.9])
def test_hinges_with_phase_lags_make_a_wave_of_their_distance_over_the_lag(lag):
    """V = 2 pi f l/lag, backwards where the phase is behind towards the tail, whatever the amplitudes of the hinges."""
    wanted = V / (2 * np.pi * F * LINK / lag)
    assert slip(snake(-lag * np.arange(5), GROWING)) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("phases", [[0.0] * 5, [0.0, np.pi, 0.0, np.pi, 0.0], [0.3, 0.3, 0.3 + np.pi, 0.3, 0.3]])
def test_a_standing_wave_has_no_slip(phases):
    assert np.isnan(slip(snake(phases, GROWING)))


def test_one_hinge_or_two_make_no_wave():
    for count in (1, 2):
        assert np.isnan(slip(snake(-1.3 * np.arange(count), GROWING[:count])))


def test_what_beats_across_the_body_does_not_count():
    """Arms of three hinges to both sides, larger ones, with a wave of their own."""
    names = {"left": 90, "right": -90}
    arms = ""
    for side, yaw in names.items():
        on = "body"
        for i in range(3):
            arms += f"\n  {side}{i}:{link(on, 2.0 * i, 0.4, *(('tip', yaw) if i == 0 else ()))}"
            on = f"{side}{i}"
    wanted = V / (2 * np.pi * F * LINK / 0.8)
    assert slip(snake(-0.8 * np.arange(5), GROWING, arms)) == pytest.approx(wanted, rel=1e-9)


ROD = EEL.partition("  kind: rod")[2].partition("  joint:")[0]


def rods(*waves: str) -> str:
    """A head with rods side by side behind it, each with its own strains."""
    limbs = [
        f"\n  rod{i}:\n    on: body\n    at: root\n    rotation: [0 deg, 0 deg, 180 deg]\n    kind: rod"
        + ROD.replace("\n  ", "\n    ")
        + f"    motion: {{bending_z: {wave}}}"
        for i, wave in enumerate(waves)
    ]
    return snake([], []) + "".join(limbs)


def wave(**fields: str) -> str:
    given = {"amplitude": "2 rad/m", "frequency": "2 Hz", "wavelength": "0.3 m"} | fields
    return f"{{kind: wave, {', '.join(f'{key}: {value}' for key, value in given.items())}}}"


def test_rods_with_one_wave_have_its_speed_together():
    """In opposite phase, and with different sizes."""
    text = rods(wave(), wave(phase="180 deg", amplitude="3 rad/m"))
    assert slip(text, period=0.5) == pytest.approx(V / (2 * 0.3), rel=1e-8)


def test_of_several_waves_the_largest_counts():
    """Waves of two frequencies in two rods: c_j is at that at which they bend most."""
    text = rods(wave(), wave(frequency="4 Hz", wavelength="0.2 m", amplitude="1 rad/m"))
    assert slip(text, period=0.5) == pytest.approx(V / (2 * 0.3), rel=1e-6)


def test_rods_that_stand_still_make_no_wave():
    assert np.isnan(slip(rods(wave(amplitude="0 rad/m")), period=0.5))


def test_derivatives_are_those_of_finite_differences():
    """In reverse, which JAX makes of the forward ones, by phase and amplitude of hinges, and by their length."""
    paths = ("limbs.link1.joint.motion.phase", "limbs.link2.length", "limbs.link3.joint.motion.amplitude")
    theta, build_at = bind(parse_robot(snake(-0.8 * np.arange(4), GROWING[:4])), paths)

    def told(theta):
        return slip_of(build_at(theta), n=16)

    both = jax.jit(jax.value_and_grad(told))
    h = 1e-5 * np.eye(3)
    differences = [(float(both(theta + x)[0]) - float(both(theta - x)[0])) / 2e-5 for x in h]
    np.testing.assert_allclose(both(theta)[1], differences, rtol=1e-5, atol=1e-8)
