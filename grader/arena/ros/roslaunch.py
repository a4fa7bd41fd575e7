#!/usr/bin/env python3
"""Runs the real `roslaunch`, with Python's own distutils loaded before it.

It takes the place of `roslaunch` in the sandbox, with the same arguments and output. roslaunch asks distutils for one
function; where setuptools gives its own distutils in place of Python's (`_distutils_hack`), all of setuptools would be
loaded for that on every start. `@PROGRAM@` is replaced by the path of the real one (`sandbox_files.py`).
"""

import os
import runpy
import sys
import warnings

PROGRAM = "@PROGRAM@"


def load_pythons_own_distutils():
    hack = sys.modules.get("_distutils_hack")
    if hasattr(hack, "remove_shim"):
        hack.remove_shim()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DeprecationWarning)
                import distutils.spawn  # noqa: F401, PLC0415 - by the first that asks
        except ImportError:  # a Python without: then it is setuptools' after all
            hack.add_shim()


if __name__ == "__main__":
    load_pythons_own_distutils()
    sys.argv[0] = PROGRAM
    # As Python itself would have set it for the real one.
    sys.path[0] = os.path.dirname(PROGRAM)
    runpy.run_path(PROGRAM, run_name="__main__")
