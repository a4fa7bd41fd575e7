"""All operators, a file for each family. Importing this fills the registry."""

from grader.authoring.mutation.operators import launch, messages, nodes, packaging, topics
from grader.authoring.mutation.registry import OPERATORS

__all__ = ["OPERATORS", "launch", "messages", "nodes", "packaging", "topics"]
