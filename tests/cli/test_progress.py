"""What is being done is told on stderr, with the time gone and the time left."""

import re
import time

from nectosome.cli import progress
from nectosome.cli.progress import progress_bar


def test_where_stderr_is_no_terminal_there_is_a_line_now_and_then(monkeypatch, capsys):
    monkeypatch.setattr(progress, "_LINE", 0.2)
    with progress_bar("sweep of eel") as update:
        update("12 points", 0.25)
        time.sleep(0.3)
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"sweep of eel: 12 points \(25 %, 0:00, about 0:\d\d left\)\n", said.err)
    monkeypatch.setattr(progress, "_LINE", 60.0)
    with progress_bar("sweep of eel"):
        time.sleep(0.1)
    assert capsys.readouterr().err == ""
