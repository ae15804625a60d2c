"""Laboratory benchmarks: `python -m benchmarks --help`."""
