"""`grader review DIR`: a web page served only on this machine, on which an instructor looks at a class and decides."""
