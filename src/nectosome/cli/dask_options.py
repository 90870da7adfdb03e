"""`--cluster`: the workers of a Dask scheduler compute, and what becomes of a command whose cluster is lost."""

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path
from typing import Annotated, TypeVar

from cyclopts import Parameter

from nectosome.cli.output import tell
from nectosome.io.file_system import entries

_T = TypeVar("_T")

Part = Annotated[
    str | None,
    Parameter("--part", help="Compute this share only, such as 2/8, the second of eight; nectosome gather joins them."),
]

Cluster = Annotated[
    str | None,
    Parameter("--cluster", help="Dask scheduler whose workers compute: tcp://HOST:PORT, or its scheduler file."),
]


def on_cluster(address: str | None, compute: Callable[[Executor | None], _T], kept: Path | None) -> _T | None:
    """Return compute(executor), with the executor of a cluster or None without one; None where the cluster is lost.

    - kept: where what is computed already lies, which the message names.
    """
    if address is None:
        return compute(None)
    from nectosome.search.executors.cluster import cluster
    from nectosome.search.executors.spread import LostError

    try:
        with cluster(address) as executor:
            return compute(executor)
    except LostError as error:
        tell(f"{error}{goes_on(kept)}")
        return None


def goes_on(kept: Path | None) -> str:
    """Say where a run that ended early goes on, if anything is kept."""
    return "" if kept is None or not entries(kept) else f" The same command goes on from what is in {kept}."
