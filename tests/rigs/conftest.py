"""Signals as in a terminal: where tests run in the background a shell, or nohup, has them ignored."""

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
