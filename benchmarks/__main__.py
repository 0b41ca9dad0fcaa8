"""Run every benchmark, write RESULTS.md and RESULTS.json; exit code 1 where a target is missed."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

from benchmarks import (
    diagnosis,
    effect_cost,
    import_time,
    mcap_logs,
    peer_fits,
    second_start,
    simulation,
)
from benchmarks.figures import Figure, write_results

ALL = (simulation, second_start, peer_fits, diagnosis, mcap_logs, effect_cost, import_time)


def main() -> int:
    """Measure, print and write; 0 where every target is met."""
    results: dict[str, list[Figure]] = {}
    for benchmark in ALL:
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
    sys.exit(main())
