"""Tools for authors of rubrics: a first rubric from a correct package, and tests of whether a rubric notices mistakes.

In comes a correct package; out goes a proposed rubric as YAML (`propose.propose_rubric`), or the result of a rubric's
test (`mutation/`). Recording and judging are the pipeline's business, reading and checking rubrics that of `rubric/`.
"""
