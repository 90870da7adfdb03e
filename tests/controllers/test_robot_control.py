"""A PID on a robot in one call: what it takes, what it gives back, and where it is cancelled."""

import numpy as np
import pytest
from tests.small_robots import SLIDE

from nectosome.controllers import control
from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.units import InputError

ROBOT = parse_robot(SLIDE)
COMMON = {"command": "push=-2..2N", "measure": "body.position"}


def test_gains_are_found_detuned_and_tracked_in_one_call():
    result = control(ROBOT, **COMMON, reference="10cm", time="8s")
    assert result.status == Status.SOLVED
    assert result.gains is not None and result.gains.experiment is not None
    assert result.record.output[-1] == pytest.approx(0.1, abs=2e-3)
    assert result.missed() == ""
    data = result.to_dataset()
    assert data.sizes["sample"] == 161 and data.attrs["measured"] == "body.position"
    assert '"command": "push=-2..2N"' in data.attrs["provenance"]


def test_text_and_numbers_a_description_and_a_built_robot_are_the_same():
    given = {"gains": "20,30,10", "rate": "10Hz", "delay": "100ms", "reference": "0.1m", "time": "2s"}
    si = {"gains": (20, 30, 10), "rate": 10.0, "delay": 0.1, "reference": 0.1, "time": 2.0}
    runs = [
        control(ROBOT, **COMMON, **given).record,
        control(build(ROBOT), **COMMON, **si).record,
        control(ROBOT, **COMMON, **(si | {"reference": np.full(21, 0.1), "time": None})).record,
    ]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.output, runs[0].output)
    heavy = control(ROBOT, settings="m=4kg", **COMMON, **given).record
    assert np.abs(heavy.output - runs[0].output).max() > 1e-3


def test_a_run_that_is_cancelled_while_gains_are_found_has_no_samples():
    result = control(ROBOT, **COMMON, reference="10cm", progress=lambda what, share: False)
    assert result.gains is None and result.status == Status.CANCELLED
    assert result.record.time.size == 0 and result.missed() == ""
    with pytest.raises(InputError, match="nothing to save"):
        result.to_dataset()


@pytest.mark.parametrize(("changed", "field"), [
    ({"reference": "10deg"}, "reference"),
    ({"reference": "sine"}, "amplitude"),
    ({"gains": "1,-2,0"}, "gains"),
    ({"rate": "5s"}, "rate"),
    ({"rate": 1e6}, "rate"),
    ({"time": -1.0}, "time"),
    ({"noise": "-1mm"}, "noise"),
    ({"delay": "1mm"}, "delay"),
    ({"measure": "depht"}, "measure"),
    ({"command": "pull=-1..1N"}, "command"),
    ({"mean": True}, "mean"),
])  # fmt: skip
def test_an_error_names_the_argument(changed, field):
    with pytest.raises(InputError) as told:
        control(ROBOT, **({**COMMON, "reference": "10cm"} | changed))
    assert told.value.field == field
