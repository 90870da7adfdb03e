"""Optional packages, installed by an extra."""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from nectosome.units import InputError


def is_installed(name: str) -> bool:
    """Whether an optional package is there."""
    return find_spec(name) is not None


def package(name: str, extra: str) -> Any:
    """Import a module of an optional package.

    Raises InputError with the extra to install, if it is missing, or with the reason why it does not load.
    """
    missing, install = name.split(".")[0], f"pip install 'nectosome[{extra}]'"
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise InputError(f"the package {missing} is missing: {install}.") from error
    except (ImportError, OSError) as error:  # OSError: a library of the system that it loads
        why = " ".join(str(error).split()).rstrip(".")
        raise InputError(f"the package {missing} does not load ({why}). Install it again: {install}.") from error
