"""What an instructor adds to a rubric: checks in a file beside it, and tests for pytest (docs/how-to/own-checks.md)."""
