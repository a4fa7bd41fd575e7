"""What `grader check` does for a student besides grading: check again on each save, tell what git lacks."""
