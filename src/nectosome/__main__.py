"""`python -m nectosome`, the same as the command `nectosome`."""

from nectosome.cli import run

run()
