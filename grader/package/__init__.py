"""What the files of a package say, with file and line.

A `Submission` comes in, `PackageFacts` go out. Nothing of the student's is executed; whether the facts are right or
wrong is for `checks` to say.

`repairs/` holds the kinds of repair, a file for each kind of file. `python_repairs/` works out the lines of Python that
they write; `grader/line_slips/` knows what is wrong with single lines.
"""
