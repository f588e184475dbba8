"""Programs that measure; from the repository: `python -m benchmarks.synthesis`."""
