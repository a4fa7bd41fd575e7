"""Measures what the grader promises; `python -m benchmarks.run --help`."""
