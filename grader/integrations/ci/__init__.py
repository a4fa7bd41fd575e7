"""What `grader ci` asks of a CI system's variables, and tells it."""
