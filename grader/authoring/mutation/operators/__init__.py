"""All operators, a file for each family. Importing this fills the registry."""

from grader.authoring.mutation.registry import OPERATORS

__all__ = [
    "OPERATORS",
    "build",
    "counter",
    "files",
    "launch",
    "life",
    "listener",
    "logs",
    "manifest",
    "message",
    "names",
    "params",
    "shebang",
    "syntax",
    "timing",
    "topics",
    "yaml",
]
