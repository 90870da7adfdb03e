"""The genetic search of the paper for PoseiDRONE's parameters: generations of 100 walks of 25 s, two threads.

100 generations take minutes; `python -m benchmarks.crawl_search 5` makes five.
"""

import sys

from nectosome.search import Genetic, minimise
from nectosome_studies.poseidrone.crawl import fit

from .timing import timed

_POPULATION, _GENERATIONS = 100, 100


def main(generations: int) -> None:
    of = fit()
    print(f"\ngenetic search of {generations} generations of {_POPULATION} walks of {of.seconds:.0f} s, two threads")
    compiled, *_ = timed(lambda: of.summed(of.ranges.bounds.mean(axis=1)[None]))
    optimiser = Genetic(_POPULATION, evaluations=generations * _POPULATION)
    wall, spent, found = timed(lambda: minimise(of.task(), optimiser, seed=0))
    times = f"{wall:.0f} s, processor {spent:.0f} s, after {compiled:.1f} s of compilation"
    print(f"  {len(found.evaluations)} walks: {times}; discrepancy {found.value:.2g}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else _GENERATIONS)
