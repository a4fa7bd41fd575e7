"""A script's syntax tree, which all repairs look through: parsed once, and gone through once.

It runs in a child process: the standard library only, and nothing is executed.
"""

from __future__ import annotations

import ast
from functools import lru_cache


@lru_cache(maxsize=2)
def tree_of(text: str) -> ast.Module:
    """Return the tree of a script, which nobody may change. Raises what `ast.parse` raises."""
    return ast.parse(text)


@lru_cache(maxsize=64)
def nodes_in(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return this node of such a tree and all below it, as `ast.walk` has them."""
    return tuple(ast.walk(tree))
