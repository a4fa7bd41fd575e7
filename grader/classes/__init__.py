"""Many submissions at once.

A roster comes in; a class's folder of results goes out, with gradebooks, a page and a comparison. How one submission is
graded is the pipeline's business; what a single report looks like is `report`'s.
"""
