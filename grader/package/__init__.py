"""What the files of a package say, with file and line.

A `Submission` comes in, `PackageFacts` go out. Nothing of the student's is executed; whether the facts are right or
wrong is for `checks` to say.

`repairs/` holds the kinds of repair, a file for each kind of file. The lines that they write are worked out here:
`line_corrections` for any text, `xml_corrections` for XML, `cmake_corrections` for CMake; for Python `python_repairs/`.
"""
