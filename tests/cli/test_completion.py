"""Tab completion: installed by one option, it completes commands, options, their choices, robots and files."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ASK = """
. "$1"; shift
COMP_WORDS=(nectosome "$@") COMP_CWORD=$#
_nectosome
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory) -> Path:
    """A home folder with the completion of every shell, and the program that they ask."""
    home = tmp_path_factory.mktemp("home")
    program = home / "bin" / "nectosome"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m nectosome "$@"\n')
    program.chmod(0o755)
    for shell in ("bash", "zsh", "fish"):
        argv = [program, "--install-completion", "--shell", shell]
        environment = {**os.environ, "HOME": str(home), "ZSH": "", "ZSH_CUSTOM": ""}
        done = subprocess.run(argv, capture_output=True, text=True, env=environment, check=False)
        assert (done.returncode, done.stderr) == (0, "")
    return home


def completed(home: Path, *words: str) -> set[str]:
    """What bash offers for the last word."""
    bash = shutil.which("bash")
    assert bash is not None
    script = home / ".local/share/bash-completion/completions/nectosome"
    environment = {**os.environ, "PATH": f"{home / 'bin'}:{os.environ['PATH']}"}
    argv = [bash, "-c", ASK, "ask", script, *words]
    done = subprocess.run(argv, capture_output=True, text=True, env=environment, check=True)
    return set(done.stdout.split())


def test_each_shell_gets_a_script_that_knows_the_commands_and_their_options(home):
    scripts = (
        ".local/share/bash-completion/completions/nectosome",
        ".zsh/completions/_cyclopts_nectosome",
        ".config/fish/completions/nectosome.fish",
    )
    for script in scripts:
        text = (home / script).read_text(encoding="utf-8")
        assert [word for word in ("periodic", "studio", "samples", "three-quarter") if word not in text] == []
    assert "nectosome" in (home / ".bashrc").read_text(encoding="utf-8")


def test_bash_completes_commands_options_and_choices(home):
    assert completed(home, "st") == {"static", "steady", "studio"}
    options = {"--set", "--save", "--samples", "--seed", "--spread", "--step"}
    assert completed(home, "simulate", "flagellum", "--s") == options
    assert completed(home, "render", "eel", "--camera", "t") == {"three-quarter", "top"}


def test_bash_completes_robots_and_their_files(home, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("flat.yaml", "flap.nc", "flip.txt", "mine/flea.yaml"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).touch()
    assert completed(home, "simulate", "fl") == {"flagellum", "flagella4", "flat.yaml", "flap.nc"}
    assert completed(home, "show", "mi") == {"mine/"}
    assert completed(home, "show", "mine/fl") == {"mine/flea.yaml"}
