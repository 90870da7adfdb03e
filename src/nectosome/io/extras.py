"""Optional packages, installed by an extra."""

from importlib import import_module
from typing import Any

from nectosome.units import InputError


def package(name: str, extra: str) -> Any:
    """Import a module of an optional package. Raises InputError with the extra to install, if it is missing."""
    try:
        return import_module(name)
    except ImportError as error:
        missing = name.split(".")[0]
        raise InputError(f"the package {missing} is missing: pip install 'nectosome[{extra}]'.") from error
