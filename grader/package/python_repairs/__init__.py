"""Repairs of Python sources, on their text: the corrected script, and which lines were changed why.

`examine.py` is the entry: it calls `syntax.py` for what does not parse, and the others for what does not run as meant.
It runs in a child process with limits (`repairs/python.py` starts it); nothing of the student's is executed.
"""
