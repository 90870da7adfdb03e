"""What an evolutionary search found: all its candidates with their values, and how it ended."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from nectosome.search.covariance import undominated

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Evolved:
    """Candidates in the order of their evaluation; `best`, `history` and `close` go by the first objective."""

    names: tuple[str, ...]  # of the parameters
    rows: Float[np.ndarray, "m n"]
    values: Float[np.ndarray, "m k"]  # of the objectives; inf where a candidate has none
    generation: Int[np.ndarray, "m"]  # from 0
    message: str  # how it ended
    cancelled: bool = False
    note: str = ""  # on its record

    @property
    def best(self) -> Float[np.ndarray, "n"] | None:
        """Parameters with the lowest value, None where no candidate has one."""
        return self.rows[np.argmin(self.values[:, 0])] if np.isfinite(self.value) else None

    @property
    def value(self) -> float:
        """The lowest value; inf where no candidate has one."""
        return float(self.values[:, 0].min(initial=np.inf))

    @property
    def history(self) -> Float[np.ndarray, "m"]:
        """The lowest value of all candidates so far."""
        return np.minimum.accumulate(self.values[:, 0])

    @property
    def front(self) -> Int[np.ndarray, "f"]:
        """Which candidates no other one beats in all objectives, by rising value of the first; one of equal ones."""
        found = np.flatnonzero(np.isfinite(self.values[:, 0]))
        return found[undominated(self.values[found])]

    def close(self, to: float) -> Float[np.ndarray, "c n"]:
        """Parameters of all candidates whose value is at most `to`, best first: what is as good as the best."""
        order = np.argsort(self.values[:, 0], kind="stable")
        return self.rows[order[self.values[order, 0] <= to]]

    def to_dataset(self) -> "xr.Dataset":
        """All candidates: `row`, `value`, `generation` over `evaluation`, with `parameter` and `objective`."""
        import xarray as xr

        return xr.Dataset(
            {
                "row": (("evaluation", "parameter"), self.rows),
                "value": (("evaluation", "objective"), self.values),
                "generation": ("evaluation", self.generation),
            },
            {"parameter": np.array(self.names, dtype=str)},
            {"message": self.message},
        )
