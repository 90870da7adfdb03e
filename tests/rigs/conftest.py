"""Signals as in a terminal, where tests run in the background a shell has them ignored; patience with servos."""

import signal

import pytest

_BEGUN = {"SIGINT": signal.default_int_handler, "SIGTERM": signal.SIG_DFL, "SIGHUP": signal.SIG_DFL}


@pytest.fixture(autouse=True)
def terminal():
    before = {getattr(signal, name): handler for name, handler in _BEGUN.items() if hasattr(signal, name)}
    before = {number: signal.signal(number, handler) for number, handler in before.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """The SDK waits 34 ms for an answer, which a busy machine may take to let the emulator's thread run."""
    monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 250)
