"""The arena: workspace, build, sandbox and the managed roscore, seen from the grader's side."""
