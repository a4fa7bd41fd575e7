"""A class graded side by side: a roster comes in, a folder of results with `run.json` and gradebooks goes out.

Begin reading at `run.run_batch`. `job` grades one submission and writes its folder. `regrade` judges a class again
from its evidence; `renew_results` does the work: it judges, settles and reports again what earlier gradings left.
How one submission is graded is the business of `pipeline`, other machines are that of `classes.cluster`.
"""
