#!/usr/bin/env python3
"""Runs `empy` from its module, whose compiled form Python keeps; of a program it keeps none, and compiles it each time.

It takes the place of `empy` in the sandbox, with the same arguments and output: the template engine of ROS that makes
message classes. `@EM@` is replaced by the path of its module when it is put there (`sandbox_files.py`).
"""

import sys
from importlib.machinery import SourceFileLoader

EM = "@EM@"

if __name__ == "__main__":
    loader = SourceFileLoader("em", EM)
    module = sys.modules["em"] = type(sys)("em")
    module.__file__ = EM
    loader.exec_module(module)
    module.main()
