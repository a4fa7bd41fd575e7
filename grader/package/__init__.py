"""What the files of a package say, with file and line.

A `Submission` comes in, `PackageFacts` go out. Nothing of the student's is executed; whether the facts are right or
wrong is for `checks` to say.

`repairs/` holds the kinds of repair, a file for each kind of file. The lines that they write are worked out here:
`line_slips`, `cmake_slips` and `xml_slips` for text, CMake and XML; for Python `source_repair`, which calls
`syntax_repair`, `name_repair`, `member_repair`, `call_repair` and `import_repair`.
"""
