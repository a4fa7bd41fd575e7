"""What several checks work out of a run before they judge: pure functions, no I/O. Imports no family of checks."""
