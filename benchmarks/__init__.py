"""Speed of the product, measured in one run on one machine: `python -m benchmarks`."""

import os

# As the command line sets it: work is shared out by candidates, not within a matrix product.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
