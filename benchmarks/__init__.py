"""Speed of the product, measured in one run on one machine: `python -m benchmarks`."""
