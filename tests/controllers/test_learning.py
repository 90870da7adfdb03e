"""Learning from run to run: how fast errors fall, and where they grow."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.controllers import (
    BlockLoopRecord,
    Feedforward,
    Learned,
    eased,
    hysteretic,
    learned,
    open_loop,
    pid_of,
    wave,
)
from nectosome.controllers.feedforward import convolved, smoothing
from nectosome.drives import Chain, TransferFunction, respond
from nectosome.units import InputError

from .simple_loops import DT, UNLIMITED, around, dynamics, late, linear, model, of, plays

REFERENCE = np.concatenate(
    [np.zeros(20), eased(wave("sine", 3.0, DT, amplitude=1.0, frequency=1.0), 1.0, DT), np.zeros(30)]
)
WIDTH = 0.06
STRONG = TransferFunction(*of([1.2 * 400.0], [1.0, 36.0, 400.0]))  # 20 % more than what is known
KNOWN = hysteretic(linear(), dynamics(), DT)
LINEAR, HYSTERETIC = (around(late(Chain((one, STRONG)), DT, 10)) for one in (linear(), plays()))


def pi(kp, ki):
    return pid_of([kp, ki, 0.0], 0.02, UNLIMITED)


def rounds(loop, pid, known, share, count):
    """Rms errors of one run after the other."""
    law, found = Feedforward(pid, known, WIDTH), []
    for _ in range(count):
        track = loop.run(law, REFERENCE)
        found.append(np.sqrt(np.mean((np.asarray(track.output) - REFERENCE) ** 2)))
        law = learned(pid, known, track, DT, WIDTH, share)
    return np.array(found)


def test_a_wrong_model_is_learned_away():
    """Hysteresis, 20 % too much gain: within 5 rounds to 2 % of the first error."""
    errors = rounds(HYSTERETIC, pi(0.1, 3.0), model(), 1.0, 5)
    assert np.all(np.diff(errors) < 0)
    assert errors[-1] < 0.02 * errors[0]


@pytest.mark.parametrize("share", [0.25, 0.5])
def test_without_feedback_errors_fall_by_what_is_believed(share):
    """To 1 - 1.2 share each time."""
    errors = rounds(LINEAR, pi(0.0, 0.0), KNOWN, share, 3)
    np.testing.assert_allclose(errors[1:] / errors[:-1], 1 - 1.2 * share, rtol=0.02)


@pytest.mark.parametrize(("ki", "share", "steady"), [(3.0, 0.3, True), (14.0, 0.3, False), (14.0, 0.75, True)])
def test_errors_grow_where_the_condition_says(ki, share, steady):
    """|Q S (1 - 1.2 share)| at all frequencies; a badly damped loop is driven up, unless most is believed."""
    pid = pi(0.1, ki)
    frequency, response = open_loop(LINEAR, pid, 1.0)
    kernel = smoothing(WIDTH, DT, 0)[0]
    k = np.arange(len(kernel)) - len(kernel) // 2
    Q = np.exp(-2j * np.pi * np.outer(frequency, k) * DT) @ kernel
    factor = np.abs(Q / (1 + response) * (1 - 1.2 * share)).max()
    errors = rounds(LINEAR, pid, KNOWN, share, 9)
    if steady:
        assert factor < 0.9
        assert errors[-1] < 0.2 * errors[0]
    else:
        assert factor > 1.5
        assert np.all(errors[-3:] > 1.3 * errors[-4:-1])


def test_a_run_without_errors_teaches_the_smoothed_command():
    """What was sent is sent again, feedback included; what is smoothed is what it drives the dynamics with.

    The first command is the held one that was sent: smoothing it would shift all others.
    """
    command = jnp.sin(0.05 * jnp.arange(200))
    y = jnp.asarray(REFERENCE[:200])
    found = learned(pi(1.0, 1.0), model(), BlockLoopRecord(y, y, y, command), DT, WIDTH)
    drives = [respond(plays(), u, DT) for u in (found.feedforward, command)]
    np.testing.assert_allclose(drives[0][1:], convolved(smoothing(WIDTH, DT, 0)[0], drives[1])[1:], atol=1e-12)
    assert float(found.feedforward[0]) == float(command[0])
    assert np.abs(found.feedforward - command).max() < 0.02


def test_what_was_learned_is_for_references_of_its_length():
    with pytest.raises(InputError, match="has 40 samples; the feedforward was learned for 50"):
        Learned(pi(1.0, 1.0), jnp.zeros(50)).planned(np.zeros(40), DT)
