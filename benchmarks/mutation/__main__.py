"""`python -m benchmarks.mutation` is `python -m benchmarks mutation`."""

import sys

from benchmarks.mutation.noticed import main

sys.exit(main(sys.argv[1:]))
