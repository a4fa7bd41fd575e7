"""The command line: what a user typed comes in; printed text and an exit code go out.

`commands/` has one typed function per command, with what the parser, help, man page, completion and reference pages are
made from (`declare`); `main` parses the words and calls one of them. Grading itself is not its business: see
`pipeline`, `classes`, `student`.
"""
