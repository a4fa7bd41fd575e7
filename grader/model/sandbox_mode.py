"""Whether students' code runs in a sandbox. The command line's parser imports this, so nothing else is loaded here."""

from typing import Literal

SandboxMode = Literal["auto", "require", "none"]
"""If possible (`auto`), always (`require`), or never (`none`)."""
