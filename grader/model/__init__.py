"""The records that pass from one room to the next: frozen, typed, without any I/O.

Every definition that several rooms need is here once: statuses, results, package facts, rates. Reading, writing and
judging them is the business of other rooms. The parser of the command line imports this file, so it loads nothing else.
"""

from typing import Literal

SandboxMode = Literal["auto", "require", "none"]
"""Whether students' code runs in a sandbox: if possible (`auto`), always (`require`), or never (`none`)."""
