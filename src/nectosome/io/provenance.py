"""Provenance of results: versions, machine, time and settings."""

from collections.abc import Mapping
from functools import cache
from typing import Any

PACKAGES = ("jax", "jaxlib", "equinox", "numpy", "pydantic", "xarray", "h5netcdf")


def provenance(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data to reproduce a result, as JSON data: `settings`, versions, platform, processors, UTC time."""
    import os
    import platform
    from datetime import UTC, datetime

    return {
        "nectosome": _version("nectosome"),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "processors": os.cpu_count(),
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "settings": dict(settings),
    }


@cache  # each call reads a file
def _version(package: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
