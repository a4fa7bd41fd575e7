"""The platforms that the grader runs on: GitHub, GitLab, Gradescope, PrairieLearn."""
