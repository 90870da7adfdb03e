"""Sweeps and designs of robots whose limbs all do the same: one limb and its share of the body against all of them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.solve.test_equal_limbs import PADDLES

from nectosome import sweep
from nectosome.description import parse_robot, with_values
from nectosome.designs import plans
from nectosome.designs.plans import alike_limbs
from nectosome.designs.problem import Problem
from nectosome.solve import periodic
from nectosome.solve.equal_limbs import EQUAL_LIMBS
from nectosome.units import InputError

TEXT = f"""{PADDLES}
aliases:
  K: [{", ".join(f"limbs.flap{k}.joint.stiffness" for k in (1, 2, 3))}]
"""
FLAPS = parse_robot(TEXT)
TIGHT = 1e-9
STIFFNESS = 0.055  # N m/rad


@pytest.fixture(scope="module")
def whole():
    """Speed and power of all flaps. Steps of the part bring the same errors in other places."""
    robot = with_values(FLAPS, {"K": STIFFNESS})
    means = periodic(robot, samples=plans.SAMPLES, rtol=TIGHT, atol=1e-2 * TIGHT, whole=True).means()
    return float(means.speed), float(np.sum(means.power))


@pytest.mark.slow
def test_a_sweep_solves_one_of_them(whole):
    found = sweep(FLAPS, {"K": [STIFFNESS, 0.06]}, rtol=TIGHT, samples=plans.SAMPLES)
    assert found.attrs[EQUAL_LIMBS] == 3
    assert (found["status"] == "SOLVED").all()
    assert float(found["speed"][0]) == pytest.approx(whole[0], rel=100 * TIGHT)
    assert float(found["power"][0].sum()) == pytest.approx(whole[1], rel=100 * TIGHT)


@pytest.mark.slow
def test_a_design_solves_one_of_them(whole, monkeypatch):
    monkeypatch.setattr(plans, "_RTOL", TIGHT)
    task = Problem().changed(FLAPS, vary={"K": "0.04..0.07 N m/rad"}, maximise="speed", forward="x").task(FLAPS)
    evaluate, u = task.prepare(), np.array([0.5])  # the stiffness above
    found = evaluate(u, True, None)
    assert -found.objective == pytest.approx(whole[0], rel=100 * TIGHT)
    after, before = (evaluate(u + step, True, found.memory).objective for step in (1e-3, -1e-3))
    assert found.gradient == pytest.approx([(after - before) / 2e-3], rel=1e-5)


def test_a_design_that_sets_one_limb_apart_solves_all():
    names, ends = ["limbs.flap2.joint.stiffness"], [{"limbs.flap2.joint.stiffness": x} for x in (0.04, 0.07)]
    assert alike_limbs(FLAPS, names, ends, carried=False) is None


def test_a_design_in_numbers_of_the_body_solves_one_of_them():
    names, ends = ["body.length", "K"], [{"body.length": 0.09}, {"body.length": 0.11}, {"K": 0.04}, {"K": 0.07}]
    limbs = alike_limbs(FLAPS, names, ends, carried=False)
    assert limbs is not None
    assert [len(group) for group in limbs.where] == [1, 1]
    assert limbs.one.count == 3


def test_every_limb_is_solved_on_request():
    task = Problem().changed(FLAPS, vary={"K": "0.04..0.07 N m/rad"}, whole=True).motion(FLAPS)
    assert task.equal_limbs() == 1
    assert replace(task, whole=False).equal_limbs() == 3
    assert replace(task, whole=False).key() != task.key()


def test_a_mission_solves_every_limb_anyway():
    with pytest.raises(InputError, match="a mission solves every limb"):
        Problem(mission="one: {}", whole=True).task(FLAPS)
