"""Webs in pictures: each gap reaches from limb to limb, at every time."""

import numpy as np

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.view.tubes import parts_of

FAN = """
name: fan
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  one: {kind: rigid, shape: cylinder, length: 0.1 m, radius: 0.1 mm, mass: 1 g, offset: [0 m, 20 mm, 0 m], JOINT}
  two: {kind: rigid, shape: cylinder, length: 0.1 m, radius: 0.1 mm, mass: 1 g, offset: [0 m, -20 mm, 0 m]}
webs:
  skin: {between: [one, two], thickness: 1 mm, young: 1 Pa, density: 1 g/cm3}
""".replace("JOINT", "joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz}}")


def test_a_gap_is_drawn_from_limb_to_limb():
    """At the roots 40 mm wide, at the tips by the swing; its edges on the axes of the limbs, which are thin."""
    run = simulate(build(parse_robot(FAN)), 0.25, samples=6).to_dataset()
    (gap,) = (parts_of(run, parse_robot(FAN))[name] for name in ["skin.1"])
    swing = np.radians(20.0) * np.sin(2 * np.pi * run["time"].values)
    tips = np.stack([0.1 * np.cos(swing), 0.02 + 0.1 * np.sin(swing), 0 * swing], axis=-1)
    across = gap.half[..., :1] * gap.rotation[..., 1]
    edges = np.stack([gap.position - across, gap.position + across])
    to_one = np.linalg.norm(edges[:, :, -1] - tips, axis=-1).min(axis=0)
    to_two = np.linalg.norm(edges[:, :, -1] - [0.1, -0.02, 0.0], axis=-1).min(axis=0)
    assert np.all(to_one < 4e-3)  # sections are upright to the middle of the gap, its end is not
    assert np.all(to_two < 4e-3)
    np.testing.assert_allclose(2 * gap.half[:, 0, 0], 0.04 * np.cos(swing / 2), rtol=0.02)
