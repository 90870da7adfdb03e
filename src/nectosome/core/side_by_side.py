"""How many robots one program computes side by side, by the device that it runs on."""

import jax

MOST = 1024


def side_by_side(on_cpu: int, count: int) -> int:
    """Return how many robots are computed together, of `count` in all.

    On a processor every robot of a batch takes as long as the slowest, and more than `on_cpu` of them gain nothing.
    Other devices take about as long for one as for many: they get all, up to 1024, rounded up to a power of two, so
    that batches of like sizes share a program.
    """
    if jax.default_backend() == "cpu":
        return on_cpu
    return min(1 << max(count - 1, 0).bit_length(), MOST)
