"""OpenCV and PyAV, which come with an extra of this package."""

from importlib import import_module
from typing import Any

from nectosome.io.errors import InputError


def package(name: str) -> Any:
    """The module `cv2` or `av`. Raises InputError where it is not installed."""
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(f"the package {name} is missing: pip install 'nectosome[video]'.", field="track") from error
