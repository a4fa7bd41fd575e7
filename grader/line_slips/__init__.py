"""What is wrong with a line of a file, and the line as it should be: a module for each kind of file.

`text` is for any text, with the record of such a slip; `python`, `cmake`, `xml` and `yaml` know the habits of theirs.
A text or a line comes in, and slips go out, pure; checks put them in words, and repairs write them. What it takes to
parse a file, and whether a line makes it a good one, is for `package`.
"""
