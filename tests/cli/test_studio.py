"""`studio` from the command line: what is wrong is told before it opens; Ctrl-C ends it at once."""

import re
import signal
import subprocess
import sys

import pytest

from .answers import check_wrong

WRONG = [
    ("studio", "flagelum"),
    ("studio", "none.yaml"),
    ("studio", "--port", "0"),
    ("studio", "--port", "eighty"),
    ("studio", "--port", "-1"),
    ("studio", "--port", "70000"),
    ("studio", "--folder", "none"),
    ("studio", "--host", "203.0.113.7", "--no-browser"),
    ("studio", "--host", "no host", "--no-browser"),
    ("studio", "flagellum", "paddle"),
    ("studio", "--cluster", "carrier://pigeon", "--no-browser"),
    ("studio", "--cluster", "nothing.json", "--no-browser"),
]


def test_what_is_wrong_is_told_before_it_opens(nectosome, tmp_path):
    check_wrong(nectosome, WRONG, tmp_path)


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
def test_it_tells_its_address_and_ends_with_ctrl_c(tmp_path, host):
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # in the background it is deaf
        "from nectosome.cli import run; run()"
    )
    command = [sys.executable, "-c", code, "studio", "paddle", "--no-browser", "--host", host, "--port", "19000"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    line = process.stdout.readline()
    told = re.fullmatch(r"the studio is at http://([\w.-]+):(\d+)/(\?token=[\w-]{32,})? \(Ctrl-C ends it\)\n", line)
    assert told, line
    assert (told[1] == "127.0.0.1") == (host == "127.0.0.1")
    assert bool(told[3]) == (host == "0.0.0.0")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    *warned, said = err.splitlines()
    assert (process.returncode, out, said) == (0, "", "closed.")
    assert ["as_printed" in line for line in warned] == [True]  # the paddle's hinges
    assert not [*tmp_path.iterdir()]
