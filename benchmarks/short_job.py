"""What a second process start must do without compiling: a short simulation and a fit.

Run by the benchmark as its own process; prints one JSON object.
"""

from __future__ import annotations

import json
from time import perf_counter

from numba.core import event

from identify import workflow
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model


def main() -> None:
    """Simulate two seconds in MuJoCo and fit them; count the passes of numba's compiler."""
    begun = perf_counter()
    with event.install_recorder("numba:run_pass") as recorder:
        model = load_model("proton_xy", load_catalogue())
        workflow.fit(model, {"log": simulate(model, "tracking", duration=2.0)})
    passes = sum(e.is_start for _, e in recorder.buffer)
    print(json.dumps({"compiler_passes": passes, "seconds": perf_counter() - begun}))


if __name__ == "__main__":
    main()
