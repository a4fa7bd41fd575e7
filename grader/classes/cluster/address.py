"""Which clusters `--cluster` may name: those where both ends show certificates, others only if that is asked for."""

from __future__ import annotations

import re

from grader.errors import UsageError

LOCAL = "local"
EXTRA = 'pip install "ros-lab-grader[cluster]"'
ENCRYPTED = ("tls", "wss")
"""Of Dask's protocols, those in which both ends show certificates."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx)://(\[[0-9A-Fa-f:.%]+\]|[^\s:/\[\]@]+):[0-9]{1,5}/?")


def check_address(text: str, *, insecure: bool = False) -> str:
    """What `--cluster` says: `tls://host:8786`, or `local`; with `insecure` also `tcp://host:8786` and its like.

    Raises UsageError for what is neither, and where Dask is missing.
    """
    if text != LOCAL and not _ADDRESS.fullmatch(text):
        raise UsageError(
            f"--cluster {text}: not the address of a Dask scheduler",
            hint="give tls://host:8786 as `dask scheduler` prints it, or `local`",
        )
    if text != LOCAL and not is_encrypted(text) and not insecure:
        raise UsageError(
            f"--cluster {text}: this scheduler asks for no certificate: "
            "all who reach its port can run programs as its user",
            hint="use tls:// (docs/how-to/cluster.md says how); where nobody else is in that network, "
            "add --cluster-insecure",
        )
    try:
        import cryptography  # noqa: F401, PLC0415 - only to know that it is there: `local` makes certificates
        import distributed  # noqa: F401, PLC0415 - as above
    except ImportError as error:
        raise UsageError(f"--cluster needs Dask: {error}", hint=EXTRA) from error
    return text


def is_encrypted(address: str) -> bool:
    """Whether who listens there, scheduler or worker, asks for a certificate."""
    return address.partition("://")[0] in ENCRYPTED
