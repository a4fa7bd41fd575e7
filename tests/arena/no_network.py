"""In the place of `ros/network.py`: becomes the program that its arguments name, in no namespace of its own."""

import os
import sys

if __name__ == "__main__":
    os.execv(sys.argv[1], sys.argv[1:])  # noqa: S606 - becoming that program is what it is for
