"""All operators, a file for each family. Importing this fills the registry."""

from grader.authoring.mutation.operators import files, launch, messages, nodes, packaging, parameters, topics
from grader.authoring.mutation.registry import OPERATORS

__all__ = ["OPERATORS", "files", "launch", "messages", "nodes", "packaging", "parameters", "topics"]
