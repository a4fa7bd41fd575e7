"""What an instructor adds to a rubric: checks in a Python file beside it, and tests for pytest (docs/own-checks.md)."""
