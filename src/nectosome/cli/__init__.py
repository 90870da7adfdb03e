"""The command line: thin, it parses, calls and prints."""

from nectosome.cli.app import main, run

__all__ = ["main", "run"]
