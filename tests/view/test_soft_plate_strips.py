"""Soft plates in pictures: strips that tile the plate, and follow it as it bends."""

import numpy as np

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.view.tubes import parts_of

FIN = """
name: fin
limbs:
  fin: {on: world, kind: soft_plate, length: 0.1 m, width: 60 mm, thickness: 1 mm, young: 0.2 MPa, density: 1200 kg/m3,
    modes: [2, 2], points: [4, 3]}
"""


def test_strips_tile_a_plate_and_bend_with_it():
    """At first flat and side by side; then they sink under their weight, which hangs at the root, and still meet."""
    run = simulate(build(parse_robot(FIN)), 0.05, samples=3).to_dataset()
    strips = parts_of(run, parse_robot(FIN))
    assert [*strips] == ["fin.1", "fin.2", "fin.3"]
    sides = [strip.half[..., :1] * strip.rotation[..., 1] for strip in strips.values()]
    low = np.stack([strip.position - side for strip, side in zip(strips.values(), sides, strict=True)])
    high = np.stack([strip.position + side for strip, side in zip(strips.values(), sides, strict=True)])
    np.testing.assert_allclose(high[:-1, :, 1:-1], low[1:, :, 1:-1], atol=1e-12)
    np.testing.assert_allclose([low[0, 0, :, 1], high[-1, 0, :, 1]], [[-0.03] * 6, [0.03] * 6], atol=1e-12)
    for strip in strips.values():
        np.testing.assert_allclose(strip.position[0, [0, -1], 0], [0.0, 0.1], atol=1e-12)
        np.testing.assert_allclose(strip.position[:, 0], strip.position[:1, 0].repeat(3, axis=0), atol=1e-3)
        assert strip.position[-1, -1, 2] < -1e-3
