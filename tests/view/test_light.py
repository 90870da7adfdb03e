"""The room of pages: each is loaded when it is asked for."""

import subprocess
import sys

import pytest

import nectosome.view


def test_the_page_of_a_recording_needs_no_jax():
    """Files of gigabytes are shown in half a gigabyte of memory, most of which JAX and its friends would take."""
    code = "import sys; from nectosome.view import show_recordings; print('jax' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_every_page_is_there():
    """Also once all are loaded: none may be called like the file it is in, which would then stand in its place."""
    for name in nectosome.view._HOME:
        _ = getattr(nectosome.view, name)
    assert all(callable(getattr(nectosome.view, name)) for name in nectosome.view._HOME)
    with pytest.raises(AttributeError, match=r"nectosome.view has no show$"):
        _ = nectosome.view.show
