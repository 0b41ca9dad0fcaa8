"""`python -m benchmarks`: measure all, or what is named; `python -m benchmarks NAME --help`.

Names alone bring their figures in RESULTS.md and RESULTS.json up to date. With options of its own,
such as `foreign --seeds 3`, one is a run whose figures are printed; so are `selftest` and `size`
unless `--results` follows. Exit code 1 where a target is missed.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path
from time import perf_counter
from types import ModuleType

from benchmarks.figures import Figure, report, write_results
from twin.errors import InputError

# Each is loaded when it runs: some need packages that the others do without.
MEASURED = (
    "simulation", "starts", "peer_fits", "diagnosis", "passes", "kinds", "stages",
    "mcap_logs", "effect_cost", "emps", "joints", "arms", "recordings", "withheld", "tx40",
    "foreign", "drives", "roles", "presliding", "silence", "thesis", "selftest", "export", "frf",
    "rule", "fuzz", "door", "sound", "fleet", "mutation", "size", "held",
)  # fmt: skip
# What takes options, or half an hour, by its name alone, and the module.
RUNS = {
    "selftest": "selftest", "confidence": "selftest.confidence", "intervals": "selftest.intervals",
    "size": "size",
}  # fmt: skip
RESULTS = "--results"


def main(given: Sequence[str]) -> int:
    """Measure, print and write; 0 where every target is met, 2 where what was given is wrong."""
    places = {name: name for name in MEASURED} | {"mutation": "mutation.noticed"} | RUNS
    first, *options = given or [""]
    is_run = RESULTS not in given and (first in RUNS or any(o.startswith("-") for o in options))
    names = [first] if is_run else [name for name in given if name != RESULTS] or MEASURED
    if unknown := [name for name in names if name not in places]:
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(places)}", file=sys.stderr)
        return 2
    modules = (import_module(f"benchmarks.{places[name]}") for name in names)
    try:
        if is_run:
            return _run(next(modules), options)
        return measured(modules)
    except InputError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return 2


def _run(benchmark: ModuleType, options: Sequence[str]) -> int:
    if not hasattr(benchmark, "main"):
        raise InputError(f"{benchmark.__name__} has no options; give its name alone")
    return int(benchmark.main(options))


def measured(benchmarks: Iterable[ModuleType]) -> int:
    """Bring the figures of some benchmarks up to date; 0 where every target is met."""
    results: dict[str, list[Figure]] = {}
    for benchmark in benchmarks:
        print(benchmark.TITLE, file=sys.stderr, flush=True)
        begun = perf_counter()
        results[benchmark.TITLE] = benchmark.measure()
        print(f"  {perf_counter() - begun:.0f} s", file=sys.stderr, flush=True)
    write_results(results, Path(__file__).parent)
    return report([f for figures in results.values() for f in figures])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
