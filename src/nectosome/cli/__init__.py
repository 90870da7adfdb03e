"""The command line: thin, it parses, calls and prints."""

from nectosome.cli.app import main

__all__ = ["main"]
