"""The grader packed for where it is used: Gradescope's autograder, PrairieLearn's external grader."""
