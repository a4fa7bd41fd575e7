"""The platforms that run the grader: CI jobs of GitHub and GitLab, exports for Gradescope and PrairieLearn.

A result comes in, and the form that the platform reads goes out. Grading is for `pipeline`, the reports for `report`.
"""
