#!/usr/bin/env python3
"""Stands before `empy`, which Python would compile again on every start: the same program, from its module."""

import sys
from importlib.machinery import SourceFileLoader

EM = "@EM@"

if __name__ == "__main__":
    loader = SourceFileLoader("em", EM)
    module = sys.modules["em"] = type(sys)("em")
    module.__file__ = EM
    loader.exec_module(module)
    module.main()
