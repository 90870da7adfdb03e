"""A soft fin on a servo is a chain of stiff links, of another program: its force on the mount, and its tip."""

import runpy
from pathlib import Path

import numpy as np
import pytest

from nectosome.cli.tutorial import tutorial_files, tutorial_pages
from nectosome.description import Samples, apply_settings, parse_robot, with_recordings
from nectosome.model import build
from nectosome.solve import reading, simulate

MAKE = Path(__file__).parents[2] / "examples" / "bench_day" / "make.py"
CLOSE = 0.01  # of the size of each, for 16 links: those of 8 are 0.9 % too soft, as a beam


@pytest.mark.slow
def test_force_and_tip_of_a_beating_fin_are_those_of_the_chain():
    """Added mass, drag, bending and viscosity together, at 25 deg and 1 Hz, between ramps."""
    chain = runpy.run_path(str(MAKE))
    true, amplitude = chain["TRUE"], np.radians(25.0)
    force, tip = chain["Chain"](true, amplitude, 1.0).run()
    time = np.linspace(0.0, 5.5, 551)
    text = tutorial_files("bench", tutorial_pages())["soft_fin.yaml"]
    values = zip(("E", "eta", "Cn", "Ca"), true, ("Pa", "Pa s", "", ""), strict=True)
    robot = apply_settings(parse_robot(text), [f"{name}={value} {unit}".strip() for name, value, unit in values])
    angle = Samples(time.tolist(), chain["servo"](time, amplitude, 1.0)[0].tolist(), "rad")
    run = simulate(build(with_recordings(robot, {"limbs.fin.joint.motion": angle})), 5.5, samples=time.tolist())
    beats = time > 2.5
    for name, exact in (("force.y", force), ("fin.tip.position.y", tip)):
        expected = exact(time[beats])
        assert np.std(np.asarray(reading(run, name))[beats] - expected) < CLOSE * np.std(expected)
