"""The command line: words come in, printed text and an exit code go out.

`commands/` has one typed function per command, with what the parser, help, man page, completion and reference pages are
made from (`declare`, `parser`). Grading itself is not its business: see `pipeline`, `classes`, `student`.
"""
