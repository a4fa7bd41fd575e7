"""A class graded side by side: a roster comes in, a folder of results with `run.json` and gradebooks goes out.

Begin reading at `run.run_batch`. `regrade` judges a class again from its evidence, `reports` settles results again and
writes their reports. How one submission is graded is the business of
`grader.pipeline`, other machines are that of `classes.cluster`.
"""
