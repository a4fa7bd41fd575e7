"""What `firefox` and its like do where the grader runs them (`open.sh`): tell the arena's master what to open.

Prints nothing and always succeeds: without a master there is no one to tell. The grader has no screen, so what a
script of the package finds in `DISPLAY` names none.
"""

import os
import socket
import sys
import xmlrpc.client
from http.client import HTTPException

PATIENCE_S = 2.0


def tell(uri, program, arguments):
    """Return whether the master at `uri` took note."""
    socket.setdefaulttimeout(PATIENCE_S)
    try:
        xmlrpc.client.ServerProxy(uri).noteOpened("/" + program, program, arguments)
    except (OSError, HTTPException, xmlrpc.client.Error):
        return False
    return True


def clean(argument):
    """Return the argument as text that XML can carry."""
    text = os.fsencode(argument).decode("utf-8", "replace")
    return "".join(c if c.isprintable() or c in "\t\n" else "\ufffd" for c in text)


def main(program, *arguments):
    uri = os.environ.get("ROS_MASTER_URI", "")
    if uri.startswith("http://"):
        tell(uri, program, [clean(a) for a in arguments])


if __name__ == "__main__":
    main(*sys.argv[1:])
