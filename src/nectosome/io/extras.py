"""Packages that come with an extra of this one."""

from importlib import import_module
from typing import Any

from nectosome.units import InputError


def package(name: str, extra: str) -> Any:
    """A module of a package that `extra` brings. Raises InputError where it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        missing = name.split(".")[0]
        raise InputError(f"the package {missing} is missing: pip install 'nectosome[{extra}]'.") from error
