"""Run the benchmarks named, or all; bring RESULTS.md and RESULTS.json up to date.

Exit code 1 where a target is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from time import perf_counter

from benchmarks.figures import Figure, write_results
from benchmarks.judgement import told

# Each is loaded when it runs: some need packages that the others do without.
ALL = (
    "simulation", "second_start", "peer_fits", "diagnosis", "passes", "kinds", "stages",
    "mcap_logs", "effect_cost", "import_time", "emps", "withheld", "foreign", "thesis", "selftest",
    "rule", "fuzz",
    "mutation.noticed",
)  # fmt: skip


def main(given: Sequence[str]) -> int:
    """Measure, print and write; 0 where every target is met.

    A name that is followed by options, such as ``foreign --seeds 3``, is a run of its own: its
    figures are printed, not written.
    """
    results: dict[str, list[Figure]] = {}
    known = {name.rpartition(".")[2]: name for name in ALL}
    names, options = given[:1], given[1:]
    if not (options and options[0].startswith("-")):
        names, options = given, ()
    if unknown := set(names) - known.keys():
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(known)}", file=sys.stderr)
        return 2
    if options:
        return int(import_module(f"benchmarks.{known[names[0]]}").main(options))
    for name in names or known:
        benchmark = import_module(f"benchmarks.{known[name]}")
        print(benchmark.TITLE, file=sys.stderr, flush=True)
        begun = perf_counter()
        results[benchmark.TITLE] = benchmark.measure()
        print(f"  {perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    write_results(results, Path(__file__).parent)
    return told([f for figures in results.values() for f in figures])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
