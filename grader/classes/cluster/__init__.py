"""The submissions of a batch graded by the workers of a Dask cluster.

Results come back as files: a worker packs a submission's folder into one file and leaves it in the exchange, the client
unpacks it into place. Nobody but the client writes into the batch's folder.
"""

from grader.classes.cluster.executor import ClusterHands

__all__ = ["ClusterHands"]
