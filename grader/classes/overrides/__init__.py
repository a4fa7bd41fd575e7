"""`overrides.yaml`: what people decided about criteria, read and written."""

from grader.classes.overrides.read import FILE, Overrides, read_overrides
from grader.classes.overrides.write import write_override

__all__ = ["FILE", "Overrides", "read_overrides", "write_override"]
