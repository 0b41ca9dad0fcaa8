"""Run the benchmarks named, or all; bring RESULTS.md and RESULTS.json up to date.

Exit code 1 where a target is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from benchmarks import (
    diagnosis,
    effect_cost,
    emps,
    fuzz,
    import_time,
    kinds,
    mcap_logs,
    passes,
    peer_fits,
    second_start,
    selftest,
    simulation,
    stages,
    thesis,
)
from benchmarks.figures import Figure, write_results
from benchmarks.mutation import noticed

ALL = (
    simulation, second_start, peer_fits, diagnosis, passes, kinds, stages, mcap_logs, effect_cost,
    import_time, emps, thesis, selftest, fuzz, noticed,
)  # fmt: skip


def main(names: Sequence[str]) -> int:
    """Measure, print and write; 0 where every target is met."""
    results: dict[str, list[Figure]] = {}
    known = {b.__name__.rpartition(".")[2]: b for b in ALL}
    if unknown := set(names) - known.keys():
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    for benchmark in [known[n] for n in names or known]:
        print(benchmark.TITLE, file=sys.stderr, flush=True)
        begun = perf_counter()
        results[benchmark.TITLE] = benchmark.measure()
        print(f"  {perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    write_results(results, Path(__file__).parent)
    for figure in (f for figures in results.values() for f in figures):
        if figure.verdict:
            value = "" if figure.value is None else f"{figure.value:.3g}"
            print(f"{figure.verdict:7} {value:>8}  {figure.what}")
    return int(any(f.passed is False for figures in results.values() for f in figures))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
