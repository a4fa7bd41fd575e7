"""A worker that ends processes with nothing to do at once."""

from grader.classes.cluster import remote

remote.IDLE_S = 0.5
