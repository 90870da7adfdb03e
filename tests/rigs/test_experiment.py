"""An experiment samples evenly, does on a rig what a simulated loop does, and says what it did."""

import json
import time

import numpy as np
import pytest

from nectosome.controllers.block_loop import BlockLoop
from nectosome.io import load_dataset
from nectosome.rigs import Experiment, SimulatedRig
from nectosome.units import InputError

from .faulty import (
    DT,
    LIMITS,
    PI,
    RIGS,
    SLEW,
    Faulty,
    PIRegulator,
    changed,
    pi,
    plant,
    sensor,
    simulated,
    sine,
    tracked,
)

SETUP = RIGS["simulated"]
PATIENT = changed(LIMITS, overruns_in_row=1000, overruns_share=1.0)  # others use this machine too


def test_a_run_on_a_simulated_rig_is_the_simulated_loop(tmp_path):
    """To rounding: the controller steps once a sample, the plant between them."""
    rig = SimulatedRig(plant(), sensor(0.0), dt=2e-3)
    run = SETUP.experiment(rig).run(tmp_path / "run.nc")
    track = BlockLoop(plant(), sensor(0.0), DT, 5).run(SETUP.controller, SETUP.reference)
    assert run.status == "finished"
    for name, of in {"reference": "displacement.reference", "measured": "displacement"}.items():
        assert np.allclose(run.data[of], getattr(track, name), rtol=0, atol=1e-12)
    assert np.allclose(run.data["pressure.command"], track.command, rtol=1e-9, atol=1e-5)
    assert np.allclose(rig.outputs, track.output, rtol=0, atol=1e-12)
    assert run.data.attrs["clamped"] == run.data.attrs["slowed"] == 0


def test_the_log_says_all_that_is_needed_to_judge_it(tmp_path):
    run = SETUP.experiment().run(tmp_path / "run.nc")
    logged = load_dataset(run.path)
    assert run.path == tmp_path / "run.nc"
    assert np.allclose(logged["time"], np.arange(SETUP.reference.size) * DT, rtol=0, atol=1e-12)
    assert logged["displacement"].attrs["units"] == logged["displacement.reference"].attrs["units"] == "m"
    assert logged["pressure.command"].attrs["units"] == "Pa"
    attributes = logged.attrs
    assert attributes["title"] == "sine on simulated rig"
    assert (attributes["status"], attributes["status_reason"]) == (run.status, run.reason)
    assert "2800000" in attributes["controller"]
    assert json.loads(attributes["provenance"])["settings"]["limits"]["commands"]["pressure"]["slew"] == SLEW
    assert attributes["dt"] == DT
    assert attributes["overruns"] == 0


def test_commands_that_were_cut_down_are_counted(tmp_path):
    """By gains that are far too high: it swings between the ends of the range, at the largest rate."""
    limits = changed(LIMITS, error_time=5.0, saturated_time=5.0)
    experiment = SETUP.experiment(controller=pi(2.8e6, 1e10), reference=np.full(80, 0.01), limits=limits)
    run = experiment.run(tmp_path / "run.nc")
    command = run.data["pressure.command"].to_numpy()
    assert run.data.attrs["clamped"] >= 1
    assert run.data.attrs["slowed"] >= 10
    assert np.abs(np.diff(command, prepend=0.0)).max() <= SLEW * DT * (1 + 1e-9)
    assert np.abs(command).max() <= LIMITS.commands["pressure"].high


class TracedRegulator(PIRegulator):
    def step(self, state, measured):
        Traced.count += 1
        return super().step(state, measured)


class Traced(PI):
    count = 0

    def planned(self, reference, dt):
        known = super().planned(reference, dt)
        return TracedRegulator(known.reference, known.proportional, known.integral)


def test_everything_is_compiled_before_the_rig_is_opened_and_once(tmp_path):
    counts = []
    for name in ("a", "b"):
        rig = Faulty(simulated(), {"open": lambda n, call: (counts.append(Traced.count), call())})
        known = pi()
        SETUP.experiment(rig, controller=Traced(known.proportional, known.integral)).run(tmp_path / f"{name}.nc")
        counts.append(Traced.count)
    assert counts[0] > 0
    assert len(set(counts)) == 1


class Unplanned(PI):
    def planned(self, reference, dt):
        raise InputError("no inverse.")


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"reference": np.full(5, 0.0151)}, "0.0151"),
        ({"reference": np.array([0.0, np.nan])}, "nan"),
        ({"reference": np.zeros(0)}, "samples"),
        ({"dt": 0.0}, "0 s"),
        ({"dt": np.nan}, "nan s"),
        ({"controller": Unplanned(*map(np.asarray, (1.0, 1.0)))}, "no inverse"),
    ],
)
def test_what_makes_no_sense_is_refused_before_the_rig_is_touched(tmp_path, other, words):
    rig = Faulty(simulated())
    with pytest.raises(InputError, match=words):
        SETUP.experiment(rig, **other).run(tmp_path / "run.nc")
    assert rig.seen == []
    assert not list(tmp_path.iterdir())


def test_a_log_that_is_there_is_kept_and_the_rig_not_touched(tmp_path):
    SETUP.experiment().run(tmp_path / "run.nc")
    before = (tmp_path / "run.nc").read_bytes()
    rig = Faulty(simulated())
    with pytest.raises(InputError, match="is there already"):
        SETUP.experiment(rig).run(tmp_path / "run.nc")
    assert (tmp_path / "run.nc").read_bytes() == before
    assert rig.seen == []


def test_progress_is_told_as_shares(tmp_path):
    shares = []
    SETUP.experiment().run(tmp_path / "run.nc", lambda share: shares.append(share))
    assert shares == sorted(shares)
    assert shares[0] < 0.02
    assert shares[-1] > 0.98


def test_at_200_hz_samples_are_even_and_late_ones_are_counted(tmp_path):
    """1.5 s of real time: ticks are multiples of 5 ms from the start, however late the samples between."""
    rig = Faulty(simulated(pace="real"))
    experiment = Experiment(*tracked(rig, pi(), sine(300, 5e-3), 5e-3), PATIENT, 5e-3)
    before = time.perf_counter()
    run = experiment.run(tmp_path / "run.nc")
    assert time.perf_counter() - before >= 1.5
    assert run.status == "finished"
    time_, late = run.data["time"].to_numpy(), run.data["late"].to_numpy()
    assert np.allclose(time_ - late, np.arange(300) * 5e-3, rtol=0, atol=1e-9)
    assert (late >= 0).all()
    assert run.data.attrs["overruns"] == (late > 2.5e-3).sum()
    assert run.data.attrs["latest"] == late.max()
    assert np.median(late) < 5e-3
    print(f"late: median {1e3 * np.median(late):.2f} ms, largest {1e3 * late.max():.1f} ms, {(late > 2.5e-3).sum()}")
